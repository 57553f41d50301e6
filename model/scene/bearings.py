"""The form of a scene file: ball rows, bearings, and how sets of them are preloaded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, Strict, model_validator

from thermospindle.model import machine as m
from thermospindle.model.bearing.catalogue import CatalogueRow, derived
from thermospindle.model.bearing.definitions import PreloadSpring, ToldAngle
from thermospindle.model.scene.bearing_numbers import Numbers
from thermospindle.model.scene.fields import Once, Place, Positive, Share, Span, Table
from thermospindle.model.units import DEGREE, MM

Three = Annotated[tuple[Positive, Positive, Positive], Strict(False)]


def _too_many(body: str, count: int, diameter: float, pitch: float) -> str:
    """What is said of more bodies, each a `ball` or a `roller`, than there is room for on a pitch circle (mm)."""
    most = int(np.pi * pitch / diameter)
    room = f"at most {most} do, side by side" if most > 1 else f"{count} of them are {np.pi * pitch / count:.4g} mm at most"
    return f"{body}s = {count}: so many of {body}_diameter_mm = {diameter:g} do not fit on the pitch circle of pitch_diameter_mm = {pitch:g}; {room}"


class Catalogue(Table):
    """What a catalogue prints of a universal pair of spindle bearings at its light, medium and heavy preload."""

    preload_N: Three
    unloading_force_N: Three
    axial_rigidity_N_per_um: Three


class BallRow(Table):
    balls: Annotated[int, Field(ge=3, le=1000)]
    ball_diameter_mm: Annotated[float, Field(ge=1e-3, le=1e3)]
    pitch_diameter_mm: Annotated[float, Field(ge=1e-2, le=1e4)]
    contact_angle_deg: Annotated[float, Field(ge=1e-3, lt=90)] | None = None
    inner_conformity: Annotated[float, Field(gt=0.5, lt=1)] | None = None
    outer_conformity: Annotated[float, Field(gt=0.5, lt=1)] | None = None
    diametral_clearance_mm: Span | None = None
    free_contact_angle_deg: Annotated[float, Field(ge=1e-3, lt=90)] | None = None
    catalogue: Catalogue | None = None
    ball_material: str
    ring_material: str
    damping_ratio: Share

    @model_validator(mode="after")
    def _balls_fit(self) -> BallRow:
        if self.balls * self.ball_diameter_mm > np.pi * self.pitch_diameter_mm:
            raise ValueError(_too_many("ball", self.balls, self.ball_diameter_mm, self.pitch_diameter_mm))
        if (self.contact_angle_deg is None) == (self.free_contact_angle_deg is None):
            raise ValueError("a ball row has either contact_angle_deg, under the preload, or free_contact_angle_deg, without load")
        told = [key for key in ("inner_conformity", "outer_conformity") if getattr(self, key) is not None]
        if self.catalogue is None and len(told) < 2:
            raise ValueError("inner_conformity and outer_conformity are missing; a ball row has both, or a catalogue from which they follow")
        if self.catalogue is not None and told:
            raise ValueError(f"{told[0]} follows from the catalogue; a ball row has one or the other")
        if self.catalogue is not None and self.free_contact_angle_deg is None:
            raise ValueError("a catalogue is for the angle without load; with it goes free_contact_angle_deg")
        return self

    def catalogue_row(self) -> CatalogueRow | None:
        """What the catalogue tells, in SI units."""
        if self.catalogue is None or self.free_contact_angle_deg is None:
            return None
        c = self.catalogue
        return CatalogueRow(
            contact_angle=self.free_contact_angle_deg * DEGREE,
            preload=c.preload_N,
            unloading_force=c.unloading_force_N,
            axial_rigidity=(c.axial_rigidity_N_per_um[0] * 1e6, c.axial_rigidity_N_per_um[1] * 1e6, c.axial_rigidity_N_per_um[2] * 1e6),
        )


class RollerRow(Table):
    """Cylindrical rollers, free along the axis. `mounted_clearance_um` is the diametral clearance at the reference temperature, as mounted:
    negative where the rollers are preloaded."""

    rollers: Annotated[int, Field(ge=3, le=1000)]
    rows: Annotated[int, Field(ge=1, le=8)] = 1
    row_spacing_mm: Positive | None = None
    roller_diameter_mm: Annotated[float, Field(ge=1e-3, le=1e3)]
    roller_length_mm: Annotated[float, Field(ge=1e-3, le=1e3)]
    pitch_diameter_mm: Annotated[float, Field(ge=1e-2, le=1e4)]
    mounted_clearance_um: Annotated[float, Field(ge=-1000, le=1000)] = 0.0
    roller_material: str
    ring_material: str
    damping_ratio: Share

    @model_validator(mode="after")
    def _rollers_fit(self) -> RollerRow:
        if self.rollers * self.roller_diameter_mm > np.pi * self.pitch_diameter_mm:
            raise ValueError(_too_many("roller", self.rollers, self.roller_diameter_mm, self.pitch_diameter_mm))
        if self.rows > 1 and self.row_spacing_mm is None:
            raise ValueError("row_spacing_mm is missing: the distance between the middles of rows side by side")
        if self.rows == 1 and self.row_spacing_mm is not None:
            raise ValueError("row_spacing_mm is for several rows side by side, and here is one")
        if self.row_spacing_mm is not None and self.row_spacing_mm < self.roller_length_mm:
            raise ValueError(f"row_spacing_mm = {self.row_spacing_mm:g}: the rows would overlap; it must be at least roller_length_mm")
        return self


class Bearing(Table):
    """A ball row or roller row (`row`, between two rings of the section), or a bearing given by numbers."""

    z_mm: Place
    row: str | None = None
    inner_ring: str | None = None
    outer_ring: str | None = None
    raceway_width_mm: Positive | None = None
    sense: Literal["+z", "-z"] | None = None
    inner_body: str | None = None
    outer_body: str | None = None
    rated_radial_stiffness_N_per_um: Positive | None = None
    race_give_um_per_kN: Annotated[float, Field(ge=0, le=1000)] | None = None
    numbers: Numbers | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Bearing:
        if (self.row is None) == (self.numbers is None):
            raise ValueError("a bearing has either row, the name of its ball row or roller row, or numbers, a table of its stiffness")
        if self.row is None:
            for key in ("inner_ring", "outer_ring", "raceway_width_mm", "sense", "rated_radial_stiffness_N_per_um", "race_give_um_per_kN"):
                if getattr(self, key) is not None:
                    raise ValueError(f"{key} is for a ball row; a bearing given by numbers has none")
        return self

    def check_row(self, balls: bool) -> None:
        """ValueError where a ball row lacks its rings, or a roller row has what only balls have, or half its rings."""
        for key in ("inner_ring", "outer_ring") if balls else ():
            if getattr(self, key) is None:
                raise ValueError(f"{key} is missing; a ball row lies between two rings of the section")
        if balls and self.race_give_um_per_kN is not None:
            raise ValueError("race_give_um_per_kN is for a roller row, whose clearance opens as its races give under the rollers' loads")
        for key in () if balls else ("sense", "rated_radial_stiffness_N_per_um"):
            if getattr(self, key) is not None:
                raise ValueError(f"{key} is for a ball row; rollers carry nothing along the axis and compute their own stiffness")
        if not balls and (self.inner_ring is None) != (self.outer_ring is None):
            raise ValueError("a roller row lies between two rings of the section or none: inner_ring and outer_ring go together")

    def rollers(self, name: str, row: RollerRow, inner_body: str, outer_body: str) -> m.RollerBearing:
        """The bearing on a roller row, between two bodies."""
        return m.RollerBearing(
            name=name,
            z=self.z_mm * MM,
            inner_ring=self.inner_ring or "",
            outer_ring=self.outer_ring or "",
            rows=row.rows,
            row_spacing=(row.row_spacing_mm or 0.0) * MM,
            rollers=row.rollers,
            roller_diameter=row.roller_diameter_mm * MM,
            roller_length=row.roller_length_mm * MM,
            pitch_diameter=row.pitch_diameter_mm * MM,
            clearance=row.mounted_clearance_um * 1e-6,
            roller_material=row.roller_material,
            ring_material=row.ring_material,
            damping_ratio=row.damping_ratio,
            inner_body=inner_body,
            outer_body=outer_body,
            raceway_width=None if self.raceway_width_mm is None else self.raceway_width_mm * MM,
            race_give=(self.race_give_um_per_kN or 0.0) * 1e-9,
        )

    def bearing(self, name: str, rows: Mapping[str, BallRow], sense: int, mounted: Mounted) -> m.Bearing:
        """The bearing; one told by its free contact angle has it still as its loaded one, which `reading.build` mends."""
        assert self.row is not None
        assert self.inner_ring is not None
        assert self.outer_ring is not None
        row = rows[self.row]
        key = "free_contact_angle_deg" if row.contact_angle_deg is None else "contact_angle_deg"
        angle = getattr(row, key)
        clearance = row.diametral_clearance_mm
        inner, outer = row.inner_conformity, row.outer_conformity
        if inner is None or outer is None:  # from the catalogue: both alike, so that f_i + f_o - 1 gives the unloaded distance
            told = row.catalogue_row()
            assert told is not None
            inner = outer = (1 + derived(told).unloaded_distance / (row.ball_diameter_mm * MM)) / 2
        return m.Bearing(
            name=name,
            z=self.z_mm * MM,
            inner_ring=self.inner_ring,
            outer_ring=self.outer_ring,
            balls=row.balls,
            ball_diameter=row.ball_diameter_mm * MM,
            pitch_diameter=row.pitch_diameter_mm * MM,
            contact_angle=angle * DEGREE,
            inner_conformity=inner,
            outer_conformity=outer,
            clearance=None if clearance is None else (clearance[0] * MM, clearance[1] * MM),
            ball_material=row.ball_material,
            ring_material=row.ring_material,
            damping_ratio=row.damping_ratio,
            sense=sense,
            inner_body=mounted.inner_body,
            outer_body=mounted.outer_body,
            turning_ring=mounted.turning_ring,
            preload=mounted.preload,
            raceway_width=None if self.raceway_width_mm is None else self.raceway_width_mm * MM,
            rated_stiffness=None if self.rated_radial_stiffness_N_per_um is None else self.rated_radial_stiffness_N_per_um * 1e6,
            told=ToldAngle(self.row, key, angle),
        )

    def linear(self, name: str, inner_body: str, outer_body: str, file: Path) -> m.LinearBearing:
        """The bearing given by numbers; a table is read from the folder of the scene's `file`."""
        assert self.numbers is not None
        temperature, speed, stiffness = self.numbers.grid(file, f"bearings.{name}.numbers.table")
        return m.LinearBearing(
            name, self.z_mm * MM, inner_body, outer_body, temperature, speed, stiffness, self.numbers.damping_ratio
        )


