"""Each package's docstring is its map: it names every module and sub-package, and nothing that is not there."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = sorted(f.parent for p in ("model", "thermal", "sim", "diagnosis", "report") for f in (ROOT / p).rglob("__init__.py"))


@pytest.mark.parametrize("package", PACKAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_docstring_names_every_module(package):
    told = ast.get_docstring(ast.parse((package / "__init__.py").read_text(encoding="utf-8")))
    assert told is not None
    _, table, _ = re.split(r"^=+ +=+$", told, flags=re.M)
    there = {f.stem for f in package.glob("*.py")} - {"__init__"} | {f"{f.parent.name}/" for f in package.glob("*/__init__.py")}
    named = {line.split()[0] for line in table.strip().splitlines() if not line.startswith(" ")}
    assert named == there


@pytest.mark.parametrize("package", PACKAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_no_room_is_crowded(package):
    assert len(list(package.glob("*.py"))) - 1 <= 13


def test_the_walk_sees_packages():
    assert len(PACKAGES) > 20


def test_the_wheel_has_every_package():
    told = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["packages"]
    there = {".".join(("thermospindle", *p.relative_to(ROOT).parts)) for p in PACKAGES}
    assert set(told) == there | {"thermospindle", "thermospindle.scenes"}
