"""Reading a spindle from its scene file: units, checks, provenance.

The file's own form (units in the keys) is the pydantic models of `model.scene.form`; `load` turns it into SI definitions and
refuses what cannot be a spindle with one sentence that names file, key, value and what is allowed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError
from scipy.optimize import brentq

from thermospindle.model.bearing.hertz import in_series, race_contact
from thermospindle.model.bearing.pair import reference_motion, solve
from thermospindle.model.drawn import GRADES, drawn
from thermospindle.model.errors import BadInput, NoEquilibrium
from thermospindle.model.machine import Bearing, Condition, Provenance, Region, Spindle
from thermospindle.model.rotor.chain import matrices, rotor_base
from thermospindle.model.rotor.modes import poles
from thermospindle.model.rotor.section import cells, mass_properties
from thermospindle.model.scene import form as scene_file
from thermospindle.model.scene.fields import read_toml
from thermospindle.model.tolerance import toleranced

SCENES = Path(__file__).parents[2] / "scenes"
"""The shipped scenes: beside the packages, in a checkout as installed."""


def load(path: str | Path) -> Spindle:
    """The spindle of a scene, given its folder, its `spindle.toml`, or the name of a shipped one.

    Raises `BadInput` for a missing or unreadable file, unknown or missing keys, wrong types, values out of range, and geometry
    that cannot be built.
    """
    file = scene_path(path)
    return build(read_toml(file), file)


def scene_path(path: str | Path) -> Path:
    """The scene file behind a folder or file name, or behind the bare name of a shipped scene where nothing of that name is here."""
    path = Path(path)
    if not path.exists() and path.parts == (path.name,) and path.name in shipped():
        path = SCENES / path
    file = path / "spindle.toml" if path.is_dir() else path
    if not file.is_file():
        names = ", ".join(shipped())
        raise BadInput(f"{path}: no scene there; expected a folder with spindle.toml, that file, or the name of a shipped scene ({names})")
    return file


def shipped() -> tuple[str, ...]:
    """Names of the scenes that come with the program."""
    return tuple(sorted(file.parent.name for file in SCENES.glob("*/spindle.toml")))


def build(raw: dict[str, Any], file: Path) -> Spindle:
    """The spindle of the parsed TOML `raw`; `file` serves messages only."""
    try:
        form = scene_file.Scene.model_validate(raw)
    except ValidationError as error:
        raise BadInput(scene_file.first_error(file, raw, scene_file.Scene, error)) from None
    spindle = form.spindle(name=file.parent.name, file=file, provenance=_provenance(file, raw))
    _check_section(file, spindle)
    spindle = _with_loaded_angles(form, spindle)
    _check_bearings(file, spindle)
    _check_raceways(file, spindle)
    _check_structure(file, spindle)
    spindle = _as_built(file, _with_section_inertia(spindle))
    if form.hammer_test.step_us is None:
        spindle = replace(spindle, hammer=replace(spindle.hammer, step=chosen_step(spindle)))
    own = form.imperfections
    if own.seed is not None and own.grade is not None:
        spindle = replace(spindle, imperfections=drawn(spindle, own.seed, GRADES[own.grade]))
    return spindle


SAFE = 1.35
"""|pole| step of the stiffest mode at the reference: half of what Runge-Kutta 4 bears, for bearings stiffer than at the reference."""


def chosen_step(spindle: Spindle) -> float:
    """The longest integration step (s) that divides the sampling interval and follows the stiffest mode at the reference state."""
    still = {b.name: reference_motion(spindle.reference_temperature) for b in spindle.bearings}
    chain = rotor_base(spindle, solve(spindle, Condition(spindle.reference_temperature), still))
    stiffest = float(np.abs(poles(matrices(chain)).value).max())
    interval = 1 / spindle.hammer.sample_rate
    return interval / int(np.ceil(interval * stiffest / SAFE))


def content_hash(spindle: Spindle) -> str:
    """Twelve hex digits that change when any number of the spindle changes (name, file and provenance apart)."""
    content = asdict(spindle)
    for key in ("name", "title", "file", "provenance"):
        content.pop(key)
    for addition in content["effects"]:
        addition.pop("definition")
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()[:12]


def _provenance(file: Path, raw: Mapping[str, Any]) -> dict[str, Provenance]:
    """Origin and source of every number of the file; a number without one is refused."""
    found: dict[str, Provenance] = {}

    def walk(node: Any, key: str, origin: str | None, source: str) -> None:
        if isinstance(node, Mapping):
            own, text = node.get("origin", origin), node.get("source", source)
            exceptions = node.get("origins", {})
            for name in exceptions:
                if name not in node:
                    raise BadInput(f"{file}: {key}.origins.{name}: names no key of this table")
            for name, value in node.items():
                if name not in ("origin", "source", "origins"):
                    inherited = exceptions.get(name, own if key else None)
                    walk(value, f"{key}.{name}" if key else name, inherited, text if key else "")
        elif isinstance(node, list) and node and isinstance(node[0], Mapping):
            for index, value in enumerate(node):
                walk(value, f"{key}.{value.get('name', value.get('node', index))}", origin, source)
        elif _is_number(node) or (isinstance(node, list) and node and all(map(_is_number, node))):
            if key in ("reference_temperature_C", "nominal_speed_rpm", "temperature_range_C") or key.endswith(".node"):
                return
            if origin is None:
                raise BadInput(f"{file}: {key} = {node!r}: says no origin; its table needs origin = printed, assumed or calibrated")
            found[key] = Provenance(origin, source)

    walk(raw, "", None, "")
    return found


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


# ---------------------------------------------------------------- geometry


def _mm(pair: tuple[float, float]) -> list[float]:
    return [round(v * 1e3, 6) for v in pair]


def _overlap(a: Region, b: Region) -> bool:
    return all(min(p[1], q[1]) - max(p[0], q[0]) > 1e-12 for p, q in ((a.r, b.r), (a.z, b.z)))


def _touch(a: Region, b: Region) -> bool:
    """Whether two regions overlap or share an edge of positive length."""
    spans = sorted(min(p[1], q[1]) - max(p[0], q[0]) for p, q in ((a.r, b.r), (a.z, b.z)))
    return spans[0] >= -1e-12 and spans[1] > 1e-12


def _check_section(file: Path, spindle: Spindle) -> None:
    names = [g.name for g in spindle.regions]
    for name in names:
        if names.count(name) > 1:
            raise BadInput(f"{file}: section.regions: the name {name!r} stands twice; region names must differ")
    for region in spindle.regions:
        if region.material not in spindle.materials:
            allowed = ", ".join(spindle.materials)
            raise BadInput(f"{file}: section.regions.{region.name}.material = {region.material!r}: allowed are {allowed}")
    for a, b in combinations(spindle.regions, 2):
        where = f"{file}: section.regions.{b.name}: r_mm = {_mm(b.r)}, z_mm = {_mm(b.z)}"
        if _overlap(a, b) and a.part != b.part:
            raise BadInput(f"{where} overlaps {a.name!r} of the other part; parts may not share space")
        if _overlap(a, b) and a.material != b.material:
            raise BadInput(f"{where} overlaps {a.name!r} of another material; only regions of one material may overlap")
    for part in ("stationary", "rotating"):
        regions = [g for g in spindle.regions if g.part == part]
        if not regions:
            raise BadInput(f"{file}: section.regions: the {part} part has no region; each part needs at least one")
        reached, waiting = {regions[0].name}, [regions[0]]
        while waiting:
            here = waiting.pop()
            for other in regions:
                if other.name not in reached and _touch(here, other):
                    reached.add(other.name)
                    waiting.append(other)
        for region in regions:
            if region.name not in reached:
                where = f"r_mm = {_mm(region.r)}, z_mm = {_mm(region.z)}"
                raise BadInput(f"{file}: section.regions.{region.name}: {where} floats; it must touch its {part} part along an edge")

    heated = [("convection", c.regions) for c in spindle.thermal.convections]
    heated += [("sources", s.regions) for s in spindle.thermal.sources] + [("gaps", g.regions) for g in spindle.thermal.gaps]
    for key, used in heated:
        for name in used:
            if name not in names:
                raise BadInput(f"{file}: thermal.{key}: {name!r} names no section region; allowed are {', '.join(names)}")


def _check_bearings(file: Path, spindle: Spindle) -> None:
    for b in spindle.bearings:
        where = f"{file}: bearings.{b.name}"
        for key, name in (("inner_ring", b.inner_ring), ("outer_ring", b.outer_ring)):
            if name not in {g.name for g in spindle.regions}:
                raise BadInput(f"{where}.{key} = {name!r}: names no section region")
            ring = spindle.region(name)
            if not ring.z[0] <= b.z <= ring.z[1]:
                raise BadInput(f"{where}.z_mm = {b.z * 1e3:g}: outside its ring {name!r}, which spans z_mm = {_mm(ring.z)}")
        for key, name in (("ball_material", b.ball_material), ("ring_material", b.ring_material)):
            if name not in spindle.materials:
                raise BadInput(f"{where}: {key} = {name!r}: allowed are {', '.join(spindle.materials)}")
        inner, outer = spindle.region(b.inner_ring), spindle.region(b.outer_ring)
        if inner.part == outer.part:
            raise BadInput(f"{where}: both rings are on the {inner.part} part; one ring must turn")
        if (outer.part == "rotating") != (spindle.pair.turning_ring == "outer"):
            raise BadInput(
                f"{file}: bearing_pair.turning_ring = {spindle.pair.turning_ring!r}: but {b.outer_ring!r} is on the {outer.part} part"
            )
        if not inner.r[1] < b.pitch_diameter / 2 < outer.r[0]:
            raise BadInput(
                f"{where}: pitch_diameter_mm = {b.pitch_diameter * 1e3:g}: the ball centres must lie between the raceways at "
                f"r_mm = {inner.r[1] * 1e3:g} and {outer.r[0] * 1e3:g}"
            )
        gap = outer.r[0] - inner.r[1] - b.ball_diameter
        if not -0.02 * b.ball_diameter < gap < 0.05 * b.ball_diameter:
            raise BadInput(
                f"{where}: the raceways leave {(gap + b.ball_diameter) * 1e3:g} mm for balls of ball_diameter_mm = "
                f"{b.ball_diameter * 1e3:g}; allowed is -2 % to +5 % of the ball in play"
            )
        if b.clearance is None:
            continue
        low, high = b.clearance
        implied = implied_clearance(spindle, b)
        if not low - 1e-9 <= implied <= high + 1e-9:
            raise BadInput(
                f"{where}: contact_angle_deg = {np.degrees(b.contact_angle):g} under {spindle.pair.preload:g} N means a diametral "
                f"clearance of {implied * 1e3:.4f} mm, which contradicts diametral_clearance_mm = [{low * 1e3:g}, {high * 1e3:g}]"
            )


def _check_raceways(file: Path, spindle: Spindle) -> None:
    """Raceways of bearings that share a region as a ring lie apart on it."""
    for a, b in combinations(spindle.bearings, 2):
        for ring in {a.inner_ring, a.outer_ring} & {b.inner_ring, b.outer_ring}:
            lower, upper = sorted((spindle.raceway(ring, a), spindle.raceway(ring, b)))
            if lower[1] > upper[0]:
                raise BadInput(
                    f"{file}: bearings.{b.name}.raceway_width_mm: the raceways of {a.name!r} and {b.name!r} on {ring!r}, z_mm = {_mm(lower)} "
                    f"and {_mm(upper)}, overlap; allowed are widths that leave them apart"
                )


def _with_loaded_angles(form: scene_file.Scene, spindle: Spindle) -> Spindle:
    """The spindle with the loaded contact angle of the bearings that were told by their free one."""
    free = {n: form.ball_rows[b.row].free_contact_angle_deg for n, b in form.bearings.items()}
    return replace(
        spindle,
        bearings=tuple(
            b if (angle := free[b.name]) is None or b.ball_material not in spindle.materials or b.ring_material not in spindle.materials
            else replace(b, contact_angle=loaded_angle(spindle, b, float(np.radians(angle))))
            for b in spindle.bearings
        ),
    )  # fmt: skip


def loaded_angle(spindle: Spindle, b: Bearing, free: float) -> float:
    """Contact angle (rad) under the preload of a bearing whose angle without load is `free`: Harris 1991, Eq. 6.33.

    A cos(free) = (A + deformation) cos(loaded), and balls K deformation^1.5 sin(loaded) = preload.
    """

    def excess(angle: float) -> float:
        deformation = max(np.cos(free) / np.cos(angle) - 1, 0.0) * b.unloaded_distance
        return float(
            b.balls * _constant(spindle, replace(b, contact_angle=angle)) * deformation**1.5 * np.sin(angle) - spindle.pair.preload
        )

    return float(brentq(excess, free, 0.99 * np.pi / 2, xtol=1e-14))


def implied_clearance(spindle: Spindle, b: Bearing) -> float:
    """Diametral clearance (m) that makes the free contact angle close to `b.contact_angle` under the preload.

    The radial distance of the groove curvature centres is the same free and loaded: A cos(free) = (A + deformation) cos(loaded),
    and the clearance is 2 A (1 - cos(free)) (Harris 1991, Eq. 2.9).
    """
    force = spindle.pair.preload / (b.balls * np.sin(b.contact_angle))
    loaded = b.unloaded_distance + (force / _constant(spindle, b)) ** (2 / 3)
    return float(2 * (b.unloaded_distance - loaded * np.cos(b.contact_angle)))


def _constant(spindle: Spindle, b: Bearing) -> float:
    """Hertz constant (N/m^1.5) of both contacts in series at the reference temperature."""
    ball, ring = (
        (spindle.materials[m].youngs_modulus(spindle.reference_temperature), spindle.materials[m].poisson_ratio)
        for m in (b.ball_material, b.ring_material)
    )
    return in_series(
        *(
            race_contact(b.ball_diameter, f, b.pitch_diameter, b.contact_angle, inner, ball, ring).stiffness
            for f, inner in ((b.inner_conformity, True), (b.outer_conformity, False))
        )
    )


# ---------------------------------------------------------------- structure


def _check_structure(file: Path, spindle: Spindle) -> None:
    structure = spindle.structure
    names = [b.name for b in structure.bodies]
    for key, name in (("inner_body", structure.inner_body), ("outer_body", structure.outer_body)):
        if name not in names:
            raise BadInput(f"{file}: structure.{key} = {name!r}: allowed are {', '.join(names)}")
    for body in structure.bodies:
        if len(set(names)) < len(names) or body.name == "ground":
            raise BadInput(f"{file}: structure.bodies: the name {body.name!r} is taken; body names must differ, and 'ground' is the world")
        for name in body.regions:
            if name not in {g.name for g in spindle.regions}:
                raise BadInput(f"{file}: structure.bodies.{body.name}.regions: {name!r} names no section region")
    turning = structure.outer_body if spindle.pair.turning_ring == "outer" else structure.inner_body
    if [b.name for b in structure.bodies if b.turns] != [turning]:
        raise BadInput(f"{file}: structure.bodies: exactly the body {turning!r} that carries the turning rings must have turns = true")
    for joint in structure.joints:
        if joint.material and joint.material not in spindle.materials:
            allowed = ", ".join(spindle.materials)
            raise BadInput(f"{file}: structure.joints.{joint.name}.material = {joint.material!r}: allowed are {allowed}")
        for name in joint.bodies:
            if name not in (*names, "ground"):
                raise BadInput(
                    f"{file}: structure.joints.{joint.name}.between: {name!r} is no body; allowed are ground, {', '.join(names)}"
                )
    nodes = [p.node for p in spindle.points]
    for point in spindle.points:
        if nodes.count(point.node) > 1:
            raise BadInput(f"{file}: measuring.points: node = {point.node} stands twice; nodes must differ")
        if point.body not in names:
            raise BadInput(f"{file}: measuring.points.{point.node}.body = {point.body!r}: allowed are {', '.join(names)}")
    for node in spindle.hammer.hammer_nodes:
        if node not in nodes:
            raise BadInput(f"{file}: hammer_test.hammer_nodes: {node} is no measuring point; allowed are {nodes}")


def _with_section_inertia(spindle: Spindle) -> Spindle:
    """The spindle with mass, centre and inertia of bodies made of section regions filled in."""
    tiles = [c for part in ("stationary", "rotating") for c in cells([g for g in spindle.regions if g.part == part])]
    bodies = []
    for body in spindle.structure.bodies:
        if body.regions:
            own = [c for c in tiles if c.region in body.regions]
            m = mass_properties(own, spindle.regions, dict(spindle.materials))
            body = replace(body, mass=m.mass, inertia=(m.transverse, m.transverse, m.polar), z=m.z)
        bodies.append(body)
    structure = replace(spindle.structure, bodies=tuple(bodies))
    return replace(spindle, structure=structure)


def _as_built(file: Path, spindle: Spindle) -> Spindle:
    """The spindle with the deviations of its `build` table in its numbers."""
    if spindle.build is None:
        return spindle
    parameters = {p.name: p for p in toleranced(spindle)}
    for name in spindle.build.deviations:
        if name not in parameters:
            raise BadInput(f"{file}: build.deviations.{name}: is no toleranced parameter; allowed are {', '.join(parameters)}")
    built = spindle
    for name, parameter in parameters.items():
        deviation = spindle.build.deviations.get(name, 0.0)
        if deviation != 0.0:
            try:
                built = parameter.apply(built, deviation)
            except (ValueError, NoEquilibrium) as error:
                raise BadInput(f"{file}: build.deviations.{name} = {deviation:g}: gives no spindle: {error}") from None
    return built
