"""Installed, from a wheel and editable: one name on the path, types seen, scenes there, nothing of a user's shadowed.

Every environment is an empty one that borrows the libraries of this; nothing is downloaded.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.conftest import ROOT
from tests.test_imports import FILES, imported
from thermospindle.model.machine import Condition
from thermospindle.sim.operating import operating_point

FOLDERS = ("model", "thermal", "sim", "diagnosis", "report", "scenes")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

SCRIPT = """
import model, sim, thermal  # a user's own, beside the script

assert (model.MINE, sim.MINE, thermal.MINE) == ("model", "sim", "thermal")

from thermospindle.model.machine import Condition
from thermospindle.model.parallel import in_parallel
from thermospindle.model.scene.reading import load
from thermospindle.sim.operating import operating_point

spindle = load("hdd_2003")
def frequencies(celsius):
    return [m.frequency for m in operating_point(spindle, Condition(celsius)).modes]

print(in_parallel(frequencies, [20.0], 2)[0][0])
assert (model.MINE, sim.MINE, thermal.MINE) == ("model", "sim", "thermal")
"""


def copy_of_checkout(folder: Path, links: bool = True) -> Path:
    """What an installation is built from; without `links` as git checks it out on Windows, a text file for each."""
    for name in ("pyproject.toml", "setup.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, folder / name)
    junk = shutil.ignore_patterns("__pycache__")
    for name in (*FOLDERS, "thermospindle", "editable"):
        shutil.copytree(ROOT / name, folder / name, symlinks=True, ignore=junk)
    for link in () if links else (folder / "editable" / "thermospindle", *(folder / "thermospindle" / name for name in FOLDERS)):
        target = link.readlink()
        link.unlink()
        link.write_text(target.as_posix(), encoding="utf-8")
    return folder


def tried(*arguments: object, cwd: Path) -> subprocess.CompletedProcess[str]:
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONSAFEPATH", "MYPYPATH")}
    return subprocess.run([*map(str, arguments)], cwd=cwd, env=environment, capture_output=True, text=True)


def call(*arguments: object, cwd: Path) -> str:
    done = tried(*arguments, cwd=cwd)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def pip(*arguments: object, cwd: Path) -> None:
    call(sys.executable, "-m", "pip", "--disable-pip-version-check", *arguments, cwd=cwd)


def wheel_of(checkout: Path, folder: Path) -> Path:
    pip("wheel", "--no-build-isolation", "--no-deps", "--no-index", "--wheel-dir", folder, checkout, cwd=folder)
    [wheel] = folder.glob("*.whl")
    return wheel


class Environment:
    """An empty virtual environment in which the libraries of this one can be imported, and no thermospindle."""

    def __init__(self, folder: Path) -> None:
        call(sys.executable, "-m", "venv", "--without-pip", folder, cwd=folder.parent)
        self.scripts = folder / ("Scripts" if os.name == "nt" else "bin")
        self.python = self.scripts / "python"
        here = "import sysconfig; print(sysconfig.get_path('purelib'))"
        self.site = Path(call(self.python, "-c", here, cwd=folder).strip())
        borrowed = Path(call(sys.executable, "-c", here, cwd=folder).strip())
        (self.site / "borrowed.pth").write_text(f"{borrowed}\n")  # a plain path: editable installs there are not seen here
        self.before = self.there()

    def there(self) -> set[str]:
        return {p.name for p in (*self.site.iterdir(), *self.scripts.iterdir()) if p.name != "__pycache__"}

    def paths(self) -> list[Path]:
        """Folders that an editable install has put on the path; none where an import hook finds the modules."""
        lines = [line for file in self.site.glob("__editable__*.pth") for line in file.read_text(encoding="utf-8").splitlines()]
        return [Path(line) for line in lines if not line.startswith("import")]

    def install(self, *what: object) -> None:
        pip("--python", self.python, "install", "--no-deps", "--no-index", "--no-build-isolation", *what, cwd=self.site)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    return wheel_of(copy_of_checkout(tmp_path_factory.mktemp("checkout")), tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module", params=["wheel", *(pytest.param(way, marks=pytest.mark.slow) for way in ("editable", "editable without links"))])
def installed(request, tmp_path_factory) -> Environment:
    environment = Environment(tmp_path_factory.mktemp("environment") / "venv")
    if request.param == "wheel":
        environment.install(request.getfixturevalue("wheel"))
    else:
        environment.install("--editable", copy_of_checkout(tmp_path_factory.mktemp("checkout"), "without" not in request.param))
    return environment


@pytest.fixture
def users(tmp_path) -> Path:
    """A user's folder, with names that are also ours."""
    (tmp_path / "sim").mkdir()
    for name in ("model.py", "sim/__init__.py", "thermal.py"):
        (tmp_path / name).write_text(f"MINE = {re.split('[./]', name)[0]!r}\n")
    (tmp_path / "script.py").write_text(SCRIPT)
    return tmp_path


