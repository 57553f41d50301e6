"""The form of a scene file: every key with its unit, type and allowed range; `Scene.spindle` converts to SI definitions.

Its tables stand in `section`, `bearings`, `structure`, `thermal`, `measuring` and `imperfections`, what all tables share in `fields`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from thermospindle.model import machine as m
from thermospindle.model.scene.bearings import BallRow, Bearing, BearingPair
from thermospindle.model.scene.fields import Finite, Name, NotNegative, Positive, Table, Temperature, TemperatureSpan, first_error
from thermospindle.model.scene.imperfections import Imperfections
from thermospindle.model.scene.measuring import HammerTest, Measuring, Point
from thermospindle.model.scene.section import Material, Section
from thermospindle.model.scene.structure import Structure
from thermospindle.model.scene.thermal import MOVED_AIR, STILL_AIR, Thermal
from thermospindle.model.units import RPM

__all__ = ["Finite", "Name", "NotNegative", "Point", "Positive", "Scene", "Table", "first_error"]


class Tolerances(Table):
    """One standard deviation of build and measurement; every key has an assumed default, that of careful small-series work."""

    structure: Positive = 0.015
    hub: Positive = 0.004
    preload: Positive = 0.03
    damping: Positive = 0.12
    temperature_K: Positive = 0.2
    gain: Positive = 0.01

    def tolerances(self) -> m.Tolerances:
        return m.Tolerances(
            structure=self.structure,
            hub=self.hub,
            preload=self.preload,
            damping=self.damping,
            temperature=self.temperature_K,
            gain=self.gain,
        )


class Effect(Table):
    name: Name
    values: dict[str, Finite] = Field(default_factory=dict)


class Build(Table):
    deviations: dict[str, Annotated[float, Field(gt=-0.5, lt=1.0)]] = Field(min_length=1)
    tests: list[str] = Field(default_factory=list)

    def build(self) -> m.Build:
        return m.Build(deviations=dict(self.deviations), tests=tuple(self.tests))


GENTLE = 100_000.0
"""mm rpm, speed times pitch diameter, at which a spindle runs where its scene names no speed: a fifth of what grease allows."""
WARMER = 40.0  # K above the reference temperature up to which it is meant to run, where its scene does not say


class Scene(Table):
    title: Name
    reference_temperature_C: Temperature
    nominal_speed_rpm: Annotated[float, Field(ge=1e-3, le=1e8)] | None = None
    temperature_range_C: TemperatureSpan | None = None
    materials: dict[str, Material] = Field(min_length=1)
    section: Section
    ball_rows: dict[str, BallRow] = Field(min_length=1)
    bearings: dict[str, Bearing] = Field(min_length=2, max_length=2)
    bearing_pair: BearingPair
    structure: Structure
    thermal: Thermal = Thermal()
    measuring: Measuring
    hammer_test: HammerTest = HammerTest()
    tolerances: Tolerances = Tolerances()
    effects: list[Effect] = Field(default_factory=list)
    build: Build | None = None
    imperfections: Imperfections = Imperfections()

    @model_validator(mode="after")
    def _rows_exist(self) -> Scene:
        for name, bearing in self.bearings.items():
            if bearing.row not in self.ball_rows:
                raise ValueError(f"bearings.{name}.row = {bearing.row!r}: allowed are {', '.join(self.ball_rows)}")
        return self

    @model_validator(mode="after")
    def _imperfections_fit_the_bearings(self) -> Scene:
        for name, row in self.imperfections.bearings.items():
            if name not in self.bearings:
                raise ValueError(f"imperfections.bearings.{name}: names no bearing; allowed are {', '.join(self.bearings)}")
            try:
                row.check(self.ball_rows[self.bearings[name].row].balls)
            except ValueError as error:
                raise ValueError(f"imperfections.bearings.{name}.{error}") from None
        return self

    @model_validator(mode="after")
    def _sprung_bearing_exists(self) -> Scene:
        sprung = self.bearing_pair.sprung_bearing
        if sprung is not None and sprung not in self.bearings:
            raise ValueError(f"bearing_pair.sprung_bearing = {sprung!r}: allowed are {', '.join(self.bearings)}")
        return self

    def spindle(self, name: str, file: Path, provenance: dict[str, m.Provenance]) -> m.Spindle:
        order = sorted(self.bearings, key=lambda n: self.bearings[n].z_mm)
        senses = m.SENSE[self.bearing_pair.arrangement]
        bearings = tuple(self.bearings[n].bearing(n, self.ball_rows, sense) for n, sense in zip(order, senses, strict=True))
        regions = tuple(r.region() for r in self.section.regions)
        points = tuple(p.point() for p in self.measuring.points)
        reference = self.reference_temperature_C
        return m.Spindle(
            name=name,
            title=self.title,
            reference_temperature=reference,
            materials={n: t.material(n) for n, t in self.materials.items()},
            regions=regions,
            bearings=bearings,
            pair=self.bearing_pair.pair(order),
            structure=self.structure.structure(),
            points=points,
            hammer=self.hammer_test.test([p.node for p in points]),
            thermal=self.thermal.thermal(regions),
            tolerances=self.tolerances.tolerances(),
            nominal_speed=self.speed_rpm() * RPM,
            temperatures=self.temperature_range_C or (reference, reference + WARMER),
            effects=tuple(m.Addition(effect=e.name, values=dict(e.values)) for e in self.effects),
            build=self.build.build() if self.build else None,
            imperfections=self.imperfections.imperfections({b.name: b.balls for b in bearings}),
            provenance=provenance | self._assumed(provenance),
            file=file,
        )

    def speed_rpm(self) -> float:
        """The nominal speed; where the file names none, two digits of `GENTLE` over the largest pitch diameter."""
        if self.nominal_speed_rpm is not None:
            return self.nominal_speed_rpm
        return float(f"{GENTLE / max(self.ball_rows[b.row].pitch_diameter_mm for b in self.bearings.values()):.1e}")

    def _assumed(self, told: Mapping[str, m.Provenance]) -> dict[str, m.Provenance]:
        """Provenance of what the file leaves to the program, by key."""
        found: dict[str, m.Provenance] = {}
        for table in ("hammer_test", "tolerances"):
            form = getattr(self, table)
            for key, value in form.model_dump(exclude={"origin", "source", "origins"}).items():
                if key not in form.model_fields_set:
                    chosen = value is None or value == []
                    said = "chosen by the program" if chosen else f"{value}"
                    found[f"{table}.{key}"] = m.Provenance("assumed", f"assumed default: {said}")
        if not self.thermal.convection:
            found["thermal.convection"] = m.Provenance(
                "assumed", f"assumed default: {STILL_AIR:g} W/m2 K on standing regions, {MOVED_AIR:g} on turning ones"
            )
        if "friction" not in self.thermal.model_fields_set:
            found["thermal.friction"] = m.Provenance("assumed", "assumed default: a light grease, f0 = 2, 26 mm2/s at 40 C")
        if self.nominal_speed_rpm is None:
            said = f"assumed default: {self.speed_rpm():g} rpm, a speed parameter of {GENTLE:g} mm rpm"
            found["nominal_speed_rpm"] = m.Provenance("assumed", said)
        if self.temperature_range_C is None:
            found["temperature_range_C"] = m.Provenance(
                "assumed", f"assumed default: from the reference temperature to {WARMER:g} K above it"
            )
        pair = self.bearing_pair
        if pair.preload_kind == "spring" and pair.arrangement != "tandem":
            if pair.sprung_bearing is None:
                found["bearing_pair.sprung_bearing"] = m.Provenance(
                    "assumed", "assumed default: the upper bearing; the lower locates the shaft and takes axial loads"
                )
            if pair.preload_rate_N_per_m is None:
                found["bearing_pair.preload_rate_N_per_m"] = m.Provenance(
                    "assumed", "assumed default: constant spring force as the ring slides, and a ring that friction holds in vibration"
                )
        return {key: value for key, value in found.items() if key not in told}
