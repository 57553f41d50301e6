"""What is trusted, and what is not: docs/site/security.md says it, and these tests hold it."""

import os
import re
import subprocess
import sys
import warnings

import pytest

from tests.conftest import ROOT, SCENE
from thermospindle.cli import main
from thermospindle.model.errors import BadInput
from thermospindle.model.files import kept as files
from thermospindle.model.scene.reading import load

TRAPS = ("numpy", "scipy", "loky", "cloudpickle", "mujoco", "rerun", "matplotlib", "json", "thermospindle", "sitecustomize", "usercustomize", "effect", "conftest")


@pytest.fixture
def trapped(tmp_path):
    """A folder with Python files by the names of everything that might be imported; any that runs leaves a mark."""
    for name in TRAPS:
        (tmp_path / f"{name}.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'a').write({name!r})\n", encoding="utf-8")
    return tmp_path


def run(code, cwd, *arguments):
    """As the command `spindle` runs: its own folder first on the path, not the one it stands in."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run([sys.executable, "-P", "-c", code, *map(str, arguments)], cwd=cwd, env=environment, capture_output=True, text=True)


PARALLEL = """
import time
from thermospindle.cli import main
from thermospindle.model.parallel import in_parallel
def work(k):
    time.sleep(0.8)
    return k, __import__("os").getpid()
print(len({pid for _, pid in in_parallel(work, range(6), 2)}))
"""


@pytest.mark.slow
def test_nothing_is_imported_from_the_folder_one_stands_in(trapped):
    """Nor by the processes that share the work, nor by the one that tries a log."""
    done = run(PARALLEL, trapped)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 1, "no worker was started"
    (trapped / "x.rrd").write_bytes(b"RRF2 damaged")
    done = run("import sys; from thermospindle.cli import main; sys.exit(main(sys.argv[1:]))", trapped, "inspect", trapped / "x.rrd")
    assert done.returncode == 2, done.stderr
    assert not (trapped / "ran").exists(), (trapped / "ran").read_text()


def test_a_python_file_beside_a_scene_does_not_run(trapped, capsys):
    """Effect files run where the command line names them, and nowhere else: a scene names effects, never files."""
    text = (SCENE / "spindle.toml").read_text(encoding="utf-8")
    for name in ("effect", "./effect.py", "effect.py"):
        (trapped / "spindle.toml").write_text(f'{text}\n[[effects]]\nname = "{name}"\norigin = "assumed"\n', encoding="utf-8")
        assert main(["modes", str(trapped)]) == 2
        assert "effect" in capsys.readouterr().err
    assert not (trapped / "ran").exists()


ROUGH = 1e-2  # of the finite elements: what is kept of it is one file a part, as of any other


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="Windows has no owners of this kind")
class TestCache:
    """Caches cannot be planted by another user."""

    @pytest.fixture(autouse=True)
    def forget(self):
        files.trusted.cache_clear()
        yield
        files.trusted.cache_clear()

    @pytest.fixture
    def place(self, tmp_path, monkeypatch):
        folder = tmp_path / "cache"
        monkeypatch.setenv("THERMOSPINDLE_CACHE", str(folder))
        return folder

    def test_the_own_one_is_used(self, place):
        place.mkdir(mode=0o700)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert files.trusted(place)

    @pytest.mark.parametrize("mode", [0o777, 0o1777, 0o702])
    def test_one_that_others_may_write_is_not(self, place, mode):
        place.mkdir()
        place.chmod(mode)
        with pytest.warns(UserWarning, match="others may write there"):
            assert not files.trusted(place)

    def test_one_of_another_user_is_not(self, place, monkeypatch):
        place.mkdir(mode=0o755)
        if os.geteuid() == 0:
            os.chown(place, 12345, 12345)
        else:
            monkeypatch.setattr(os, "geteuid", lambda: 12345)
        with pytest.warns(UserWarning, match="belongs to another user"):
            assert not files.trusted(place)

    def test_nor_one_in_a_folder_that_another_could_exchange(self, place, tmp_path):
        place.mkdir(mode=0o700)
        tmp_path.chmod(0o777)
        with pytest.warns(UserWarning, match="others may write there"):
            assert not files.trusted(place)
        tmp_path.chmod(0o700)

    def test_nor_one_that_is_not_there_yet_in_such_a_folder(self, place, tmp_path):
        tmp_path.chmod(0o777)
        with pytest.warns(UserWarning, match="others may write there"):
            assert not files.trusted(place / "deeper")
        tmp_path.chmod(0o700)

    def test_what_is_planted_is_not_read_and_the_answer_is_the_same(self, place, spindle):
        from thermospindle.thermal import influence
        from thermospindle.thermal.expansion import expand

        influence.forget()
        own = expand(spindle, 55.0, ROUGH)
        kept = {f.name: f.read_bytes() for f in place.glob("*.npz")}
        assert kept
        for file in place.glob("*.npz"):
            file.write_bytes(b"planted")
        place.chmod(0o777)
        files.trusted.cache_clear()
        influence.forget()
        with pytest.warns(UserWarning, match="computed anew"):
            assert expand(spindle, 55.0, ROUGH) == own
        assert {f.read_bytes() for f in place.glob("*.npz")} == {b"planted"}, "an open folder is not written to either"
        influence.forget()

    def test_what_is_made_is_closed_to_others(self, place):
        from thermospindle.thermal import influence
        from thermospindle.thermal.expansion import expand

        influence.forget()
        expand(load(SCENE), 41.0, ROUGH)
        assert not place.stat().st_mode & 0o077
        influence.forget()


def test_no_data_is_unpickled():
    """No reader of files takes pickles: numpy's are refused, and pickle is used between processes of one user alone."""
    found = {}
    for file in (p for folder in ("model", "thermal", "sim", "diagnosis", "report", "thermospindle") for p in (ROOT / folder).rglob("*.py") if not p.is_symlink()):
        text = file.read_text(encoding="utf-8")
        words = re.findall(r"pickle\.loads?|allow_pickle=True|\beval\(|\bexec\(|yaml\.|shelve|marshal|os\.system|shell=True", text)
        if words:
            found[file.relative_to(ROOT).as_posix()] = sorted(set(words))
    assert set(found) <= {"model/parallel.py", "sim/effects/rules.py", "diagnosis/draft/laws.py"}, found  # an effect already loaded; laws written in the program
    for file in ("model/files/kept.py", "sim/importing/files/arrays.py"):
        path = ROOT / file
        if path.exists():
            assert "np.load(" not in path.read_text(encoding="utf-8") or "allow_pickle=False" in path.read_text(encoding="utf-8")


