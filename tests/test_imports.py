"""Imports run one way only and in no circle, and each heavy library is imported where the design says."""

import ast
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ORDER = ("model", "thermal", "sim", "diagnosis", "report")
FILES = [f for package in ORDER for f in sorted((ROOT / package).rglob("*.py"))] + sorted((ROOT / "thermospindle").glob("*.py"))
ONLY_IN = {
    "skfem": lambda f: f.parts[0] == "thermal",
    "mujoco": lambda f: f == Path("model/rotor/mjcf.py") or f.parts[0] == "sim",
    "rerun": lambda f: f.parts[:2] == ("report", "log"),
    "pyuff": lambda f: f == Path("sim/campaign/uff.py"),
    "bokeh": lambda f: f.parts[:2] == ("report", "workbench"),
    "tornado": lambda f: f.parts[:2] == ("report", "workbench"),
    "pyarrow": lambda f: f.parts[:2] == ("sim", "study") or f.parts[0] == "report" or f in (Path("diagnosis/fleet.py"), Path("model/files/unfinished.py")),
    "distributed": lambda f: f == Path("sim/study/executors.py"),
    "matplotlib": lambda f: f.parts[0] == "report",
}


def module_of(file: Path) -> str:
    parts = file.relative_to(ROOT).with_suffix("").parts
    parts = parts if parts[0] == "thermospindle" else ("thermospindle", *parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_of(f): f for f in FILES}


def imported(file: Path) -> set[str]:
    """Dotted names of everything a file imports, wherever in it: modules where they are ours, else as written."""
    names = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            within = [f"{node.module}.{alias.name}" for alias in node.names]
            names |= {name if name in MODULES else node.module for name in within}
    return names


@pytest.mark.parametrize("file", FILES, ids=lambda f: str(f.relative_to(ROOT)))
def test_imports(file):
    here = file.relative_to(ROOT)
    names = imported(file)
    ours = {n.split(".")[1] for n in names if n.startswith("thermospindle.")}
    assert not {n.split(".")[0] for n in names} & {*ORDER, "spindle"}, "installed, these names are not ours"
    if here.parts[0] in ORDER:
        assert not ours & {*ORDER[ORDER.index(here.parts[0]) + 1 :], "cli"}
    for library, allowed in ONLY_IN.items():
        assert library not in {n.split(".")[0] for n in names} or allowed(here), f"{library} is imported in {here}"


def test_no_circles():
    """No module imports itself by way of others; TopologicalSorter names the circle where one does."""
    needs = {name: {n for n in imported(file) if n in MODULES} for name, file in MODULES.items()}
    list(TopologicalSorter(needs).static_order())


def test_the_walk_sees_files():
    assert len(FILES) > 150
    assert "numpy" in imported(ROOT / "model" / "bearing" / "hertz.py")


def test_verbs_open_without_what_only_draws() -> None:
    """Each of these takes half a second and more to load, and is needed where a folder is written. One process opens one verb
    after the other: what none has loaded at the end, none loads. The first, of states of equilibrium, reads no campaign."""
    verbs = ["states", "chain", "compare", "diagnose", "ladder", "running", "starting", "workbench"]
    watched = {"matplotlib", "rerun", "scipy.stats", "scipy.signal", "pyuff"}
    program = f"import sys\nfor verb in {verbs}:\n    __import__('thermospindle.report.verbs.' + verb)\n    print(verb, *sorted({watched} & {{*sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, check=True)
    loaded = {verb: set(libraries) for verb, *libraries in map(str.split, done.stdout.splitlines())}
    assert list(loaded) == verbs
    assert loaded.pop("states") == set()
    assert {verb: libraries - {"pyuff"} for verb, libraries in loaded.items()} == {verb: set() for verb in loaded}


def test_the_catalogue_is_told_without_the_libraries_that_compute():
    """Half a second is what a verb may take that simulates nothing: these alone take longer."""
    program = "import sys; from thermospindle.cli import main; main(['effects', '--json']); print(*sorted(sys.modules), file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, check=True)
    loaded = set(done.stderr.split())
    assert "thermospindle.sim.effects" in loaded
    assert not loaded & {"scipy.optimize", "scipy.sparse", "scipy.interpolate", "skfem", "mujoco", "matplotlib", "rerun", "pydantic"}


SIMULATES = {"scipy.optimize", "scipy.interpolate", "scipy.ndimage", "scipy.signal", "scipy.stats", "skfem", "mujoco", "matplotlib"}


def loaded_by(*arguments: str) -> set[str]:
    """The modules that a verb has loaded when it is done, in a process of its own."""
    program = "import sys; from thermospindle.cli import main; print(main(sys.argv[1:]), *sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True, cwd=ROOT, check=True)
    code, *loaded = done.stderr.splitlines()[-1].split()
    assert code == "0"
    return set(loaded)


@pytest.mark.parametrize(
    "arguments",
    [
        ["effects", "--scene", "hdd_2003"],
        ["add", "hdd_2003", "bond_softening", "--out", "NEW"],
        ["import", "tests/data/amh_isma/at_rest.csv", "--mapping", "NEW"],
    ],
    ids=["effects", "add", "import"],
)
def test_a_verb_that_computes_no_model_loads_nothing_that_does(arguments, tmp_path):
    loaded = loaded_by(*(str(tmp_path / "new") if a == "NEW" else a for a in arguments))
    assert not loaded & (SIMULATES | {"rerun", "thermospindle.sim.operating"})
