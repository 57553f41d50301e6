"""What cannot be a spindle: sections, bearings and structures that do not fit together, refused with one sentence each."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np

from thermospindle.model.bearing.hertz import in_series
from thermospindle.model.bearing.row import contact_constants, reference_motion, ring_speeds
from thermospindle.model.drawing.section import Region
from thermospindle.model.errors import BadInput, instead
from thermospindle.model.machine import Bearing, RollerBearing, Spindle
from thermospindle.model.rotor.section import cells
from thermospindle.model.shaft import SAME_HEIGHT

# ---------------------------------------------------------------- geometry


def _mm(pair: tuple[float, float]) -> list[float]:
    return [round(v * 1e3, 6) for v in pair]


def _region_instead(spindle: Spindle, name: str) -> str:
    return instead(name, [g.name for g in spindle.regions])


def _overlap(a: Region, b: Region) -> bool:
    return all(min(p[1], q[1]) - max(p[0], q[0]) > 1e-12 for p, q in ((a.r, b.r), (a.z, b.z)))


def _touch(a: Region, b: Region) -> bool:
    """Whether two regions overlap or share an edge of positive length."""
    spans = sorted(min(p[1], q[1]) - max(p[0], q[0]) for p, q in ((a.r, b.r), (a.z, b.z)))
    return spans[0] >= -1e-12 and spans[1] > 1e-12


def check_section(file: Path, spindle: Spindle) -> None:
    if spindle.regions and not spindle.ringed:
        raise BadInput(
            f"{file}: section: no bearing is a ball row, or a roller row with its rings in the section, and only those feel its expansion; leave it out, "
            "or give a bearing its row"
        )
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
    for part in ("stationary", "rotating") if spindle.regions else ():
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
                raise BadInput(f"{file}: thermal.{key}: {name!r} names no section region; {instead(name, names)}")


def check_bearings(file: Path, spindle: Spindle) -> None:
    for b in spindle.bearings:
        where = f"{file}: bearings.{b.name}"
        _check_rings(file, spindle, b, "ball")
        if b.clearance is None:
            continue
        low, high = b.clearance
        implied = implied_clearance(spindle, b)
        if not low - 1e-9 <= implied <= high + 1e-9:
            raise BadInput(
                f"{where}: contact_angle_deg = {np.degrees(b.contact_angle):g} under {b.preload:g} N means a diametral "
                f"clearance of {implied * 1e3:.4f} mm, which contradicts diametral_clearance_mm = [{low * 1e3:g}, {high * 1e3:g}]"
            )


def check_rollers(file: Path, spindle: Spindle) -> None:
    """Materials are there, and rings in the section leave room for the rollers, one of them on each part."""
    for b in spindle.roller_bearings:
        _check_materials(file, spindle, b, "roller")
        if b.inner_ring:
            _check_rings(file, spindle, b, "roller")
            rows = b.z + b.offsets[0], b.z + b.offsets[-1]
            for name in (b.inner_ring, b.outer_ring):
                ring = spindle.region(name)
                if not ring.z[0] - 1e-9 <= rows[0] <= rows[1] <= ring.z[1] + 1e-9:
                    raise BadInput(
                        f"{file}: bearings.{b.name}: row_spacing_mm = {b.row_spacing * 1e3:g}: the middles of its {b.rows} rows at z_mm = {rows[0] * 1e3:g} to {rows[1] * 1e3:g} "
                        f"lie outside its ring {name!r}, which spans z_mm = {_mm(ring.z)}"
                    )


def _check_materials(file: Path, spindle: Spindle, b: Bearing | RollerBearing, element: str) -> None:
    for key, name in ((f"{element}_material", b.ball_material), ("ring_material", b.ring_material)):
        if name not in spindle.materials:
            raise BadInput(f"{file}: bearings.{b.name}: {key} = {name!r}: allowed are {', '.join(spindle.materials)}")


def _check_rings(file: Path, spindle: Spindle, b: Bearing | RollerBearing, element: str) -> None:
    """The rings of a bearing are regions about its height, each of the part that its body belongs
    to, with room for its balls or rollers between them."""
    where = f"{file}: bearings.{b.name}"
    for key, name in (("inner_ring", b.inner_ring), ("outer_ring", b.outer_ring)):
        if name not in {g.name for g in spindle.regions}:
            raise BadInput(f"{where}.{key} = {name!r}: names no section region; {_region_instead(spindle, name)}")
        ring = spindle.region(name)
        if not ring.z[0] <= b.z <= ring.z[1]:
            raise BadInput(f"{where}.z_mm = {b.z * 1e3:g}: outside its ring {name!r}, which spans z_mm = {_mm(ring.z)}")
    _check_materials(file, spindle, b, element)
    inner, outer = spindle.region(b.inner_ring), spindle.region(b.outer_ring)
    if inner.part == outer.part:
        raise BadInput(f"{where}: both rings are on the {inner.part} part; one ring must turn")
    turning = _turning_ring(spindle, b)
    if turning and (outer.part == "rotating") != (turning == "outer"):
        raise BadInput(
            f"{file}: bearing_pair.turning_ring = {turning!r}: but {b.outer_ring!r} is on the {outer.part} part"
            if _as_pair(spindle)
            else f"{where}.outer_ring = {b.outer_ring!r}: is on the {outer.part} part, but of its bodies {spindle.structure.carrier(b.outer_body)!r} "
            f"{'turns' if turning == 'outer' else 'does not turn'}"
        )
    if not inner.r[1] < b.pitch_diameter / 2 < outer.r[0]:
        raise BadInput(
            f"{where}: pitch_diameter_mm = {b.pitch_diameter * 1e3:g}: the {element} centres must lie between the raceways at "
            f"r_mm = {inner.r[1] * 1e3:g} and {outer.r[0] * 1e3:g}"
        )
    gap = outer.r[0] - inner.r[1] - b.ball_diameter
    if not -0.02 * b.ball_diameter < gap < 0.05 * b.ball_diameter:
        raise BadInput(
            f"{where}: the raceways leave {(gap + b.ball_diameter) * 1e3:g} mm for {element}s of {element}_diameter_mm = "
            f"{b.ball_diameter * 1e3:g}; allowed is -2 % to +5 % of the {element} in play"
        )


def _turning_ring(spindle: Spindle, b: Bearing | RollerBearing) -> str:
    """Which of its rings turns, or the one that turns alone; empty where its bodies do not tell."""
    if isinstance(b, Bearing):
        return b.turning_ring
    turning = [name in {body.name for body in spindle.structure.bodies if body.turns} for name in (b.inner_body, b.outer_body)]
    return "" if turning[0] == turning[1] else ("inner", "outer")[turning[1]]


def check_raceways(file: Path, spindle: Spindle) -> None:
    """Raceways are free faces of their rings, and those on one region lie apart."""
    for b in spindle.ringed:
        for key, name, side in (("inner_ring", b.inner_ring, 1), ("outer_ring", b.outer_ring, 0)):
            ring, heights = spindle.region(name), spindle.raceway(name, b)
            if (free := _free_height(spindle, ring, side, heights)) < heights[1] - heights[0] - SAME_HEIGHT:
                raise BadInput(
                    f"{file}: bearings.{b.name}.{key} = {name!r}: other regions cover all but {free * 1e3:g} mm of its raceway at r_mm = {ring.r[side] * 1e3:g}, "
                    f"z_mm = {_mm(heights)}; a raceway must be a free face of its ring, and where regions overlap the later one covers the earlier"
                )
    for a, b in combinations(spindle.ringed, 2):
        for ring_of_both in (name for name in (a.inner_ring, a.outer_ring) if name in (b.inner_ring, b.outer_ring)):
            lower, upper = sorted((spindle.raceway(ring_of_both, a), spindle.raceway(ring_of_both, b)))
            if lower[1] > upper[0] + SAME_HEIGHT:
                key, value = next(((f"{c.name}.raceway_width_mm", c.raceway_width) for c in (b, a) if c.raceway_width is not None), (f"{b.name}.z_mm", b.z))
                allowed = "are rows a ball apart" if key.endswith("z_mm") else "are widths that leave them apart"
                raise BadInput(
                    f"{file}: bearings.{key} = {value * 1e3:g}: the raceways of {a.name!r} and {b.name!r} on {ring_of_both!r}, z_mm = {_mm(lower)} and {_mm(upper)}, overlap; allowed {allowed}"
                )


def _free_height(spindle: Spindle, ring: Region, side: int, heights: tuple[float, float]) -> float:
    """Height (m) between `heights` over which the inner (0) or outer (1) face of a ring is neither another region's nor inside the part."""
    tiles = cells([g for g in spindle.regions if g.part == ring.part])
    behind = [t for t in tiles if t.r[1 - side] == ring.r[side]]
    free = 0.0
    for tile in tiles:
        if tile.region == ring.name and tile.r[side] == ring.r[side] and not any(t.z == tile.z for t in behind):
            free += max(0.0, min(tile.z[1], heights[1]) - max(tile.z[0], heights[0]))
    return free