def test_nothing_but_one_name_and_one_command_lands(request, installed, tmp_path):
    new = {re.sub(r"^__editable__.*", "__editable__", name) for name in installed.there() - installed.before}
    information = f"thermospindle-{PROJECT['version']}.dist-info"
    assert new in ({"thermospindle", information, "spindle"}, {"__editable__", information, "spindle"})
    paths = installed.paths()
    assert len(paths) == (request.node.callspec.params["installed"] == "editable"), "type checkers follow a path and no hook: test_types_are_seen asks mypy itself"
    assert [[p.name for p in path.iterdir()] for path in paths] == [["thermospindle"]] * len(paths)
    names = [*FOLDERS, "spindle", "tests"]
    seen = call(installed.python, "-c", f"from importlib.util import find_spec; print([n for n in {names} if find_spec(n)])", cwd=tmp_path)
    assert seen.strip() == "[]"


def test_pytest_finds_its_plugin(installed, tmp_path):
    code = "from importlib.metadata import entry_points; print([e.value for e in entry_points(group='pytest11') if e.name == 'thermospindle'])"
    assert call(installed.python, "-c", code, cwd=tmp_path).strip() == "['thermospindle.plugin']"


def test_a_users_own_modules_of_the_same_names_break_nothing(installed, users, spindle):
    """His script imports his and ours; ours finds the shipped scene by its name and gives the number that it gives here."""
    printed = float(call(installed.python, "script.py", cwd=users))
    assert printed == operating_point(spindle, Condition(20.0)).modes[0].frequency
    answer = json.loads(call(installed.scripts / "spindle", "modes", "hdd_2003", "--json", cwd=users))
    assert answer["modes"][0]["frequency_Hz"] == pytest.approx(printed)


@pytest.mark.slow
@pytest.mark.parametrize("way", ["wheel", "editable", "strictly editable without links"])
def test_types_are_seen(way, wheel, users, tmp_path_factory):
    """mypy reads the types of a wheel, of an editable install, and without symbolic links of one whose files are linked one by one
    (`editable_mode=strict`), and so finds the one error of this file."""
    environment = Environment(users / "venv")
    if way == "wheel":
        environment.install(wheel)
    else:
        strictly = ["--config-settings", "editable_mode=strict"] if "strictly" in way else []
        environment.install(*strictly, "--editable", copy_of_checkout(tmp_path_factory.mktemp("checkout"), links=not strictly))
    (users / "typed.py").write_text(
        "from thermospindle.model.machine import Condition\n"
        "reveal_type(Condition(20.0).temperature)\n"
        "Condition('warm')\n"
    )  # fmt: skip
    done = tried(sys.executable, "-m", "mypy", "--python-executable", environment.python, "typed.py", cwd=users)
    errors = [line for line in done.stdout.splitlines() if ": error:" in line]
    assert 'Revealed type is "builtins.float"' in done.stdout or 'Revealed type is "float"' in done.stdout
    assert len(errors) == 1
    assert errors[0].startswith("typed.py:3:")
    assert "arg-type" in errors[0]


def test_the_wheel_holds_every_module_and_all_data(wheel):
    inside = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    wanted = {f"thermospindle/{name}" for name in ("__init__.py", "__main__.py", "arguments.py", "cli.py", "failing.py", "front.py", "options.py", "plugin.py", "py.typed", "testing.py", "verbs.py")}
    for folder in FOLDERS:
        files = (f.relative_to(ROOT) for f in (ROOT / folder).rglob("*") if f.is_file() and "__pycache__" not in f.parts)
        wanted |= {f"thermospindle/{f.as_posix()}" for f in files}
    assert inside == wanted


@pytest.mark.slow
def test_without_symbolic_links_the_wheel_is_the_same(wheel, tmp_path):
    (tmp_path / "checkout").mkdir()
    (tmp_path / "wheel").mkdir()
    other = wheel_of(copy_of_checkout(tmp_path / "checkout", links=False), tmp_path / "wheel")
    assert sorted(zipfile.ZipFile(other).namelist()) == sorted(zipfile.ZipFile(wheel).namelist())


# ---------------------------------------------------------------- versions


def pins() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pairs = [line.split("==") for line in lines if not line.startswith("#")]
    return {canonicalize_name(name): pin for name, pin in pairs}


REQUIRED = [Requirement(r) for r in (*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["test"])]


@pytest.mark.parametrize("required", REQUIRED, ids=lambda r: r.name)
def test_a_dependency_has_a_range_and_a_pin_within_it(required):
    assert required.specifier
    assert not any(s.operator in ("==", "===") for s in required.specifier), "a pin here could not be installed beside anything else"
    assert required.specifier.contains(pins()[canonicalize_name(required.name)])
    assert required.specifier.contains(version(required.name))


def test_no_library_is_imported_without_being_required():
    """Imports of the product, against the names that its requirements install; h5py (extra hdf5)
    and distributed (extra cluster) are imported where they are used, pytest by its plugin."""
    modules = {"scikit-fem": "skfem", "rerun-sdk": "rerun"}
    given = {modules.get(r.name, r.name) for r in map(Requirement, PROJECT["dependencies"])}
    given |= {r.name for extra in ("hdf5", "cluster") for r in map(Requirement, PROJECT["optional-dependencies"][extra])} | {"pytest"}
    found = {name.split(".")[0] for file in FILES for name in imported(file)}
    assert found - set(sys.stdlib_module_names) - {"thermospindle"} == given
