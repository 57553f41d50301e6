"""`make release-check`: wheel and source package, installed into clean environments and used there, far from this checkout.

    python -m tests.release_check [--pythons 3.11 3.12 3.13] [--short] [--tests PATH ...]

Every Python gets two environments: the newest versions of the dependencies, and the least that `pyproject.toml`
allows (uv's lowest-direct; of versions that have a wheel for that Python). One more is editable.
`tests/release_smoke.py` runs in each, in an empty folder; its numbers must agree. With `--tests` these tests
run there too, against what is installed. The source package must hold the documents and build the same wheel.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[1]
PYTHONS = ("3.11", "3.12", "3.13")
NEWEST, LEAST, EDITABLE = "newest", "least", "editable, newest"
FOR_TESTS = ("pytest>=8.2", "hypothesis>=6.100", "h5py>=3.11", "packaging>=24")
AGREE = 1e-6
"""Relative difference that numbers of two environments may have: other versions of the linear algebra libraries add up in another order."""
TOLD = ("numpy", "scipy", "mujoco", "pydantic", "rerun-sdk", "pyarrow", "matplotlib", "bokeh")


@dataclass
class Environment:
    """One clean environment, and what came of it; `failed` is empty where all went well."""

    python: str
    kind: str
    folder: Path
    versions: dict[str, str]
    done: list[str]
    numbers: dict[str, list[float]]
    failed: str = ""
    seconds: float = 0.0

    @property
    def scripts(self) -> Path:
        return self.folder / ("Scripts" if os.name == "nt" else "bin")


def call(*arguments: object, cwd: Path, **more: str) -> str:
    """Standard output; SystemExit with the end of what it said where it fails. Nothing of this checkout is on the path."""
    hidden = ("PYTHONPATH", "MYPYPATH", "VIRTUAL_ENV", "THERMOSPINDLE_CACHE")
    environment = {k: v for k, v in os.environ.items() if k not in hidden} | more
    done = subprocess.run([*map(str, arguments)], cwd=cwd, env=environment, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, arguments))[:300]}: {(done.stdout + done.stderr)[-3000:]}")
    return done.stdout


def uv() -> str:
    found = Path(sys.executable).with_name("uv")
    if found.exists():
        return str(found)
    if other := shutil.which("uv"):
        return other
    raise SystemExit("uv is not there: pip install uv")


def interpreter(wanted: str) -> Path | None:
    """A Python of a version: on the path, of pyenv, or one that uv knows; None where there is none."""
    of_pyenv = Path(os.environ.get("PYENV_ROOT") or Path.home() / ".pyenv") / "versions"
    candidates = [shutil.which(f"python{wanted}"), *sorted(of_pyenv.glob(f"{wanted}.*/bin/python"))]
    known = subprocess.run([uv(), "python", "find", "--no-python-downloads", "--system", wanted], capture_output=True, text=True)
    candidates.append(known.stdout.strip() if known.returncode == 0 else None)
    for candidate in candidates:
        if candidate:
            code = "import sys; print('%d.%d' % sys.version_info[:2])"
            told = subprocess.run([str(candidate), "-c", code], capture_output=True, text=True)
            if told.returncode == 0 and told.stdout.strip() == wanted:
                return Path(candidate)
    return None


def packages(folder: Path) -> tuple[Path, Path]:
    """(wheel, source package) of the checkout's files as git has them, the wheel made from the source package."""
    source = folder / "source"
    source.mkdir()
    names = call("git", "ls-files", "-z", "--cached", "--others", "--exclude-standard", cwd=ROOT).split("\0")
    for name in filter(None, names):
        file = ROOT / name
        if file.is_symlink() or file.exists():
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(file, source / name, follow_symlinks=False)
    call(uv(), "build", "--quiet", "--out-dir", folder / "dist", source, cwd=folder)
    [wheel], [sdist] = (folder / "dist").glob("*.whl"), (folder / "dist").glob("*.tar.gz")
    return wheel, sdist


def check_packages(wheel: Path, sdist: Path) -> list[str]:
    """What is wrong with what they hold."""
    inside = set(zipfile.ZipFile(wheel).namelist())
    with tarfile.open(sdist) as archive:
        source = {name.partition("/")[2] for name in archive.getnames()}
    tracked = set(filter(None, call("git", "ls-files", "-z", "docs", "scenes", "tests", cwd=ROOT).split("\0")))
    wrong = [f"the source package lacks {name}" for name in sorted(tracked - source)]
    wrong += [f"the wheel lacks {name}" for name in sorted(n for n in tracked if n.startswith("scenes/")) if f"thermospindle/{name}" not in inside]
    wrong += [f"the source package lacks {name}" for name in ("CHANGELOG.md", "README.md", "LICENSE", "Makefile", "constraints.txt") if name not in source]
    return wrong + [f"the wheel holds {name}" for name in sorted(inside) if not name.startswith("thermospindle")]


def made(python: str, of: Path, kind: str, folder: Path, wheel: Path, tests: Sequence[str]) -> Environment:
    """A clean environment with the package in it."""
    place = folder / f"{python}-{kind.replace(', ', '-')}"
    environment = Environment(python, kind, place, {}, [], {})
    call(uv(), "venv", "--quiet", "--python", of, place, cwd=folder)
    what: list[object] = ["--editable", folder / "source"] if kind == EDITABLE else [wheel]
    if kind == LEAST:
        what += ["--resolution", "lowest-direct"]
    if kind != EDITABLE:
        what += ["--no-build"]  # a version that has no wheel for this Python would need a compiler
    call(uv(), "pip", "install", "--quiet", "--python", place, *(FOR_TESTS if tests else ()), *what, cwd=folder)
    code = f"import json; from importlib.metadata import version; print(json.dumps({{n: version(n) for n in {TOLD!r}}}))"
    environment.versions = json.loads(call(environment.scripts / "python", "-c", code, cwd=folder))
    return environment


