"""Small scenes that differ from the reference in one thing each, made by editing its text, for tests of the whole chain."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from tests.conftest import SCENE


def replaced(text: str, pattern: str, by: str, count: int = 1) -> str:
    """`re.sub` that insists on finding what it replaces, so often."""
    text, found = re.subn(pattern, by, text, flags=re.M)
    assert found == count, f"{pattern}: found {found} times, not {count}"
    return text


def quick(text: str) -> str:
    """One short hit on every hammer point."""
    text = replaced(text, r"^record_length_s = .*", "record_length_s = 0.10")
    text = replaced(text, r"^exponential_end = .*", "exponential_end = 0.05")
    text = replaced(text, r"^hits = .*", "hits = 1")
    return re.sub(r"^stiffness_arrangement = .*\n|^origins = \{ stiffness_arrangement.*\n", "", text, flags=re.M)


def symmetric(text: str) -> str:
    """Every stiffness and inertia alike in x and y."""
    return replaced(text, r"^(tilt_(?:inertia|stiffness)\w*|lateral_stiffness\w*) = \[(.*?),.*?\]", r"\1 = [\2, \2]", count=4)


def inner_turns(text: str) -> str:
    """The shaft turns in a hub that stands on the seat: the parts, the turning body and the joint to the seat change places."""
    other = {"stationary": "rotating", "rotating": "stationary"}
    text = re.sub(r'^part = "(\w+)"', lambda part: f'part = "{other[part[1]]}"', text, flags=re.M)
    text = replaced(text, r'^turning_ring = "outer"', 'turning_ring = "inner"')
    text = replaced(text, r"^turns = true\n", "")
    text = replaced(text, r'^(regions = \["shaft", "lower inner ring", "upper inner ring"\]\nmoves = .*\n)', r"\1turns = true\n")
    return replaced(text, r'^between = \["seat", "shaft"\]', 'between = ["seat", "hub"]')


def sprung(text: str) -> str:
    return replaced(text, r'^preload_kind = "rigid"', 'preload_kind = "spring"')


def face_to_face(text: str) -> str:
    return replaced(text, r'^arrangement = "back-to-back"', 'arrangement = "face-to-face"')


def tandem(text: str) -> str:
    """Both rows lean the same way, which only an outside force, the spring, can preload."""
    return replaced(sprung(text), r'^arrangement = "back-to-back"', 'arrangement = "tandem"')


SCENES: dict[str, Callable[[str], str]] = {
    "reference": lambda text: text,
    "symmetric": symmetric,
    "inner ring turning": inner_turns,
    "spring preload": sprung,
    "face to face": face_to_face,
    "tandem": tandem,
}


def write_scene(name: str, folder: Path) -> Path:
    """One of `SCENES` as a scene folder in `folder`."""
    scene = folder / name.replace(" ", "_")
    scene.mkdir()
    text = (SCENE / "spindle.toml").read_text(encoding="utf-8")
    (scene / "spindle.toml").write_text(SCENES[name](quick(text)), encoding="utf-8")
    return scene
