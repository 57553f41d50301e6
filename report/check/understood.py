"""What the program understood of a scene, and what it assumed: one object of plain numbers and words, in the units people write."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from thermospindle.model.bearing.pair import BearingState
from thermospindle.model.bearing.roller import RollerState
from thermospindle.model.carrier import load_carrier, unbalance_carrier
from thermospindle.model.machine import Bearing, LinearBearing, RollerBearing, Spindle
from thermospindle.model.shaft import THEORIES, Shaft
from thermospindle.model.structure import Body
from thermospindle.model.units import in_rpm
from thermospindle.sim.effects.effect import Effect, refusal
from thermospindle.sim.hammer.excited import unseen
from thermospindle.sim.hammer.pulse import pulse_duration
from thermospindle.sim.operating import OperatingPoint
from thermospindle.sim.running.rows import cage_spread

ASSUMED = "assumed default: "
NUMBERS = {1: "one", 2: "two", 3: "three", 4: "four", 5: "five"}


def understood(drawn: Spindle, point: OperatingPoint, catalogue: Sequence[Effect]) -> dict[str, Any]:
    """The keys of `spindle check --json` but `odd` and `warnings` for a spindle as `drawn`; `point`
    is it at its reference temperature, at rest, whose bodies carry what sits on points."""
    spindle = point.spindle
    structure, own = spindle.structure, spindle.imperfections
    plain = structure.rigid_bodies
    refused = {e.name: why for e in catalogue if (why := refusal(e, spindle))}
    alone = spindle.radial_loads[0] if len(spindle.radial_loads) == 1 else None
    return {
        "scene": spindle.name,
        "title": spindle.title,
        "reference_temperature_C": spindle.reference_temperature,
        "temperature_range_C": list(spindle.temperatures),
        "nominal_speed_rpm": in_rpm(spindle.nominal_speed),
        "axial_load_N": spindle.axial_load,
        "radial_load_N": np.sum([load.force for load in spindle.radial_loads], axis=0).tolist() if spindle.radial_loads else [0.0, 0.0],
        "radial_load_z_mm": _mm(alone.z) if alone else None,
        "radial_load_body": structure.carrier(load_carrier(spindle, alone).name) if alone else None,
        "radial_loads": [
            {"force_N": list(load.force), "z_mm": _mm(load.z), "body": structure.carrier(load_carrier(spindle, load).name)} for load in spindle.radial_loads
        ],
        "gravity_m_per_s2": list(spindle.gravity),
        "unbalance_body": structure.carrier(unbalance_carrier(spindle, own).name) if structure.turns and (own.unbalance or own.couple_unbalance) else None,
        "ball_inertia": spindle.ball_inertia,
        "parts": {
            "turning": [*(s.name for s in structure.shafts if s.turns), *(b.name for b in plain if b.turns)],
            "standing": [*(s.name for s in structure.shafts if not s.turns), *(b.name for b in plain if not b.turns)],
        },
        "turning_mass_kg": spindle.turning_mass,
        "bearings": {b.name: _bearing(point, b) for b in spindle.all_bearings},
        "sets": {
            s.name: {
                "arrangement": arrangement([spindle.bearing(n) for n in s.bearings]),
                "bearings": list(s.bearings),
                "preload_N": s.preload,
                "kind": "from outside" if s.spring is None and spindle.one_way(s) else "rigid" if s.spring is None else "spring",
                "sprung": [] if s.spring is None else list(s.spring.rings_of),
                "rate_N_per_m": None if s.spring is None else s.spring.rate,
            }
            for s in spindle.sets
        },
        "shafts": {s.name: _shaft(spindle, s) for s in structure.shafts},
        "bodies": {b.name: _body(b) for b in plain},
        "joints": {
            j.name: {
                "between": [structure.carrier(n) for n in j.bodies],
                "z_mm": _mm(j.z),
                "stiffness": list(j.stiffness),
                "damping_ratio": j.damping_ratio,
                "loss_factor": j.loss_factor,
                "role": j.role,
            }
            for j in structure.own_joints
        },
        "points": {
            p.name: {
                "node": p.node,
                "on": structure.carrier(p.body),
                "position_mm": [_mm(x) for x in p.position],
                "direction": p.axis,
                "hammer": p.node in spindle.hammer.hammer_nodes,
                "sensor_mass_g": 1e3 * p.mass,
            }
            for p in drawn.points
        },
        "hammer": {
            "nodes": list(spindle.hammer.hammer_nodes),
            "band_Hz": list(spindle.hammer.band),
            "pulse_us": 1e6 * pulse_duration(spindle.hammer),
            "vanishes_at_Hz": 1.5 / pulse_duration(spindle.hammer),
            "step_us": 1e6 * spindle.hammer.step,
        },
        "modes_Hz": [m.frequency for m in point.modes if m.frequency <= spindle.hammer.band[1]],
        "modes_unseen": [{"frequency_Hz": m.frequency, "kind": m.kind} for m in unseen(point, spindle.hammer.band)],
        "section": {"regions": len(spindle.regions), "materials": sorted({g.material for g in spindle.regions})},
        "effects": {
            "of_the_scene": [a.effect for a in spindle.effects],
            "can_act": [e.name for e in catalogue if e.name not in refused],
            "nothing_to_act_on": refused,
        },
        "assumed": [{"key": key, "what": p.source.removeprefix(ASSUMED)} for key, p in spindle.provenance.items() if p.source.startswith(ASSUMED)],
    }


def arrangement(rows: Sequence[Bearing]) -> str:
    """How the rows of a set are mounted, in words: by their senses, the lowest first."""
    senses = [b.sense for b in sorted(rows, key=lambda b: b.z)]
    down, up = senses.count(-1), senses.count(1)
    if len(senses) == 1:
        return "single"
    if not down or not up:
        return f"{NUMBERS.get(len(senses), len(senses))} in tandem"
    turns = sum(a != b for a, b in pairwise(senses))
    way = "mixed" if turns > 1 else "back-to-back" if senses[0] == -1 else "face-to-face"
    return way if len(senses) == 2 else f"{NUMBERS.get(max(down, up), max(down, up))} against {NUMBERS.get(min(down, up), min(down, up))}, {way}"


def apex(b: Bearing, angle: float) -> float:
    """Height (m) at which a row's load lines meet the axis, at a contact angle (rad)."""
    return float(b.z + b.sense * b.pitch_diameter / 2 * np.tan(angle))


