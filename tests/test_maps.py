"""Each package's docstring is its map: it names every module of the package, and no module that is not there."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize("package", ["model", "thermal", "sim", "diagnosis"])
def test_docstring_names_every_module(package):
    told = ast.get_docstring(ast.parse((ROOT / package / "__init__.py").read_text(encoding="utf-8")))
    assert told is not None
    _, table, _ = re.split(r"^=+ +=+$", told, flags=re.M)
    modules = {f.stem for f in (ROOT / package).glob("*.py")} - {"__init__"}
    assert not modules - set(re.findall(r"\w+", table))
    first = {line.split()[0] for line in table.strip().splitlines() if not line.startswith(" ")}
    assert not first - modules
