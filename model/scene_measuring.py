"""The form of a scene file: measuring points and the hammer test."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from model import machine as m
from model.file_table import MM, Finite, NotNegative, Positive, Radii, Share, Table


def _along_axis(text: str) -> str:
    if len(text) != 2 or text[0] not in "+-" or text[1] not in "XYZ":
        raise ValueError("must be one of +X -X +Y -Y +Z -Z")
    return text


class Point(Table):
    node: Annotated[int, Field(ge=1)]
    name: Annotated[str, Field(min_length=1, max_length=10)]  # UFF 58 entity names hold ten characters
    body: str
    position_mm: tuple[Finite, Finite, Finite]
    direction: Annotated[str, AfterValidator(_along_axis)]

    def point(self) -> m.Point:
        x, y, z = (v * MM for v in self.position_mm)
        return m.Point(self.node, self.name, self.body, (x, y, z), axis_vector(self.direction))


def axis_vector(direction: str) -> tuple[float, float, float]:
    """Unit vector of a signed axis like '+Z'."""
    x, y, z = ((1.0 if direction[0] == "+" else -1.0) if axis == direction[1] else 0.0 for axis in "XYZ")
    return x, y, z


class Measuring(Table):
    points: list[Point] = Field(min_length=1)


class HammerTest(Table):
    hammer_nodes: list[int] = Field(min_length=1)
    tip_stiffness_N_per_m: Positive
    hammer_mass_g: Positive
    level_N: Positive
    level_scatter: Share
    hits: Annotated[int, Field(ge=1)]
    double_hit_probability: Annotated[float, Field(ge=0, le=1)]
    sample_rate_Hz: Positive
    record_length_s: Positive
    exponential_end: Annotated[float, Field(gt=0, le=1)]
    band_Hz: Radii
    noise_of_value: NotNegative
    noise_of_largest: NotNegative
    step_us: Positive

    @model_validator(mode="after")
    def _sampling_carries_the_band(self) -> HammerTest:
        if self.band_Hz[1] > 0.4 * self.sample_rate_Hz:
            raise ValueError("sample_rate_Hz must be at least 2.5 times the upper end of band_Hz, for the anti-alias filter")
        return self

    def test(self) -> m.HammerTest:
        return m.HammerTest(
            tuple(self.hammer_nodes),
            self.tip_stiffness_N_per_m,
            self.hammer_mass_g * 1e-3,
            self.level_N,
            self.level_scatter,
            self.hits,
            self.double_hit_probability,
            self.sample_rate_Hz,
            self.record_length_s,
            self.exponential_end,
            self.band_Hz,
            self.noise_of_value,
            self.noise_of_largest,
            self.step_us * 1e-6,
        )
