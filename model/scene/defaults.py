"""What a scene file leaves to the program: the assumed values, told in its provenance."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from thermospindle.model import machine as m
from thermospindle.model.scene.bearings import BearingPair, BearingSet
from thermospindle.model.scene.fields import Table
from thermospindle.model.scene.measuring import Measuring, Point
from thermospindle.model.scene.section import Section
from thermospindle.model.scene.shafts import COARSE, ShaftForm
from thermospindle.model.scene.structure import Structure
from thermospindle.model.scene.thermal import MOVED_AIR, STILL_AIR, Thermal

GENTLE = 100_000.0
"""mm rpm, speed times pitch diameter, at which a spindle runs where its scene names no speed: a fifth of what grease allows."""
WARMER = 40.0  # K above the reference temperature up to which it is meant to run, where its scene does not say


class Told(Protocol):
    """What of a `form.Scene` may be missing in its file."""

    @property
    def hammer_test(self) -> Table: ...

    @property
    def tolerances(self) -> Table: ...

    @property
    def measuring(self) -> Measuring: ...

    def points(self) -> list[Point]: ...

    @property
    def section(self) -> Section: ...

    @property
    def thermal(self) -> Thermal: ...

    @property
    def nominal_speed_rpm(self) -> float | None: ...

    @property
    def temperature_range_C(self) -> tuple[float, float] | None: ...

    @property
    def bearing_pair(self) -> BearingPair | None: ...

    @property
    def sets(self) -> dict[str, BearingSet]: ...

    @property
    def ball_inertia(self) -> float | None: ...

    @property
    def shafts(self) -> list[ShaftForm]: ...

    @property
    def structure(self) -> Structure: ...

    def speed_rpm(self) -> float: ...


def assumed(scene: Told, told: Mapping[str, m.Provenance]) -> dict[str, m.Provenance]:
    """Provenance of what the file leaves to the program, by key."""
    found: dict[str, m.Provenance] = {}
    for table in ("hammer_test", "tolerances"):
        form = (scene.hammer_test if table == "hammer_test" else scene.tolerances)
        for key, value in form.model_dump(exclude={"origin", "source", "origins"}).items():
            if key not in form.model_fields_set:
                chosen = value is None or value == []
                said = "chosen by the program" if chosen else f"{value}"
                found[f"{table}.{key}"] = m.Provenance("assumed", f"assumed default: {said}")
    if not scene.measuring.points:
        named = ", ".join(p.name for p in scene.points())
        found["measuring.points"] = m.Provenance("assumed", f"assumed default: {named} on the axis at the ends of {scene.points()[0].body if named else ''!r}")
    warms = bool(scene.section.regions)
    if warms and not scene.thermal.convection:
        found["thermal.convection"] = m.Provenance(
            "assumed", f"assumed default: {STILL_AIR:g} W/m2 K on standing regions, {MOVED_AIR:g} on turning ones"
        )
    if warms and "friction" not in scene.thermal.model_fields_set:
        found["thermal.friction"] = m.Provenance("assumed", "assumed default: a light grease, f0 = 2, 26 mm2/s at 40 C")
    elif warms:
        for key, value in (("f0", "2"), ("f1", "0.0003"), ("conductance_W_per_K", "0.05"), ("kinematic_viscosity_mm2_per_s", "26 at 40 C, a light grease's")):
            if key not in scene.thermal.friction.model_fields_set:
                found[f"thermal.friction.{key}"] = m.Provenance("assumed", f"assumed default: {value}")
    if scene.nominal_speed_rpm is None and any([*(s.turns for s in scene.shafts), *(b.turns for b in scene.structure.bodies)]):
        said = f"assumed default: {scene.speed_rpm():g} rpm, a speed parameter of {GENTLE:g} mm rpm"
        found["nominal_speed_rpm"] = m.Provenance("assumed", said)
    if scene.temperature_range_C is None:
        found["temperature_range_C"] = m.Provenance(
            "assumed", f"assumed default: from the reference temperature to {WARMER:g} K above it"
        )
    pair = scene.bearing_pair
    if pair is not None and pair.preload_kind == "spring" and pair.arrangement != "tandem":
        if pair.sprung_bearing is None:
            found["bearing_pair.sprung_bearing"] = m.Provenance(
                "assumed", "assumed default: the upper bearing; the lower locates the shaft and takes axial loads"
            )
        if pair.preload_rate_N_per_m is None:
            found["bearing_pair.preload_rate_N_per_m"] = m.Provenance(
                "assumed", "assumed default: constant spring force as the ring slides, and a ring that friction holds in vibration"
            )
    if pair is not None:
        found["bearing_pair.ball_inertia"] = m.Provenance("assumed", "assumed default: 0, balls without inertia: no centrifugal force and no gyroscopic moment")
    if pair is None and scene.sets and scene.ball_inertia is None:
        found["ball_inertia"] = m.Provenance("assumed", "assumed default: 1, balls with their centrifugal force and gyroscopic moment")
    for shaft in scene.shafts:
        if "beam" not in shaft.model_fields_set:
            found[f"shafts.{shaft.name}.beam"] = m.Provenance("assumed", "assumed default: timoshenko, with shear and rotary inertia")
        if shaft.longest_element_mm is None:
            found[f"shafts.{shaft.name}.longest_element_mm"] = m.Provenance(
                "assumed", f"assumed default: {COARSE:g} of its length, and nodes where bearings, joints and points are"
            )
    return {key: value for key, value in found.items() if key not in told}
