"""A table of modes of a test as the inference takes it: ln frequencies, ln damping ratios and shapes with their standard errors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.model.machine import Condition
from thermospindle.model.types import Array, ComplexArray, Integers
from thermospindle.sim.campaign.campaign import Test


@dataclass(frozen=True, eq=False)
class ModeData:
    """Modes of one test in order of frequency (m,) Hz; `damping` is NaN and its error infinite
    where it was not measured; shapes are told at the test's `shape_nodes`."""

    test: Test
    condition: Condition
    frequency: Array
    frequency_sd: Array  # of ln frequency
    damping: Array
    damping_sd: Array  # of ln damping
    kind: tuple[str, ...]
    shape: ComplexArray | None = None  # (m, n)
    shape_sd: Array | None = None  # (m, n), of either part

    @property
    def count(self) -> int:
        """Of numbers that are told."""
        return len(self.frequency) + int(np.isfinite(self.damping_sd).sum()) + sum(own.count for own in self.shapes)

    @cached_property
    def shapes(self) -> tuple[MeasuredShape, ...]:
        """The shape of every mode; none of a table that tells none."""
        return () if self.shape is None or self.shape_sd is None else tuple(MeasuredShape(*row) for row in zip(self.shape, self.shape_sd, strict=True))

    def only(self, kept: Integers) -> ModeData:
        """The same with some of its modes."""
        shape = None if self.shape is None else self.shape[kept]
        shape_sd = None if self.shape_sd is None else self.shape_sd[kept]
        frequency, frequency_sd, damping, damping_sd = (column[kept] for column in (self.frequency, self.frequency_sd, self.damping, self.damping_sd))
        return ModeData(
            self.test, self.condition, frequency, frequency_sd, damping, damping_sd, tuple(self.kind[i] for i in kept.tolist()), shape, shape_sd
        )


@dataclass(frozen=True, eq=False)
class MeasuredShape:
    """A measured shape `value` (n,) with standard errors `sd` (n,) of either part."""

    value: ComplexArray
    sd: Array

    @property
    def real(self) -> bool:
        """Whether real parts alone are told: nothing was said of phases then."""
        return not self.value.imag.any()

    @property
    def count(self) -> int:
        """Of numbers that it tells: of n points one less, for its size and phase tell nothing, times its parts."""
        return (len(self.value) - 1) * (1 if self.real else 2)

    @property
    def size(self) -> float:
        """Its length in standard errors."""
        return float(np.linalg.norm(self.value / self.sd))

    @cached_property
    def along(self) -> ComplexArray:
        """Its direction (n,), in standard errors."""
        return self.value / self.sd / self.size

    @cached_property
    def across(self) -> ComplexArray:
        """Orthonormal directions (n, n - 1) across it, in standard errors; real where it is."""
        own = self.along.real if self.real else self.along
        return np.linalg.svd(own[:, None])[0][:, 1:]


TestData = LineData | ModeData
"""What one test is to the inference."""


def mode_data(test: Test, condition: Condition, gain: float) -> ModeData:
    """A test's table of modes; `gain` (relative) by which the sensors of shapes may be off beyond the errors that are told."""
    rows = sorted(test.modes, key=lambda r: r.frequency)
    frequency = np.array([r.frequency for r in rows])
    damping = np.array([np.nan if r.damping_ratio is None else r.damping_ratio for r in rows])
    error = np.array([np.inf if r.damping_ratio_sd is None or not r.damping_ratio else r.damping_ratio_sd / r.damping_ratio for r in rows])
    found = ModeData(
        test, condition, frequency, np.array([r.frequency_sd for r in rows]) / frequency, damping, error, tuple(r.kind for r in rows)
    )
    if not test.shape_nodes:
        return found
    shape = np.array([[at.value for at in r.shape] for r in rows])
    return replace(found, shape=shape, shape_sd=np.hypot([[at.sd for at in r.shape] for r in rows], gain * np.abs(shape)))