@dataclass(frozen=True)
class Mounted:
    """How a bearing is mounted: its bodies, the ring that turns, its share of the preload (N)."""

    inner_body: str
    outer_body: str
    turning_ring: str
    preload: float


class _Preloaded(Table):
    preload_N: Annotated[float, Field(gt=0, le=1e7)]
    preload_kind: Literal["rigid", "spring"]
    preload_rate_N_per_m: Positive | None = None
    sprung_ring_mass_g: Positive | None = None

    @model_validator(mode="after")
    def _spring_numbers(self) -> _Preloaded:
        if self.sprung_ring_mass_g is not None and self.preload_rate_N_per_m is None:
            raise ValueError("sprung_ring_mass_g needs preload_rate_N_per_m, the spring on which the ring moves")
        return self

    def _spring(self, rings_of: Sequence[str]) -> PreloadSpring:
        return PreloadSpring(tuple(rings_of), self.preload_rate_N_per_m, (self.sprung_ring_mass_g or 0.0) * 1e-3)


class BearingPair(_Preloaded):
    """Two bearings mounted against each other: short for a set, whose senses follow from the arrangement."""

    arrangement: Literal["back-to-back", "face-to-face", "tandem"]
    turning_ring: Literal["inner", "outer"]
    ball_inertia: Annotated[float, Field(ge=0, le=1)] = 0.0
    sprung_bearing: str | None = None

    @model_validator(mode="after")
    def _tandem_needs_a_spring(self) -> BearingPair:
        if self.arrangement == "tandem" and self.preload_kind == "rigid":
            raise ValueError("a tandem pair cannot preload itself; preload_kind must be spring")
        for key in ("sprung_bearing", "preload_rate_N_per_m", "sprung_ring_mass_g"):
            if getattr(self, key) is not None and (self.preload_kind == "rigid" or self.arrangement == "tandem"):
                raise ValueError(f"{key} is for a pair with preload_kind = spring whose rings load each other, which this is not")
        return self

    def set(self, names: Sequence[str]) -> m.BearingSet:
        """`names` are the bearings', the lowest first; the upper one is sprung unless the file says another. Of a tandem pair each row
        has the preload, and the set both of them."""
        tandem = self.arrangement == "tandem"
        sprung = self.preload_kind == "spring" and not tandem
        spring = self._spring([self.sprung_bearing or names[-1]]) if sprung else None
        return m.BearingSet("pair", tuple(names), self.preload_N * (len(names) if tandem else 1), spring)


