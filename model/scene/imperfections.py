"""The form of a scene file: unbalance, waves of races and balls, ball sizes and cage unbalance of the running spindle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from thermospindle.model.built import imperfections as i
from thermospindle.model.scene.fields import Finite, NotNegative, Table
from thermospindle.model.units import DEGREE, MM, NM


class Waves(Table):
    """Waves of a race, column by column, or its measured profile at equal steps of azimuth."""

    order: list[Annotated[int, Field(ge=1, le=100_000)]] = Field(default_factory=list)
    amplitude_nm: list[NotNegative] = Field(default_factory=list)
    phase_deg: list[Finite] = Field(default_factory=list)
    profile_nm: list[Finite] = Field(default_factory=list)
    highest_order: Annotated[int, Field(ge=1, le=100_000)] | None = None

    @model_validator(mode="after")
    def _one_form(self) -> Waves:
        if bool(self.profile_nm) != (self.highest_order is not None) or (self.profile_nm and self.order):
            raise ValueError("a race has either order, amplitude_nm and phase_deg, or profile_nm and highest_order")
        if self.highest_order and 2 * self.highest_order >= len(self.profile_nm):
            raise ValueError(f"highest_order = {self.highest_order}: must be below half of the {len(self.profile_nm)} values of profile_nm")
        if not len(self.order) == len(self.amplitude_nm) == len(self.phase_deg) == len(set(self.order)):
            raise ValueError("order, amplitude_nm and phase_deg must have one entry each for every order, which stands once")
        return self

    def waves(self) -> tuple[i.Wave, ...]:
        if self.highest_order:
            return i.waves(NM * np.array(self.profile_nm), self.highest_order)
        return tuple(map(_wave, self.order, self.amplitude_nm, self.phase_deg))


class BallWave(Table):
    """A wave of one order on every ball."""

    order: Annotated[int, Field(ge=1, le=100_000)]
    amplitude_nm: list[NotNegative]
    phase_deg: list[Finite]


def _wave(order: int, amplitude_nm: float, phase_deg: float) -> i.Wave:
    return i.Wave(order, amplitude_nm * NM, phase_deg * DEGREE)


class RowImperfections(Table):
    inner_radial: Waves | None = None
    inner_axial: Waves | None = None
    outer_radial: Waves | None = None
    outer_axial: Waves | None = None
    ball_diameter_nm: list[Finite] = Field(default_factory=list)
    ball_waves: list[BallWave] = Field(default_factory=list)
    cage_unbalance_g_mm: NotNegative = 0.0
    cage_phase_deg: Finite = 0.0

    def check(self, balls: int, rollers: bool = False) -> None:
        """Raises ValueError for a list that does not hold one value for every ball, or roller of
        all rows, and for what rollers do not feel."""
        if rollers and (self.inner_axial or self.outer_axial):
            raise ValueError(f"{'inner' if self.inner_axial else 'outer'}_axial: cylindrical rollers do not feel it; allowed are inner_radial and outer_radial")
        for key, values in (
            ("ball_diameter_nm", self.ball_diameter_nm),
            *((f"ball_waves.{n}.{key}", getattr(w, key)) for n, w in enumerate(self.ball_waves, 1) for key in ("amplitude_nm", "phase_deg")),
        ):
            if len(values) != balls and (values or key != "ball_diameter_nm"):
                raise ValueError(f"{key}: has {len(values)} values; allowed is one for each of the {balls} {'rollers, row by row' if rollers else 'balls'}")

    def row(self, balls: int) -> i.RowImperfections:
        races = [w.waves() if w else () for w in (self.inner_radial, self.inner_axial, self.outer_radial, self.outer_axial)]
        of_ball = [tuple(_wave(w.order, w.amplitude_nm[j], w.phase_deg[j]) for w in self.ball_waves) for j in range(balls)]
        return i.RowImperfections(
            inner_radial=races[0],
            inner_axial=races[1],
            outer_radial=races[2],
            outer_axial=races[3],
            ball_diameter=tuple(d * NM for d in self.ball_diameter_nm),
            ball_waves=tuple(of_ball) if self.ball_waves else (),
            cage_unbalance=self.cage_unbalance_g_mm * 1e-6,
            cage_phase=self.cage_phase_deg * DEGREE,
        )


class Imperfections(Table):
    """Numbers, or `seed` and `grade` alone for a plausible draw."""

    seed: Annotated[int, Field(ge=0, le=10**18)] | None = None
    grade: Literal["high precision", "precision", "ordinary"] | None = None
    unbalance_g_mm: NotNegative = 0.0
    unbalance_z_mm: Finite = 0.0
    unbalance_body: str | None = None
    unbalance_phase_deg: Finite = 0.0
    couple_unbalance_g_mm2: NotNegative = 0.0
    couple_phase_deg: Finite = 0.0
    bearings: dict[str, RowImperfections] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _drawn_or_given(self) -> Imperfections:
        others = sorted(self.model_fields_set - {"seed", "grade", "origin", "source", "origins"})
        if (self.seed is None) != (self.grade is None) or (self.seed is not None and others):
            raise ValueError(f"seed and grade stand together and alone; beside them: {', '.join(others) or 'nothing, but one is missing'}")
        return self

    def imperfections(self, balls: Mapping[str, int]) -> i.Imperfections:
        return i.Imperfections(
            unbalance=self.unbalance_g_mm * 1e-6,
            unbalance_z=self.unbalance_z_mm * MM,
            unbalance_phase=self.unbalance_phase_deg * DEGREE,
            couple_unbalance=self.couple_unbalance_g_mm2 * 1e-9,
            couple_phase=self.couple_phase_deg * DEGREE,
            bearings={name: row.row(balls[name]) for name, row in self.bearings.items()},
            unbalance_body=self.unbalance_body or "",
        )
