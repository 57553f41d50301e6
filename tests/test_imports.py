"""Imports run one way only, and each heavy library is imported where the design says."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ORDER = ("model", "thermal", "sim", "diagnosis")
FILES = [f for package in ORDER for f in sorted((ROOT / package).glob("**/*.py"))] + [ROOT / "spindle.py"]
ONLY_IN = {
    "skfem": lambda f: f.parts[0] == "thermal",
    "mujoco": lambda f: f == Path("model/mjcf.py") or f.parts[0] == "sim",
    "rerun": lambda f: f.parts[0] == "sim" and f.name.startswith("log"),
    "pyuff": lambda f: f == Path("sim/uff.py"),
}


def imported(file: Path) -> set[str]:
    tree = ast.parse(file.read_text(encoding="utf-8"))
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            names.add((node.module or "").split(".")[0])
    return names


@pytest.mark.parametrize("file", FILES, ids=lambda f: str(f.relative_to(ROOT)))
def test_imports(file):
    here = file.relative_to(ROOT)
    names = imported(file)
    if here.parts[0] in ORDER:
        later = ORDER[ORDER.index(here.parts[0]) + 1 :]
        assert not names & {*later, "spindle"}
    if here.parts[0] == "thermal":
        assert "sim" not in names
    for library, allowed in ONLY_IN.items():
        assert library not in names or allowed(here), f"{library} is imported in {here}"


def test_the_walk_sees_files():
    assert len(FILES) > 20
    assert "numpy" in imported(ROOT / "model" / "hertz.py")
