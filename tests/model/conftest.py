"""The reference scene as its file has it, for tests that change it."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from typing import Any

import pytest

from tests.conftest import SCENE

FILE = SCENE / "spindle.toml"


@pytest.fixture
def raw() -> dict[str, Any]:
    return tomllib.loads(FILE.read_text(encoding="utf-8"))


def named(entries: Iterable[dict[str, Any]], name: str) -> dict[str, Any]:
    return next(e for e in entries if e["name"] == name)