def implied_clearance(spindle: Spindle, b: Bearing) -> float:
    """Diametral clearance (m) that makes the free contact angle close to `b.contact_angle` under the preload.

    The radial distance of the groove curvature centres is the same free and loaded: A cos(free) = (A + deformation) cos(loaded),
    and the clearance is 2 A (1 - cos(free)) (Harris 1991, Eq. 2.9).
    """
    force = b.preload / (b.balls * np.sin(b.contact_angle))
    loaded = b.unloaded_distance + (force / constant(spindle, b)) ** (2 / 3)
    return float(2 * (b.unloaded_distance - loaded * np.cos(b.contact_angle)))


def constant(spindle: Spindle, b: Bearing) -> float:
    """Hertz constant (N/m^1.5) of both contacts in series at the reference temperature."""
    return in_series(*contact_constants(spindle, b, reference_motion(spindle.reference_temperature), b.contact_angle))


# ---------------------------------------------------------------- structure


def check_structure(file: Path, spindle: Spindle) -> None:
    structure = spindle.structure
    names = [b.name for b in structure.bodies]
    mountings = [(f"structure.{key}", name) for key, name in (("inner_body", structure.inner_body), ("outer_body", structure.outer_body)) if name]
    shafts = [s.name for s in structure.shafts]
    for key, name in mountings:
        if name not in (*names, *shafts, "ground"):
            raise BadInput(f"{file}: {key} = {name!r}: allowed are {', '.join(spindle.structure.parts)}")
    _check_names(file, spindle)
    for body in structure.bodies:
        for name in body.regions:
            if name not in {g.name for g in spindle.regions}:
                raise BadInput(f"{file}: structure.bodies.{body.name}.regions: {name!r} names no section region; {_region_instead(spindle, name)}")
    if not structure.bodies:
        raise BadInput(f"{file}: structure.bodies: there is neither a body nor a shaft; a spindle has at least one")
    _check_mountings(file, spindle)
    for joint in structure.joints:
        if joint.material and joint.material not in spindle.materials:
            allowed = ", ".join(spindle.materials)
            raise BadInput(f"{file}: structure.joints.{joint.name}.material = {joint.material!r}: allowed are {allowed}")
        if len(set(joint.bodies)) < len(joint.bodies):
            raise BadInput(f"{file}: structure.joints.{joint.name}.between: {structure.carrier(joint.bodies[0])!r} stands twice; a joint lies between two bodies, or a body and ground")
        for name in joint.bodies:
            if name not in (*names, "ground"):
                raise BadInput(
                    f"{file}: structure.joints.{joint.name}.between: {name!r} is no body; allowed are ground, {', '.join(spindle.structure.parts)}"
                )
        turning = [name != "ground" and spindle.structure.body(name).turns for name in joint.bodies]
        for key, across in (("lateral_stiffness_N_per_m", joint.stiffness[:2]), ("tilt_stiffness_N_m_per_rad", joint.stiffness[3:])):
            if all(turning) and across[0] != across[1]:
                raise BadInput(
                    f"{file}: structure.joints.{joint.name}.{key} = {list(across)}: a joint of two turning parts that is stiffer one way than the other turns with them, and here stiffness "
                    "stands still; allowed are two values alike"
                )
    nodes = [p.node for p in spindle.points]
    for point in spindle.points:
        if nodes.count(point.node) > 1:
            raise BadInput(f"{file}: measuring.points: node = {point.node} stands twice; nodes must differ")
        if point.name and [p.name for p in spindle.points].count(point.name) > 1:
            raise BadInput(f"{file}: measuring.points: name = {point.name!r} stands twice; names must differ")
        if point.body not in names:
            raise BadInput(f"{file}: measuring.points.{point.node}.body = {point.body!r}: allowed are {', '.join(spindle.structure.parts)}")
    for node in spindle.hammer.hammer_nodes:
        if node not in nodes:
            raise BadInput(f"{file}: hammer_test.hammer_nodes: {node} is no measuring point; allowed are {nodes}")


