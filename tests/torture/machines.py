"""Random machines: the shipped scenes and templates with their numbers moved, and rotors made from nothing; and conditions."""

from __future__ import annotations

import copy
import tomllib
from dataclasses import dataclass
from functools import cache

import numpy as np
from hypothesis import strategies as st

from tests.conftest import ROOT
from thermospindle.model.machine import RingMotion
from thermospindle.model.scene.reading import shipped_rows

FILES = {
    **{name: ROOT / "scenes" / name / "spindle.toml" for name in ("hdd_2003", "mk7702", "five_bearing", "tailstock", "free_shaft")},
    **{name: ROOT / "scenes" / "templates" / f"{name}.toml" for name in ("hdd", "machine-tool", "grinding", "rotor")},
}
WHOLE = ("node", "balls", "hits", "cpus", "seed")  # keys with whole numbers, left alone


@cache
def parsed(name: str) -> dict:
    """A scene with the shipped rows that its bearings name, whose numbers move too."""
    raw = tomllib.loads(FILES[name].read_text(encoding="utf-8"))
    named = {b.get("row") for b in raw.get("bearings", {}).values()}
    for kind, rows in shipped_rows().items():
        own = raw.get(kind, {})
        more = {row: copy.deepcopy(dict(table)) for row, table in rows.items() if row in named and not any(row in raw.get(k, {}) for k in shipped_rows())}
        if more:
            raw[kind] = own | more
    return raw


def numbers(node, path=()):
    """Paths of all decimal numbers of a scene."""
    if isinstance(node, dict):
        for key, value in node.items():
            if key not in WHOLE:
                yield from numbers(value, (*path, key))
    elif isinstance(node, list):
        for k, value in enumerate(node):
            yield from numbers(value, (*path, k))
    elif isinstance(node, float):
        yield path


@cache
def places(name: str) -> tuple:
    return tuple(numbers(parsed(name)))


def put(raw: dict, path: tuple, value: object) -> None:
    for part in path[:-1]:
        raw = raw[part]
    raw[path[-1]] = value


def at(raw: dict, path: tuple) -> float:
    for part in path:
        raw = raw[part]
    return raw


@dataclass(frozen=True)
class Moved:
    """A shipped scene with some of its numbers times a factor."""

    name: str
    factors: tuple

    def __repr__(self) -> str:
        told = ", ".join(f"{'.'.join(map(str, path))} * {factor!r}" for path, factor in self.factors)
        return f"Moved({self.name}: {told})"

    def raw(self) -> dict:
        raw = copy.deepcopy(parsed(self.name))
        for path, factor in self.factors:
            put(raw, path, at(raw, path) * factor)
        return raw


@st.composite
def moved(draw, names=tuple(FILES)):
    """Up to a dozen numbers, most of them by little, seldom one by much."""
    name = draw(st.sampled_from(names))
    little = st.one_of(st.floats(0.97, 1.03), st.floats(0.7, 1.4))
    much = st.sampled_from([0.0, 0.1, 10.0, -1.0, 1e6, 1e-6])
    paths = draw(st.lists(st.sampled_from(places(name)), max_size=12, unique=True))
    factors = [draw(much if draw(st.integers(0, 30)) == 0 else little) for _ in paths]
    return Moved(name, tuple(zip(paths, factors, strict=True)))


def _f(low: float, high: float):
    return st.floats(low, high, allow_nan=False).map(lambda x: float(f"{x:.4g}") if abs(x) > 1e-12 else 0.0)


@st.composite
def rotors(draw):
    """A flexible stepped shaft on two to four bearings given by numbers."""
    parts = draw(st.integers(1, 6))
    outer = [[draw(_f(8, 80)), draw(_f(10, 120))] for _ in range(parts)]
    length = sum(p[-1] for p in outer)
    bearings = {}
    for k in range(draw(st.integers(2, 4))):
        bearings[f"b{k}"] = {
            "origin": "assumed",
            "z_mm": float(f"{draw(_f(0, 1)) * length:.3g}"),
            "numbers": {
                "radial_stiffness_N_per_um": draw(_f(1, 800)),
                "axial_stiffness_N_per_um": draw(_f(0.5, 300)),
                "tilt_stiffness_N_m_per_rad": draw(_f(0, 1e5)),
                "damping_ratio": draw(_f(0, 0.2)),
            },
        }
    return rotor(outer, bearings, draw(_f(0, 0.05)), draw(_f(10, 30)), draw(_f(10, 60000)))


def stub() -> dict:
    """A shaft so short that no mode lies in the band."""
    numbers = {"radial_stiffness_N_per_um": 500.0, "axial_stiffness_N_per_um": 150.0, "damping_ratio": 0.1}
    return rotor([[45.0, 50.0]], {f"b{z}": {"origin": "assumed", "z_mm": float(z), "numbers": numbers} for z in (0, 50)})


def rotor(outer: list, bearings: dict, damping: float = 0.0, reference: float = 20.0, rpm: float = 7000.0) -> dict:
    """The parsed scene of a shaft alone."""
    return {
        "title": "a rotor",
        "reference_temperature_C": reference,
        "nominal_speed_rpm": rpm,
        "temperature_range_C": [20.0, 60.0],
        "materials": {"steel": copy.deepcopy(parsed("rotor")["materials"]["steel"])},
        "bearings": bearings,
        "structure": {"origin": "assumed", "inner_body": "shaft", "outer_body": "ground", "damping_frequency_Hz": 200.0},
        "shafts": [{"name": "shaft", "origin": "assumed", "material": "steel", "start_z_mm": 0.0, "outer_mm": outer, "turns": True, "damping_ratio": damping}],
    }


conditions = st.tuples(
    st.one_of(_f(-40, 120), st.sampled_from([-200.0, 20.0, 60.0, 400.0, 3000.0])),
    st.one_of(st.just(0.0), _f(-30000, 60000), st.sampled_from([1e6, 1e8])),
)
"""Temperature (C) and speed (rpm)."""


@st.composite
def expansions(draw):
    """Ring motions as a temperature field could make them: some micrometres, those of each ring its own; a function of the spindle."""
    seed, size = draw(st.integers(0, 10**6)), draw(st.sampled_from([0.0, 1e-7, 1e-6, 5e-6, 1e-4]))

    def of(spindle):
        rng = np.random.default_rng(seed)
        return {b.name: RingMotion(*(size * rng.standard_normal(7)).tolist(), spindle.reference_temperature + 1e6 * size) for b in spindle.bearings}

    of.__qualname__ = of.__name__ = f"motions_{seed}_{size:g}"
    return of
