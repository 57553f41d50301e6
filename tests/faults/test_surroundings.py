"""A full disk, a folder that cannot be written, no home, a damaged cache, no terminal, a closed pipe, two runs into one folder."""

import os
import resource
import shutil
import subprocess
import sys
import threading
from contextlib import contextmanager

import pytest

from tests.faults.verbs import QUICKEST, VERBS, Verb, launched, marked, prepare, surroundings, tree, work_folders

LEAST = 300  # bytes that a file may have: less than what any verb writes
QUICK = ("new", "modes", "add", "import")


def params(names=None):
    """Every verb, the quick ones in every run of the tests."""
    every = [v for v in VERBS if names is None or v.name in names]
    return [pytest.param(v, id=v.name.replace(" ", "_"), marks=() if v is QUICKEST else pytest.mark.slow) for v in every]


def said(done: subprocess.CompletedProcess) -> str:
    """What is said of a fault: one sentence, no traceback."""
    assert done.returncode == 2, (done.returncode, done.stderr[-1500:])
    assert "Traceback" not in done.stderr
    lines = [line for line in done.stderr.splitlines() if line.startswith("spindle: ")]
    assert len(lines) == 1, done.stderr
    return lines[0]


@contextmanager
def mounted(place, *options):
    """Something mounted on a folder; the test is skipped where that is not allowed."""
    done = subprocess.run(["mount", *options, str(place)], capture_output=True, text=True)
    if done.returncode:
        pytest.skip(f"mount is not allowed: {done.stderr.strip()}")
    try:
        yield
    finally:
        subprocess.run(["umount", "-l", str(place)], check=True)


def older(verb: Verb, place, tmp_path, cache) -> dict[str, str]:
    """A result that stands there before, of verbs that may replace one; digests of what then is there."""
    if verb.whole is marked:
        assert launched(place, verb.line(place), cache).returncode == 0
        return tree(place / verb.target)
    return {}


@pytest.mark.parametrize("verb", params())
def test_no_file_can_grow(verb, tmp_path, cache):
    """As on a full disk, wherever one is root or not: what was there stays, nothing is left behind, and with room again it works."""
    place = prepare(tmp_path / "here")
    before = older(verb, place, tmp_path, cache)

    def small() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (LEAST, LEAST))

    sentence = said(launched(place, verb.line(place), tmp_path / "empty cache", preexec_fn=small))
    assert "File too large" in sentence or "too large" in sentence.lower() or "size" in sentence, sentence
    if verb.name != "study":
        assert (tree(place / verb.target) if (place / verb.target).exists() else {}) == before
        assert not work_folders(place)
    assert launched(place, verb.line(place), cache).returncode == 0


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt" or os.getuid() != 0, reason="only root can mount a small disk")
@pytest.mark.parametrize("verb", params(QUICK))
def test_a_disk_that_is_full(verb, tmp_path, cache):
    (tmp_path / "disk").mkdir()
    with mounted(tmp_path / "disk", "-t", "tmpfs", "-o", "size=96k", "tmpfs"):
        place = prepare(tmp_path / "disk" / "here")
        filler = tmp_path / "disk" / "filler"
        with filler.open("wb", buffering=0) as stream:
            try:
                while True:
                    stream.write(bytes(4096))
            except OSError:
                pass
        said(subprocess.run([sys.executable, "-m", "thermospindle", *verb.line(place)], env=surroundings(cache), cwd=tmp_path, capture_output=True, text=True))
        assert not (place / verb.target).exists()
        assert not work_folders(place)
        filler.unlink()


@pytest.mark.slow
@pytest.mark.parametrize("verb", params(QUICK))
def test_a_folder_that_cannot_be_written(verb, tmp_path, cache):
    place = prepare(tmp_path / "here")
    command = [sys.executable, "-m", "thermospindle", *verb.line(place)]

    def refused() -> None:
        sentence = said(subprocess.run(command, env=surroundings(cache), cwd=tmp_path, capture_output=True, text=True))
        assert "Read-only file system" in sentence or "Permission denied" in sentence

    if os.getuid() == 0:
        subprocess.run(["mount", "--bind", str(place), str(place)], check=False, capture_output=True)
        try:
            with mounted(place, "-o", "remount,ro,bind"):
                refused()
        finally:
            subprocess.run(["umount", "-l", str(place)], check=False, capture_output=True)
    else:
        place.chmod(0o555)
        try:
            refused()
        finally:
            place.chmod(0o755)
    assert not (place / verb.target).exists()