def _check_names(file: Path, spindle: Spindle) -> None:
    """Bodies and shafts have names that differ, and so have joints and bearings, from each other
    and from what MuJoCo's model is made of beside them."""
    structure = spindle.structure
    taken = {"ground", "world", *(f"{b.name} carrier" for b in structure.bodies if b.turns), *(f"{b.name} sprung ring" for b in spindle.bearings)}
    for key, name in (*(("bodies", b.name) for b in structure.bodies), *(("shafts", s.name) for s in structure.shafts)):
        if name in taken:
            raise BadInput(f"{file}: structure.{key}: the name {name!r} is taken; names of bodies and shafts must differ, and 'ground' is the world")
        taken.add(name)
    every = [*(("structure.joints", j.name) for j in structure.joints), *(("bearings", b.name) for b in spindle.all_bearings)]
    taken = {"loss", *(f"{name}{part}" for _, name in every for part in (".damping", ".remainder"))}
    for key, name in every:
        if name in taken:
            raise BadInput(f"{file}: {key}: the name {name!r} is taken; names of joints and bearings must differ")
        taken.add(name)


def _as_pair(spindle: Spindle) -> bool:
    """Whether the scene tells its bearings as a `bearing_pair`."""
    return "bearing_pair.preload_N" in spindle.provenance


