"""The form of a scene file: every key with its unit, type and allowed range; `Scene.spindle` converts to SI definitions.

Its tables stand in `section`, `bearings`, `structure`, `thermal`, `measuring` and `imperfections`, what all tables share in `fields`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

from pydantic import Field, ValidationError, model_validator

from thermospindle.model import machine as m
from thermospindle.model.bearing.definitions import SENSE
from thermospindle.model.built.tolerance import LEAST, MOST
from thermospindle.model.drawing import measuring as drawn
from thermospindle.model.errors import BadInput
from thermospindle.model.files.formats import CURRENT, SCENE
from thermospindle.model.scene.bearings import BallRow, Bearing, BearingPair, BearingSet, Mounted, RollerRow, check_sets
from thermospindle.model.scene.defaults import GENTLE, WARMER, assumed
from thermospindle.model.scene.fields import (
    Finite,
    Gravity,
    Name,
    NotNegative,
    Pair,
    Place,
    Positive,
    Table,
    Temperature,
    TemperatureSpan,
    Title,
    first_error,
    format_of,
)
from thermospindle.model.scene.imperfections import Imperfections
from thermospindle.model.scene.measuring import HammerTest, Measuring, Point, assumed_points
from thermospindle.model.scene.section import Material, Section
from thermospindle.model.scene.shafts import ShaftForm, resolved_body
from thermospindle.model.scene.structure import Structure, StructureBody
from thermospindle.model.scene.thermal import Thermal
from thermospindle.model.units import MM, RPM

__all__ = ["Finite", "Name", "NotNegative", "Point", "Positive", "Scene", "Table", "Title", "first_error"]


class Tolerances(Table):
    """One standard deviation of build and measurement; every key has an assumed default, that of careful small-series work.

    `preload` is also that of the clearance of mounted rollers.
    """

    structure: Positive = 0.015
    hub: Positive = 0.004
    preload: Positive = 0.03
    damping: Positive = 0.12
    temperature_K: Positive = 0.2
    gain: Positive = 0.01

    def tolerances(self) -> drawn.Tolerances:
        return drawn.Tolerances(
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


class RadialLoad(Table):
    force_N: Pair
    z_mm: Place
    body: str | None = None

    def load(self, number: int) -> m.RadialLoad:
        return m.RadialLoad(self.force_N, self.z_mm * MM, self.body or "", f"radial_loads.{number}.")


class Build(Table):
    deviations: dict[str, Annotated[float, Field(ge=LEAST, le=MOST)]] = Field(min_length=1)
    tests: list[str] = Field(default_factory=list)

    def build(self) -> m.Build:
        return m.Build(deviations=dict(self.deviations), tests=tuple(self.tests))


def _of_section(shaft: ShaftForm, section: Section, densities: dict[str, float]) -> ShaftForm:
    unknown = [r for r in section.regions if r.name in (*shaft.regions, *shaft.mass_regions) and r.material not in densities]
    if unknown:
        raise ValueError(f"section.regions.{unknown[0].name}.material = {unknown[0].material!r}: allowed are {', '.join(densities)}")
    try:
        return shaft.from_section(section, densities)
    except ValidationError as error:
        raise ValueError(f"shafts.{shaft.name}: {error.errors()[0]['msg'].removeprefix('Value error, ')}") from None
    except ValueError as error:
        raise ValueError(f"shafts.{shaft.name}.{error}") from None


class Scene(Table):
    format: format_of(SCENE) = CURRENT[SCENE]  # type: ignore[valid-type]
    title: Title
    reference_temperature_C: Temperature
    nominal_speed_rpm: Annotated[float, Field(ge=1e-3, le=1e8)] | None = None
    temperature_range_C: TemperatureSpan | None = None
    materials: dict[Name, Material] = Field(min_length=1)
    section: Section = Section()
    ball_rows: dict[Name, BallRow] = Field(default_factory=dict)
    roller_rows: dict[Name, RollerRow] = Field(default_factory=dict)
    bearings: dict[Name, Bearing] = Field(default_factory=dict)
    bearing_pair: BearingPair | None = None
    sets: dict[Name, BearingSet] = Field(default_factory=dict)
    ball_inertia: Annotated[float, Field(ge=0, le=1)] | None = None
    axial_load_N: Finite = 0.0
    radial_load_N: Pair = (0.0, 0.0)
    radial_load_z_mm: Place | None = None
    radial_load_body: str | None = None
    radial_loads: list[RadialLoad] = Field(default_factory=list)
    gravity_m_per_s2: Gravity = (0.0, 0.0)
    structure: Structure
    shafts: list[ShaftForm] = Field(default_factory=list)
    thermal: Thermal = Thermal()
    measuring: Measuring = Measuring()
    hammer_test: HammerTest = HammerTest()
    tolerances: Tolerances = Tolerances()
    effects: list[Effect] = Field(default_factory=list)
    build: Build | None = None
    imperfections: Imperfections = Imperfections()

    @model_validator(mode="after")
    def _shafts_of_the_section(self) -> Scene:
        densities = {name: material.density_kg_per_m3 for name, material in self.materials.items()}
        return self.model_copy(update={"shafts": [_of_section(shaft, self.section, densities) for shaft in self.shafts]})

    @model_validator(mode="after")
    def _rows_exist(self) -> Scene:
        both = set(self.ball_rows) & set(self.roller_rows)
        if both:
            raise ValueError(f"roller_rows.{min(both)}: a ball row has that name; names of rows must differ")
        for name, bearing in self.bearings.items():
            if bearing.row is not None:
                try:
                    bearing.check_row(bearing.row in self.ball_rows)
                except ValueError as error:
                    raise ValueError(f"bearings.{name}: {error}") from None
        return self

    @model_validator(mode="after")
    def _sets_hold_every_row(self) -> Scene:
        check_sets({n: b for n, b in self.bearings.items() if b.row in self.ball_rows}, self.bearing_pair, self.sets)
        return self

    @model_validator(mode="after")
    def _radial_load_has_a_place(self) -> Scene:
        if any(self.radial_load_N) and self.radial_load_z_mm is None:
            raise ValueError("radial_load_z_mm is missing: the height at which radial_load_N acts on what turns")
        turns = [*(s.turns for s in self.shafts), *(b.turns for b in self.structure.bodies)]
        if not any(turns) and (loads := self._radial_loads()):
            raise ValueError(f"{loads[0].told}: nothing turns that it could act on; a body or shaft needs turns = true")
        return self

    def _radial_loads(self) -> tuple[m.RadialLoad, ...]:
        """All that are not nothing."""
        single = m.RadialLoad(self.radial_load_N, (self.radial_load_z_mm or 0.0) * MM, self.radial_load_body or "")
        return tuple(load for load in (single, *(load.load(k) for k, load in enumerate(self.radial_loads, 1))) if any(load.force))

    @model_validator(mode="after")
    def _ball_inertia_told_once(self) -> Scene:
        if self.bearing_pair is not None and self.ball_inertia is not None:
            raise ValueError("ball_inertia: with a bearing_pair it stands there, as bearing_pair.ball_inertia")
        return self

    @model_validator(mode="after")
    def _imperfections_fit_the_bearings(self) -> Scene:
        rolling = {n: b.row for n, b in self.bearings.items() if b.row in self.ball_rows or b.row in self.roller_rows}
        for name, row in self.imperfections.bearings.items():
            if (own := rolling.get(name)) is None:
                raise ValueError(f"imperfections.bearings.{name}: names no bearing with a ball or roller row; allowed are {', '.join(rolling)}")
            try:
                if own in self.ball_rows:
                    row.check(self.ball_rows[own].balls)
                else:
                    row.check(self.roller_rows[own].rows * self.roller_rows[own].rollers, rollers=True)
            except ValueError as error:
                raise ValueError(f"imperfections.bearings.{name}.{error}") from None
        return self

    def rows(self) -> dict[str, Bearing]:
        """The bearings with a ball row, the lowest first."""
        rows = {n: b for n, b in self.bearings.items() if b.row in self.ball_rows}
        return dict(sorted(rows.items(), key=lambda item: item[1].z_mm))

    def points(self) -> list[Point]:
        """The measuring points; where none are told those of `assumed_points` on the first thing that turns, or that moves at all."""
        if self.measuring.points:
            return self.measuring.points
        moving: list[ShaftForm | StructureBody] = [*self.shafts, *self.structure.bodies]
        if not moving:
            return []
        own = next((b for b in moving if b.turns), moving[0])
        if isinstance(own, ShaftForm):
            ends = own.start_z_mm, own.start_z_mm + own.length_mm
        else:
            heights = [z for g in self.section.regions if g.name in own.regions for z in g.z_mm] or [own.z_mm or 0.0]
            ends = min(heights), max(heights)
        return assumed_points(own.name, ends, own.moves)

    def _heights_on(self, shaft: str) -> list[float]:
        """Heights (m) of all that sits on a shaft: bearings, joints, measuring points."""
        default = self.structure.inner_body, self.structure.outer_body
        found = [b.z_mm for b in self.bearings.values() if shaft in (b.inner_body or default[0], b.outer_body or default[1])]
        found += [j.z_mm for j in self.structure.joints if shaft in j.between]
        found += [p.position_mm[2] for p in self.points() if p.body == shaft]
        return [MM * z for z in found]

    def spindle(self, name: str, file: Path, provenance: dict[str, m.Provenance]) -> m.Spindle:
        """The spindle in SI units; its shafts have their nodes, which `reading.build` makes bodies of."""
        rows, reference = self.rows(), self.reference_temperature_C
        shafts = {s.name: s.shaft(self._heights_on(s.name)) for s in self.shafts}
        turning = {b.name for b in self.structure.bodies if b.turns} | {s.name for s in self.shafts if s.turns}
        pair = self.bearing_pair
        sets = tuple(s.set(n) for n, s in self.sets.items()) if pair is None else (pair.set(list(rows)),)
        if pair is not None:
            senses = dict(zip(rows, SENSE[pair.arrangement], strict=True))
        else:
            senses = {n: 1 if b.sense == "+z" else -1 for n, b in rows.items()}
        shares = {n: s.preload / sum(senses[k] == senses[n] for k in s.bearings) for s in sets for n in s.bearings}

        def ends(key: str, b: Bearing) -> tuple[str, str]:
            """Bodies of the inner and the outer ring as the file names them, the scene's own where the bearing names none."""
            told = (b.inner_body or self.structure.inner_body, b.outer_body or self.structure.outer_body)
            for body, missing in zip(told, ("inner_body", "outer_body"), strict=True):
                if body is None:
                    raise BadInput(f"{file}: bearings.{key}.{missing}: missing; a bearing or structure.{missing} must name the body that carries its ring")
            return str(told[0]), str(told[1])

        def mounted(key: str, b: Bearing) -> Mounted:
            inner, outer = ends(key, b)
            turns = pair.turning_ring if pair is not None else "outer" if outer in turning and inner not in turning else "inner"
            at = b.z_mm * MM
            return Mounted(resolved_body(shafts, inner, at), resolved_body(shafts, outer, at), turns, shares[key])

        linear, rollers = [], []
        for key, b in self.bearings.items():
            if b.row not in self.ball_rows:
                inner, outer = (resolved_body(shafts, body, b.z_mm * MM) for body in ends(key, b))
                if b.row is not None:
                    rollers.append(b.rollers(key, self.roller_rows[b.row], inner, outer))
                else:
                    linear.append(b.linear(key, inner, outer, file))
        bearings = tuple(b.bearing(key, self.ball_rows, senses[key], mounted(key, b)) for key, b in rows.items())
        regions = tuple(r.region() for r in self.section.regions)
        points = tuple(replace(p, body=resolved_body(shafts, p.body, p.position[2])) for p in (p.point() for p in self.points()))
        return m.Spindle(
            name=name,
            title=self.title,
            reference_temperature=reference,
            materials={n: t.material(n) for n, t in self.materials.items()},
            regions=regions,
            bearings=bearings,
            sets=sets,
            structure=self.structure.structure(tuple(shafts.values())),
            points=points,
            hammer=self.hammer_test.test([p.node for p in points]),
            thermal=self.thermal.thermal(regions),
            tolerances=self.tolerances.tolerances(),
            nominal_speed=self.speed_rpm() * RPM,
            temperatures=self.temperature_range_C or (reference, reference + WARMER),
            ball_inertia=pair.ball_inertia if pair is not None else self.ball_inertia if self.ball_inertia is not None else 1.0,
            axial_load=self.axial_load_N,
            radial_loads=self._radial_loads(),
            gravity=self.gravity_m_per_s2,
            linear_bearings=tuple(sorted(linear, key=lambda b: b.z)),
            roller_bearings=tuple(sorted(rollers, key=lambda b: b.z)),
            effects=tuple(m.Addition(effect=e.name, values=dict(e.values)) for e in self.effects),
            build=self.build.build() if self.build else None,
            imperfections=self.imperfections.imperfections({b.name: b.elements for b in bearings} | {b.name: b.elements for b in rollers}),
            provenance=provenance | assumed(self, provenance),
            file=file,
        )

    def speed_rpm(self) -> float:
        """The nominal speed; where the file names none, two digits of `GENTLE` over the largest pitch diameter, or shaft diameter."""
        if self.nominal_speed_rpm is not None:
            return self.nominal_speed_rpm
        rows: dict[str, BallRow | RollerRow] = {**self.ball_rows, **self.roller_rows}
        diameters = [rows[b.row].pitch_diameter_mm for b in self.bearings.values() if b.row is not None]
        diameters = diameters or [max(p[:-1]) for s in self.shafts for p in s.outer_mm or s.width_mm] or [100.0]
        return float(f"{GENTLE / max(diameters):.1e}")