class BearingSet(_Preloaded):
    """Ball rows preloaded together; `sprung_bearings` names those whose rings slide on the spring."""

    bearings: Annotated[list[str], Field(min_length=1), Once]
    sprung_bearings: Annotated[list[str], Once] = Field(default_factory=list)

    @model_validator(mode="after")
    def _spring_of_the_set(self) -> BearingSet:
        for key in ("sprung_bearings", "preload_rate_N_per_m", "sprung_ring_mass_g"):
            if getattr(self, key) and self.preload_kind == "rigid":
                raise ValueError(f"{key} is for a set with preload_kind = spring, which this is not")
        for name in self.sprung_bearings:
            if name not in self.bearings:
                raise ValueError(f"sprung_bearings: {name!r} is not in the set; allowed are {', '.join(self.bearings)}")
        if len(self.sprung_bearings) > 1 and self.preload_rate_N_per_m is not None and self.sprung_ring_mass_g is None:
            raise ValueError("sprung_ring_mass_g is missing: rings that slide together on a spring need the mass with which they do")
        return self

    def set(self, name: str) -> m.BearingSet:
        """A set whose spring names no rings is loaded from outside."""
        spring = self._spring(self.sprung_bearings) if self.sprung_bearings else None
        return m.BearingSet(name, tuple(self.bearings), self.preload_N, spring)