def _check_mountings(file: Path, spindle: Spindle) -> None:
    """Bodies that carry rings exist, and of the two of a ball row one turns against the other."""
    structure = spindle.structure
    names = {b.name for b in structure.bodies}
    allowed = ", ".join(("ground", *structure.parts))
    for b in spindle.all_bearings:
        for key, name in (("inner_body", b.inner_body), ("outer_body", b.outer_body)):
            if name != "ground" and name not in names:
                raise BadInput(f"{file}: bearings.{b.name}.{key} = {name!r}: allowed are {allowed}")
        if b.inner_body == b.outer_body:
            raise BadInput(f"{file}: bearings.{b.name}: both rings are on {structure.carrier(b.inner_body)!r}; a bearing lies between two bodies")
    turning = {b.name for b in structure.bodies if b.turns}
    if _as_pair(spindle):
        first = spindle.bearings[0]
        wanted = first.outer_body if first.turning_ring == "outer" else first.inner_body
        if not {b.name for b in structure.bodies if structure.carrier(b.name) == structure.carrier(wanted)} == turning:
            raise BadInput(f"{file}: structure.bodies: exactly the body {structure.carrier(wanted)!r} that carries the turning rings must have turns = true")
    for b in spindle.rolling:
        inner, outer = ring_speeds(spindle, b, 1.0)
        if inner == outer:
            raise BadInput(
                f"{file}: bearings.{b.name}: its rings, on {structure.carrier(b.inner_body)!r} and {structure.carrier(b.outer_body)!r}, turn alike; one of the two must have turns = true"
            )