def free_angle(b: Bearing, state: BearingState) -> float | None:
    """Contact angle (rad) without load; None where the rings would press the balls without any."""
    cosine = (b.unloaded_distance + state.deformation) * np.cos(state.contact_angle) / b.unloaded_distance
    return float(np.arccos(cosine)) if cosine <= 1 else None


def _bearing(point: OperatingPoint, b: Bearing | LinearBearing | RollerBearing) -> dict[str, Any]:
    spindle, state = point.spindle, point.state.any_bearing(b.name)
    found: dict[str, Any] = {
        "kind": "ball row" if isinstance(b, Bearing) else "numbers",
        "z_mm": _mm(b.z),
        "inner_on": spindle.structure.carrier(b.inner_body),
        "outer_on": spindle.structure.carrier(b.outer_body),
        "radial_stiffness_N_per_um": 1e-6 * state.radial_stiffness,
        "radial_stiffness_y_N_per_um": 1e-6 * state.radial_stiffness_y,
        "axial_stiffness_N_per_um": 1e-6 * state.axial_stiffness,
        "tilt_stiffness_N_m_per_rad": state.tilt_stiffness,
        "radial_force_N": _borne(spindle, b, state.radial_force),
    }
    if isinstance(b, RollerBearing):
        assert isinstance(state, RollerState)
        return found | {
            "kind": "roller row",
            "rows": b.rows,
            "rollers": b.rollers,
            "roller_diameter_mm": _mm(b.roller_diameter),
            "roller_length_mm": _mm(b.roller_length),
            "pitch_diameter_mm": _mm(b.pitch_diameter),
            "clearance_um": 1e6 * state.clearance,
            "roller_force_N": state.contact_force,
            "cage_spread": cage_spread(state),
        }
    if isinstance(b, LinearBearing):
        table = {"temperatures_C": list(b.temperature), "speeds_rpm": [in_rpm(s) for s in b.speed]} if len(b.temperature) * len(b.speed) > 1 else None
        return found | {"table": table}
    own = point.state.bearing(b.name)
    free = free_angle(b, own)
    return found | {
        "set": spindle.set_of(b.name).name,
        "turning_ring": b.turning_ring,
        "sense": "+z" if b.sense == 1 else "-z",
        "balls": b.balls,
        "ball_diameter_mm": _mm(b.ball_diameter),
        "pitch_diameter_mm": _mm(b.pitch_diameter),
        "contact_angle_deg": float(np.degrees(own.contact_angle)),
        "free_contact_angle_deg": None if free is None else float(np.degrees(free)),
        "load_lines_meet_axis_at_mm": _mm(apex(b, own.contact_angle)),
        "preload_N": own.preload,
        "ball_force_N": own.contact_force,
        "cage_spread": cage_spread(own),
        "raceway_mm": {"inner": [_mm(z) for z in spindle.raceway(b.inner_ring, b)], "outer": [_mm(z) for z in spindle.raceway(b.outer_ring, b)]},
    }


def _borne(spindle: Spindle, b: Bearing | LinearBearing | RollerBearing, on_outer: tuple[float, float]) -> list[float]:
    """What a bearing bears of the radial load (N, along x and y), of the force that holds its outer ring: the sum over all is the load."""
    inner = next((own for own in spindle.structure.bodies if own.name == b.inner_body), None)
    sign = -1.0 if inner is not None and inner.turns else 1.0
    return [round(sign * f, 6) + 0.0 for f in on_outer]


def _shaft(spindle: Spindle, s: Shaft) -> dict[str, Any]:
    own = [b for b in spindle.structure.bodies if b.name in s.bodies]
    return {
        "z_mm": [_mm(s.nodes[0]), _mm(s.nodes[-1])],
        "length_mm": _mm(s.nodes[-1] - s.nodes[0]),
        "outer_diameter_mm": [_mm(2 * d) for d in (min(min(g.outer) for g in s.segments), max(max(g.outer) for g in s.segments))],
        "sides_mm": [[_mm(x) for x in g.sides] for g in s.segments if g.sides] or None,
        "segments": len(s.segments),
        "elements": len(s.elements),
        "beam": next((name for name, shares in THEORIES.items() if shares == (s.shear, s.rotary)), "of its own"),
        "mass_kg": sum(b.mass for b in own),
        "turns": s.turns,
        "speed_ratio": s.speed_ratio if s.turns else 0.0,
        "moves": list(s.moves),
        "damping_ratio": s.damping_ratio,
        "loss_factor": s.loss_factor,
        "role": s.role,
    }


def _body(b: Body) -> dict[str, Any]:
    return {
        "mass_kg": b.mass,
        "inertia_kg_m2": list(b.inertia),
        "z_mm": _mm(b.z),
        "moves": list(b.moves),
        "turns": b.turns,
        "speed_ratio": b.speed_ratio if b.turns else 0.0,
        "from_section": bool(b.regions),
        "role": b.role,
    }


def _mm(metres: float) -> float:
    return round(1e3 * metres, 6)