@pytest.mark.slow
@pytest.mark.parametrize("home", [None, "/nowhere/at/all", "/dev/null"])
def test_without_a_home(home, tmp_path):
    """The cache and what libraries keep have no place; the answer is the same."""
    kept = ("HOME", "THERMOSPINDLE_CACHE", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "MPLCONFIGDIR")
    own = {k: v for k, v in surroundings(tmp_path / "cache").items() if k not in kept} | ({} if home is None else {"HOME": home})
    command = [sys.executable, "-m", "thermospindle", "check", str(VERBS[1].command[1]), "--out", str(tmp_path / "out")]
    done = subprocess.run(command, env=own, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "out" / "check.json").is_file()


@pytest.mark.slow
@pytest.mark.parametrize("damage", [b"", b"PK\x03\x04 no more", "cut", "other"])
def test_a_damaged_cache(damage, tmp_path):
    """It is computed again, to the same numbers."""
    place, cache = prepare(tmp_path / "here"), tmp_path / "cache"
    command = [sys.executable, "-m", "thermospindle", "modes", str(VERBS[1].command[1]), "--temperature", "60", "--json"]

    def answer() -> str:
        done = subprocess.run(command, env=surroundings(cache), cwd=place, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    first = answer()
    files = sorted(cache.glob("*.npz"))
    assert files
    for k, file in enumerate(files):
        if damage == "cut":
            file.write_bytes(file.read_bytes()[: 100 + 7 * k])
        elif damage == "other":
            file.write_bytes(files[k - 1].read_bytes())
        else:
            file.write_bytes(damage)
    assert answer() == first
    assert answer() == first


@pytest.mark.parametrize("closed", ["| true", *(pytest.param(c, marks=pytest.mark.slow) for c in ("0<&-", "1>&-", "2>&-", "0<&- 1>&- 2>&-", "> /dev/full", "| head -c 1 > /dev/null"))])
def test_no_terminal_and_closed_pipes(closed, tmp_path, cache):
    """A result that has a folder stands there whole, whoever listens to what is printed."""
    place = prepare(tmp_path / "here")
    line = " ".join(f"'{part}'" for part in [sys.executable, "-m", "thermospindle", *QUICKEST.line(place)])
    done = subprocess.run(["bash", "-c", f"set -o pipefail; {line} {closed}"], env=surroundings(cache), cwd=place, capture_output=True, text=True)
    assert "Traceback" not in done.stderr
    assert done.returncode in (0, 2), done.stderr
    assert marked(place / "out", tree(place / "out"))
    assert not work_folders(place)


@pytest.mark.slow
@pytest.mark.parametrize("verb", params(("modes", "simulate", "study", "new", "add")))
def test_two_runs_into_one_folder(verb, tmp_path, cache):
    """Each ends well or says why not; what stands there in the end is whole."""
    place, reference = prepare(tmp_path / "here"), prepare(tmp_path / "alone" / "here")
    assert launched(reference, verb.line(reference), cache).returncode == 0
    found: list[subprocess.CompletedProcess] = []

    def one() -> None:
        command = [sys.executable, "-m", "thermospindle", *verb.line(place)]
        found.append(subprocess.run(command, env=surroundings(cache), cwd=place, capture_output=True, text=True))

    both = [threading.Thread(target=one) for _ in range(3)]
    for thread in both:
        thread.start()
    for thread in both:
        thread.join()
    assert any(done.returncode == 0 for done in found), [done.stderr for done in found]
    for done in found:
        assert done.returncode == 0 or said(done)
    names = {name for name in tree(reference / verb.target) if not name.endswith(".rrd")}
    assert {name for name in tree(place / verb.target) if not name.endswith(".rrd")} == names
    assert not work_folders(place)
    shutil.rmtree(place)
