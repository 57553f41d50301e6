"""The form of a scene file: ball rows, bearings and how the pair is preloaded."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from thermospindle.model import machine as m
from thermospindle.model.scene.fields import Place, Positive, Share, Span, Table
from thermospindle.model.units import DEGREE, MM


class BallRow(Table):
    balls: Annotated[int, Field(ge=3, le=1000)]
    ball_diameter_mm: Annotated[float, Field(ge=1e-3, le=1e3)]
    pitch_diameter_mm: Annotated[float, Field(ge=1e-2, le=1e4)]
    contact_angle_deg: Annotated[float, Field(gt=0, lt=90)] | None = None
    inner_conformity: Annotated[float, Field(gt=0.5, lt=1)]
    outer_conformity: Annotated[float, Field(gt=0.5, lt=1)]
    diametral_clearance_mm: Span | None = None
    free_contact_angle_deg: Annotated[float, Field(gt=0, lt=90)] | None = None
    ball_material: str
    ring_material: str
    damping_ratio: Share

    @model_validator(mode="after")
    def _balls_fit(self) -> BallRow:
        if self.balls * self.ball_diameter_mm > np.pi * self.pitch_diameter_mm:
            raise ValueError(
                "that many balls do not fit on the pitch circle; balls * ball_diameter_mm must be below pi * pitch_diameter_mm"
            )
        if (self.contact_angle_deg is None) == (self.free_contact_angle_deg is None):
            raise ValueError("a ball row has either contact_angle_deg, under the preload, or free_contact_angle_deg, without load")
        return self


class Bearing(Table):
    row: str
    z_mm: Place
    inner_ring: str
    outer_ring: str
    raceway_width_mm: Positive | None = None

    def bearing(self, name: str, rows: dict[str, BallRow], sense: int) -> m.Bearing:
        """The bearing; one told by its free contact angle has it still as its loaded one, which `reading.build` mends."""
        row = rows[self.row]
        angle = row.contact_angle_deg if row.contact_angle_deg is not None else row.free_contact_angle_deg
        clearance = row.diametral_clearance_mm
        assert angle is not None
        return m.Bearing(
            name=name,
            z=self.z_mm * MM,
            inner_ring=self.inner_ring,
            outer_ring=self.outer_ring,
            balls=row.balls,
            ball_diameter=row.ball_diameter_mm * MM,
            pitch_diameter=row.pitch_diameter_mm * MM,
            contact_angle=angle * DEGREE,
            inner_conformity=row.inner_conformity,
            outer_conformity=row.outer_conformity,
            clearance=None if clearance is None else (clearance[0] * MM, clearance[1] * MM),
            ball_material=row.ball_material,
            ring_material=row.ring_material,
            damping_ratio=row.damping_ratio,
            sense=sense,
            raceway_width=None if self.raceway_width_mm is None else self.raceway_width_mm * MM,
        )


class BearingPair(Table):
    arrangement: Literal["back-to-back", "face-to-face", "tandem"]
    preload_N: Annotated[float, Field(gt=0, le=1e7)]
    preload_kind: Literal["rigid", "spring"]
    turning_ring: Literal["inner", "outer"]
    ball_inertia: Annotated[float, Field(ge=0, le=1)] = 0.0
    sprung_bearing: str | None = None
    preload_rate_N_per_m: Positive | None = None
    sprung_ring_mass_g: Positive | None = None

    @model_validator(mode="after")
    def _tandem_needs_a_spring(self) -> BearingPair:
        if self.arrangement == "tandem" and self.preload_kind == "rigid":
            raise ValueError("a tandem pair cannot preload itself; preload_kind must be spring")
        for key in ("sprung_bearing", "preload_rate_N_per_m", "sprung_ring_mass_g"):
            if getattr(self, key) is not None and (self.preload_kind == "rigid" or self.arrangement == "tandem"):
                raise ValueError(f"{key} is for a pair with preload_kind = spring whose rings load each other, which this is not")
        if self.sprung_ring_mass_g is not None and self.preload_rate_N_per_m is None:
            raise ValueError("sprung_ring_mass_g needs preload_rate_N_per_m, the spring on which the ring moves")
        return self

    def pair(self, names: Sequence[str]) -> m.Pair:
        """`names` are the bearings', the lowest first; the upper one is sprung unless the file says another."""
        spring = None
        if self.preload_kind == "spring" and self.arrangement != "tandem":
            mass = (self.sprung_ring_mass_g or 0.0) * 1e-3
            spring = m.PreloadSpring(ring_of=self.sprung_bearing or names[-1], rate=self.preload_rate_N_per_m, mass=mass)
        return m.Pair(preload=self.preload_N, turning_ring=self.turning_ring, ball_inertia=self.ball_inertia, spring=spring)