def used(environment: Environment, folder: Path, tests: Sequence[str], short: bool) -> None:
    """The smoke test, in an empty folder with a home of its own; and `tests`, of a copy that holds no package."""
    place = Path(tempfile.mkdtemp(dir=folder))
    told = json.loads(
        call(
            environment.scripts / "python", folder / "release_smoke.py", environment.scripts / "spindle", *(["--short"] if short else []),
            cwd=place, HOME=str(place), PYTHONNOUSERSITE="1",
        )
    )
    inside = folder / "source" if environment.kind == EDITABLE else environment.folder
    if not Path(told["where"]).is_relative_to(inside.resolve()):
        raise SystemExit(f"thermospindle was imported from {told['where']}")
    environment.done, environment.numbers = told["done"], told["numbers"]
    if tests:
        for name in ("tests", "scenes", "docs"):
            shutil.copytree(ROOT / name, place / name, ignore=shutil.ignore_patterns("__pycache__"))
        (place / "pytest.ini").write_text("[pytest]\npythonpath = .\naddopts = -q --import-mode=importlib -m 'not slow'\nmarkers =\n  slow: long\n", encoding="utf-8")
        said = call(environment.scripts / "python", "-m", "pytest", *tests, cwd=place, HOME=str(place))
        environment.done.append(said.strip().splitlines()[-1])


def disagreements(every: Sequence[Environment]) -> list[str]:
    """Numbers of an environment that are not those of the first one."""
    found = []
    known = [e for e in every if e.numbers]
    for other in known[1:]:
        for name, values in known[0].numbers.items():
            if not np.allclose(values, other.numbers[name], rtol=AGREE, atol=0):
                found.append(f"{name}: {known[0].python} {known[0].kind} and {other.python} {other.kind} differ by more than {AGREE:g}")
    return found


def site(sdist: Path, folder: Path, of: Path) -> None:
    """The documentation's site from the source package, without a warning."""
    with tarfile.open(sdist) as archive:
        archive.extractall(folder / "unpacked", filter="data")
    [source] = (folder / "unpacked").iterdir()
    place = folder / "docs-environment"
    call(uv(), "venv", "--quiet", "--python", of, place, cwd=folder)
    call(uv(), "pip", "install", "--quiet", "--python", place, f"{sdist}[docs]", cwd=folder)
    python = place / ("Scripts" if os.name == "nt" else "bin") / "python"
    call(python, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html", source / "docs" / "site", folder / "site", cwd=folder)


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pythons", nargs="+", default=PYTHONS, metavar="X.Y")
    parser.add_argument("--tests", nargs="+", default=(), metavar="PATH", help="tests to run in every environment too")
    parser.add_argument("--short", action="store_true", help="leave out the diagnosis, the time domain and most scenes")
    parser.add_argument("--no-site", action="store_true", help="do not build the documentation from the source package")
    asked = parser.parse_args(arguments)
    console, every, wrong = Console(), [], []
    there = {python: interpreter(python) for python in asked.pythons}
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        shutil.copy(ROOT / "tests" / "release_smoke.py", folder)
        wheel, sdist = packages(folder)
        wrong += check_packages(wheel, sdist)
        console.print(f"{wheel.name} {wheel.stat().st_size / 1e6:.1f} MB, {sdist.name} {sdist.stat().st_size / 1e6:.1f} MB")
        found = [(python, of) for python, of in there.items() if of is not None]
        wanted = [(python, of, kind) for python, of in found for kind in (NEWEST, LEAST)] + [(*pair, EDITABLE) for pair in found[:1]]
        for python, of, kind in wanted:
            start = time.perf_counter()
            environment = Environment(python, kind, folder, {}, [], {})
            every.append(environment)
            try:
                environment = every[-1] = made(python, of, kind, folder, wheel, asked.tests)
                used(environment, folder, asked.tests, asked.short)
            except SystemExit as error:
                environment.failed = str(error)
            environment.seconds = time.perf_counter() - start
            console.print(f"{python}, {kind}: {environment.failed or 'well'}, {environment.seconds:.0f} s", markup=False)
        if found and not asked.no_site:
            try:
                site(sdist, folder, found[0][1])
                console.print("the documentation's site, from the source package: well")
            except SystemExit as error:
                wrong.append(f"the site: {error}")
    wrong += disagreements(every)
    table = Table("Python", "dependencies", "of them", "done", show_edge=False)
    for e in every:
        table.add_row(e.python, e.kind, ", ".join(f"{n} {v}" for n, v in e.versions.items()), f"FAILED: {e.failed[-200:]}" if e.failed else "; ".join(e.done))
    console.print(table)
    missing = [python for python, of in there.items() if of is None]
    for python in missing:
        console.print(f"Python {python} is not on this machine: nothing is known of it")
    for sentence in wrong:
        console.print(sentence, markup=False)
    good = sum(not e.failed for e in every)
    console.print(f"{good} of {len(every)} environments well, {len(missing)} Pythons missing, {len(wrong)} other faults")
    return 0 if every and good == len(every) and not missing and not wrong else 1


if __name__ == "__main__":
    sys.exit(main())
