"""The form of a scene file: measuring points and the hammer test."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from thermospindle.model.drawing import measuring as m
from thermospindle.model.scene.fields import Band, NotNegative, Once, OneLine, Position, Positive, Share, Table
from thermospindle.model.units import MM


def _along_axis(text: str) -> str:
    if len(text) != 2 or text[0] not in "+-" or text[1] not in "XYZ":
        raise ValueError("must be one of +X -X +Y -Y +Z -Z")
    return text


class Point(Table):
    node: Annotated[int, Field(ge=1, le=999_999_999)]  # ten columns of UFF 58
    name: Annotated[str, Field(min_length=1, max_length=10), OneLine]  # UFF 58 entity names hold ten characters
    body: str
    position_mm: Position
    direction: Annotated[str, AfterValidator(_along_axis)]
    sensor_mass_g: NotNegative = 0.0

    def point(self) -> m.Point:
        x, y, z = (v * MM for v in self.position_mm)
        return m.Point(self.node, self.name, self.body, (x, y, z), axis_vector(self.direction), self.sensor_mass_g * 1e-3)


def axis_vector(direction: str) -> tuple[float, float, float]:
    """Unit vector of a signed axis like '+Z'."""
    x, y, z = ((1.0 if direction[0] == "+" else -1.0) if axis == direction[1] else 0.0 for axis in "XYZ")
    return x, y, z


FEWEST_LINES, MOST_STEPS = 50, 1e8  # of an FRF, and of a record


class Measuring(Table):
    """Without points they are assumed: at both ends of what turns, on the axis (`assumed_points`)."""

    points: list[Point] = Field(default_factory=list)


def assumed_points(body: str, ends: tuple[float, float], moves: Sequence[str]) -> list[Point]:
    """Points on the axis at both `ends` (mm) of a body or shaft, along x and y, and along z at the upper one, as far as it `moves` there."""
    low, high = ends
    wanted = [("top_x", high, "x"), ("top_y", high, "y"), ("top_z", high, "z")]
    wanted += [("low_x", low, "x"), ("low_y", low, "y")] if low < high else []
    told = [(name, z, move) for name, z, move in wanted if move in moves]
    return [
        Point(node=k, name=name, body=body, position_mm=(0.0, 0.0, z), direction=f"+{move.upper()}") for k, (name, z, move) in enumerate(told, 1)
    ]


class HammerTest(Table):
    """Every key has an assumed default: a miniature hammer on the first point, a light tap (0.14
    ms, more than a sample), a quiet laser vibrometer up to 3 kHz.

    Without `step_us` the program chooses the integration step (`reading.chosen_step`).
    """

    hammer_nodes: Annotated[list[int], Once, Field(min_length=1)] | None = None
    tip_stiffness_N_per_m: Positive = 1.0e6
    hammer_mass_g: Positive = 2.0
    level_N: Annotated[float, Field(ge=m.FAINTEST, le=1e6)] = 1.0
    level_scatter: Share = 0.10
    hits: Annotated[int, Field(ge=1, le=1000)] = 2
    double_hit_probability: Annotated[float, Field(ge=0, le=1)] = 0.0
    sample_rate_Hz: Annotated[float, Field(gt=0, le=1e9)] = 10000.0
    record_length_s: Annotated[float, Field(gt=0, le=1e3)] = 0.30
    exponential_end: Annotated[float, Field(ge=1e-9, le=1)] = 1.0
    band_Hz: Band = (400.0, 3000.0)
    noise_of_value: NotNegative = 0.004
    noise_of_largest: NotNegative = 0.0002
    step_us: Positive | None = None

    @model_validator(mode="after")
    def _sampling_carries_the_band(self) -> HammerTest:
        if self.band_Hz[0] == 0.0:
            raise ValueError("band_Hz must begin above 0 Hz, where what nothing holds has no answer")
        if self.band_Hz[1] > 0.4 * self.sample_rate_Hz:
            raise ValueError("sample_rate_Hz must be at least 2.5 times the upper end of band_Hz, for the anti-alias filter")
        lines = self.record_length_s * (self.band_Hz[1] - self.band_Hz[0])
        if lines < FEWEST_LINES:
            raise ValueError(
                f"band_Hz has {lines:.3g} lines, each 1 / record_length_s wide; modes need {FEWEST_LINES} at least, so a longer record or a "
                "wider band"
            )
        interval = 1e6 / self.sample_rate_Hz
        steps = 1e6 * self.record_length_s / (self.step_us or interval)
        if steps > MOST_STEPS:
            raise ValueError(f"record_length_s over step_us is {steps:.3g} steps of integration; {MOST_STEPS:g} can be computed")
        every = None if self.step_us is None else interval / self.step_us
        if every is not None and (round(every) < 1 or abs(every / round(every) - 1) > 1e-6):
            raise ValueError(
                f"step_us = {self.step_us:g} must divide the sampling interval of {interval:g} us into whole steps; "
                "without it the program chooses one"
            )
        return self

    def test(self, nodes: Sequence[int]) -> m.HammerTest:
        """`nodes` are those of the measuring points; the hammer hits the first where the file does not say. The step is still a whole
        sampling interval where the program is to choose it."""
        return m.HammerTest(
            hammer_nodes=tuple(self.hammer_nodes or nodes[:1]),
            tip_stiffness=self.tip_stiffness_N_per_m,
            hammer_mass=self.hammer_mass_g * 1e-3,
            level=self.level_N,
            level_scatter=self.level_scatter,
            hits=self.hits,
            double_hit_probability=self.double_hit_probability,
            sample_rate=self.sample_rate_Hz,
            record_length=self.record_length_s,
            exponential_end=self.exponential_end,
            band=self.band_Hz,
            noise_of_value=self.noise_of_value,
            noise_of_largest=self.noise_of_largest,
            step=(self.step_us or 1e6 / self.sample_rate_Hz) * 1e-6,
        )
