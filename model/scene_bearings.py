"""The form of a scene file: ball rows, bearings and how the pair is preloaded."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from model import machine as m
from model.file_table import MM, Finite, Positive, Share, Span, Table


class BallRow(Table):
    balls: Annotated[int, Field(ge=3)]
    ball_diameter_mm: Positive
    pitch_diameter_mm: Positive
    contact_angle_deg: Annotated[float, Field(gt=0, lt=90)]
    inner_conformity: Annotated[float, Field(gt=0.5, lt=1)]
    outer_conformity: Annotated[float, Field(gt=0.5, lt=1)]
    diametral_clearance_mm: Span
    ball_material: str
    ring_material: str
    damping_ratio: Share

    @model_validator(mode="after")
    def _balls_fit(self) -> BallRow:
        if self.balls * self.ball_diameter_mm > np.pi * self.pitch_diameter_mm:
            raise ValueError(
                "that many balls do not fit on the pitch circle; balls * ball_diameter_mm must be below pi * pitch_diameter_mm"
            )
        return self


class Bearing(Table):
    row: str
    z_mm: Finite
    inner_ring: str
    outer_ring: str

    def bearing(self, name: str, rows: dict[str, BallRow]) -> m.Bearing:
        row = rows[self.row]
        low, high = row.diametral_clearance_mm
        return m.Bearing(
            name,
            self.z_mm * MM,
            self.inner_ring,
            self.outer_ring,
            row.balls,
            row.ball_diameter_mm * MM,
            row.pitch_diameter_mm * MM,
            float(np.radians(row.contact_angle_deg)),
            row.inner_conformity,
            row.outer_conformity,
            (low * MM, high * MM),
            row.ball_material,
            row.ring_material,
            row.damping_ratio,
        )


Arrangement = Literal["back-to-back", "face-to-face", "tandem"]


class BearingPair(Table):
    arrangement: Arrangement
    preload_N: Positive
    preload_kind: Literal["rigid", "spring"]
    turning_ring: Literal["inner", "outer"]
    stiffness_arrangement: Arrangement | None = None
    ball_inertia: Annotated[float, Field(ge=0, le=1)] = 0.0

    @model_validator(mode="after")
    def _tandem_needs_a_spring(self) -> BearingPair:
        if self.arrangement == "tandem" and self.preload_kind == "rigid":
            raise ValueError("a tandem pair cannot preload itself; preload_kind must be spring")
        return self

    def pair(self) -> m.Pair:
        stiffness_arrangement = self.stiffness_arrangement or self.arrangement
        return m.Pair(self.arrangement, self.preload_N, self.preload_kind, stiffness_arrangement, self.turning_ring, self.ball_inertia)