def check_sets(rows: Mapping[str, Bearing], pair: BearingPair | None, sets: Mapping[str, BearingSet]) -> None:
    """ValueError unless every ball row is in one set, told as a `bearing_pair` or among `sets`, and each set can carry its preload."""
    if pair is not None and sets:
        raise ValueError("bearing_pair: stands beside sets; a bearing_pair is short for the only set, so it is one or the other")
    if pair is not None:
        if len(rows) != 2:
            raise ValueError(f"bearing_pair: is for two ball rows, and here are {len(rows)}; sets take any number")
        for name, bearing in rows.items():
            if bearing.sense is not None:
                raise ValueError(f"bearings.{name}.sense: the arrangement of bearing_pair says it already")
        if pair.sprung_bearing is not None and pair.sprung_bearing not in rows:
            raise ValueError(f"bearing_pair.sprung_bearing = {pair.sprung_bearing!r}: allowed are {', '.join(rows)}")
        return
    for name, own in sets.items():
        for bearing_name in own.bearings:
            if bearing_name not in rows:
                raise ValueError(f"sets.{name}.bearings: {bearing_name!r} is no ball row; allowed are {', '.join(rows)}")
        senses = {rows[n].sense for n in own.bearings}
        if len(senses) == 1 and own.preload_kind == "rigid":
            raise ValueError(f"sets.{name}.preload_kind = 'rigid': all its rows are loaded the same way and cannot preload each other; it must be spring")
        if len(senses) == 2 and own.preload_kind == "spring" and not own.sprung_bearings:
            raise ValueError(f"sets.{name}.sprung_bearings is missing: which of its rows have their rings on the spring")
        if len({rows[n].sense for n in own.sprung_bearings}) > 1:
            raise ValueError(f"sets.{name}.sprung_bearings: are loaded both ways; rings that slide together are loaded one way")
    for name, bearing in rows.items():
        if bearing.sense is None:
            raise ValueError(f"bearings.{name}.sense is missing: +z or -z, the direction in which moving its outer ring loads it")
        held = [key for key, own in sets.items() if name in own.bearings]
        if len(held) != 1:
            where = f"is in {len(held)} sets ({', '.join(held)})" if held else "is in no set"
            raise ValueError(f"bearings.{name}: {where}; every ball row is in one, alone if nothing else is mounted against it")
