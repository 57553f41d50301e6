"""Scenes that `spindle check` is asked about, and what it answers."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import ROOT
from thermospindle.cli import main

SCENES = {name: ROOT / "scenes" / name / "spindle.toml" for name in ("hdd_2003", "mk7702", "five_bearing", "free_shaft")}
SCENES |= {kind: ROOT / "scenes" / "templates" / f"{kind}.toml" for kind in ("hdd", "machine-tool", "grinding", "rotor")}


def checked(scene: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    assert main(["check", str(scene), "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def without(text: str, *tables: str) -> str:
    """A scene's text without some tables and what is in them."""
    for table in tables:
        text = re.sub(rf"^\[+{table}(\.[^\]]*)?\]+.*?(?=^\[+(?!{table})|\Z)", "", text, flags=re.DOTALL | re.MULTILINE)
    return text
