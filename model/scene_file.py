"""The form of a scene file: every key with its unit, type and allowed range; `Scene.spindle` converts to SI definitions.

Its tables stand in `scene_section`, `scene_bearings`, `scene_structure`, `scene_thermal`, `scene_measuring` and
`scene_imperfections`, what all tables share in `file_table`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field, model_validator

from model import machine as m
from model.file_table import MM, RPM, Finite, Name, NotNegative, Positive, Table, first_error
from model.scene_bearings import BallRow, Bearing, BearingPair
from model.scene_imperfections import Imperfections
from model.scene_measuring import HammerTest, Measuring, Point
from model.scene_section import Material, Section
from model.scene_structure import Structure
from model.scene_thermal import Thermal

__all__ = ["MM", "RPM", "Finite", "Name", "NotNegative", "Point", "Positive", "Scene", "Table", "first_error"]


class Tolerances(Table):
    structure: Positive
    hub: Positive
    preload: Positive
    damping: Positive
    temperature_K: Positive
    gain: Positive

    def tolerances(self) -> m.Tolerances:
        return m.Tolerances(self.structure, self.hub, self.preload, self.damping, self.temperature_K, self.gain)


class Effect(Table):
    name: Name
    values: dict[str, Finite] = Field(default_factory=dict)


class Build(Table):
    deviations: dict[str, Annotated[float, Field(gt=-0.5, lt=1.0)]] = Field(min_length=1)
    tests: list[str] = Field(default_factory=list)

    def build(self) -> m.Build:
        return m.Build(dict(self.deviations), tuple(self.tests))


class Scene(Table):
    title: Name
    reference_temperature_C: Finite
    materials: dict[str, Material] = Field(min_length=1)
    section: Section
    ball_rows: dict[str, BallRow] = Field(min_length=1)
    bearings: dict[str, Bearing] = Field(min_length=2, max_length=2)
    bearing_pair: BearingPair
    structure: Structure
    thermal: Thermal
    measuring: Measuring
    hammer_test: HammerTest
    tolerances: Tolerances
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

    def spindle(self, name: str, file: Path, provenance: dict[str, m.Provenance]) -> m.Spindle:
        bearings = sorted((b.bearing(n, self.ball_rows) for n, b in self.bearings.items()), key=lambda b: b.z)
        return m.Spindle(
            name,
            self.title,
            self.reference_temperature_C,
            {n: t.material(n) for n, t in self.materials.items()},
            tuple(r.region() for r in self.section.regions),
            tuple(bearings),
            self.bearing_pair.pair(),
            self.structure.structure(),
            tuple(p.point() for p in self.measuring.points),
            self.hammer_test.test(),
            self.thermal.thermal(),
            self.tolerances.tolerances(),
            tuple(m.Addition(e.name, dict(e.values)) for e in self.effects),
            self.build.build() if self.build else None,
            self.imperfections.imperfections({b.name: b.balls for b in bearings}),
            provenance,
            file,
        )