@pytest.mark.parametrize("payload", ["</title><script>alert(1)</script>", *(pytest.param(p, marks=pytest.mark.slow) for p in ('"><img src=x onerror=alert(1)>', "</svg><svg onload=alert(1)>", "{{ 7 * 7 }}", "javascript:alert(1)"))])
def test_nothing_of_a_file_reaches_a_page_unescaped(tmp_path, capsys, payload):
    """Titles, names and sources of a scene and a campaign, on the pages of `check` and `compare`."""
    import json
    import shutil

    here = tmp_path / "scene"
    here.mkdir()
    text = (SCENE / "spindle.toml").read_text(encoding="utf-8")
    text = re.sub(r"^title = .*", lambda _: f"title = {json.dumps(payload)}", text, count=1, flags=re.MULTILINE)
    text = re.sub(r'name = "hub_top0"', lambda _: f"name = {json.dumps(payload[:10])}", text)
    text = re.sub(r'name = "hub plate"|"hub plate"', lambda m: m[0].replace('"hub plate"', json.dumps(payload)), text)
    (here / "spindle.toml").write_text(text, encoding="utf-8")
    campaign = tmp_path / "campaign"
    shutil.copytree(SCENE / "measured" / "jang_2003", campaign)
    own = (campaign / "campaign.toml").read_text(encoding="utf-8")
    (campaign / "campaign.toml").write_text(re.sub(r"^title = .*", lambda _: f"title = {json.dumps(payload)}", own, count=1, flags=re.MULTILINE), encoding="utf-8")
    for verb, more in (("check", []), ("compare", [campaign])):
        assert main([verb, str(here), *map(str, more), "--out", str(tmp_path / verb)]) == 0, capsys.readouterr().err
        capsys.readouterr()
        pages = [p for p in (tmp_path / verb).rglob("*") if p.suffix in (".html", ".svg", ".xml")]
        assert pages
        for page in pages:
            shown = page.read_text(encoding="utf-8")
            assert not re.search(r"<script>alert|<img src=x|<svg onload|href=.javascript:", shown), page
            assert ">49<" not in shown.replace(" ", ""), page


@pytest.mark.parametrize("table", ["/dev/zero", "pipe", "loop", "/etc/passwd", "../.."])
def test_a_table_that_a_scene_names_is_a_table(tmp_path, table):
    """What is none is refused, without a word of what stands in it, and nothing is waited for."""
    here = tmp_path / "scene"
    here.mkdir()
    os.mkfifo(here / "pipe")
    (here / "loop").symlink_to("loop")
    text = (SCENE.parent / "mk7702" / "spindle.toml").read_text(encoding="utf-8")
    changed = re.sub(r"\[bearings\.front1\.numbers\]\n(?:[^\[\n].*\n)*", f'[bearings.front1.numbers]\ntable = "{table}"\n', text)
    assert changed != text
    (here / "spindle.toml").write_text(changed, encoding="utf-8")
    with pytest.raises(BadInput) as refused:
        load(here)
    assert "root:" not in str(refused.value)
