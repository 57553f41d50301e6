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
    """A shipped scene with some of its numbers times a factor, and other keys put in."""

    name: str
    factors: tuple
    keys: tuple = ()

    def __repr__(self) -> str:
        told = [f"{'.'.join(map(str, path))} * {factor!r}" for path, factor in self.factors]
        told += [f"{'.'.join(path)} = {value!r}" for path, value in self.keys]
        return f"Moved({self.name}: {', '.join(told)})"

    def raw(self) -> dict:
        raw = copy.deepcopy(parsed(self.name))
        for path, factor in self.factors:
            put(raw, path, at(raw, path) * factor)
        for path, value in self.keys:
            put(raw, path, copy.deepcopy(value))
        return raw


@st.composite
def moved(draw, names=tuple(FILES), most=12, of=places):
    """Up to a dozen numbers, most of them by little, seldom one by much; every other machine loaded, or with sensors of its own."""
    name = draw(st.sampled_from(names))
    little = st.one_of(st.floats(0.97, 1.03), st.floats(0.7, 1.4))
    much = st.sampled_from([0.0, 0.1, 10.0, -1.0, 1e6, 1e-6])
    paths = draw(st.lists(st.sampled_from(of(name)), max_size=most, unique=True))
    factors = [draw(much if draw(st.integers(0, 30)) == 0 else little) for _ in paths]
    keys = draw(st.one_of(st.just(()), loads(name), sensors(name), st.tuples(loads(name), sensors(name)).map(lambda both: both[0] + both[1])))
    return Moved(name, tuple(zip(paths, factors, strict=True)), keys)


def heights(name: str) -> tuple[float, float]:
    """mm, of the lowest and the highest measuring point."""
    found = [point["position_mm"][2] for point in parsed(name)["measuring"]["points"]]
    return min(found), max(found)


@st.composite
def loads(draw, name):
    """Forces from outside, from a touch to what no bearing bears."""
    size = draw(st.sampled_from([0.1, 3.0, 30.0, 300.0, 1e4]))
    force = _f(-size, size)
    single = (("axial_load_N",), draw(force)), (("radial_load_N",), [draw(force), draw(force)]), (("radial_load_z_mm",), draw(_f(*heights(name))))
    more = [{"force_N": [draw(force), draw(force)], "z_mm": draw(_f(*heights(name)))} for _ in range(draw(st.integers(0, 2)))]
    return *single, (("radial_loads",), more), (("gravity_m_per_s2",), [draw(st.sampled_from([0.0, -9.81, 20.0])) for _ in "xy"])


@st.composite
def sensors(draw, name):
    """One to eight measuring points where bodies are, in any direction, and one or two of them hit."""
    own, (low, high) = parsed(name)["measuring"]["points"], heights(name)
    nodes = draw(st.lists(st.integers(1, 999_999), min_size=1, max_size=8, unique=True))
    points = []
    for k, node in enumerate(nodes):
        place = draw(st.sampled_from(own))
        x, y, z = place["position_mm"]
        at = [x, y, draw(st.one_of(st.just(z), _f(low, high)))]
        direction = draw(st.sampled_from(["+X", "-X", "+Y", "-Y", "+Z", "-Z"]))
        letter = draw(st.sampled_from("a\u00e9\u2603[$%"))
        points.append({"node": node, "name": f"{letter}{k}", "body": place["body"], "position_mm": at, "direction": direction})
    hit = draw(st.lists(st.sampled_from(nodes), min_size=1, max_size=2, unique=True))
    return (("measuring", "points"), points), (("hammer_test", "hammer_nodes"), hit)


WITH_A_SECTION = tuple(name for name in FILES if parsed(name).get("section"))


def beside_the_section(name: str) -> tuple:
    """Numbers that leave the finite elements of its section as they are, which then are computed once."""
    return tuple(p for p in places(name) if p[0] not in ("section", "materials") and "z_mm" not in p and p[0] != "reference_temperature_C")


heated = st.one_of(moved(WITH_A_SECTION, 8, beside_the_section), moved(WITH_A_SECTION, 8, beside_the_section), moved(WITH_A_SECTION, 3))
"""Machines with a temperature field: two of three on their drawn section, one with any of its
numbers moved, whose finite elements take seconds."""


@st.composite
def fields(draw):
    """A temperature for every region (C), some kelvins about one that is drawn from where the
    scenes are made for; a function of the spindle."""
    seed, spread, middle = draw(st.integers(0, 10**6)), draw(st.sampled_from([0.0, 0.5, 5.0, 20.0])), draw(st.one_of(_f(15, 65), _f(-40, 120)))

    def of(spindle):
        rng = np.random.default_rng(seed)
        return {g.name: middle + spread * float(rng.standard_normal()) for g in spindle.regions}

    of.__qualname__ = of.__name__ = f"field_{seed}_{middle:g}_{spread:g}"
    return of


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
