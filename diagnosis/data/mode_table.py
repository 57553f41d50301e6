"""A table of modes of a test as the inference takes it: ln frequencies and ln damping ratios with their standard errors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.model.machine import Condition
from thermospindle.model.types import Array
from thermospindle.sim.campaign.campaign import Test


@dataclass(frozen=True, eq=False)
class ModeData:
    """Modes of one test in order of frequency (m,) Hz; `damping` is NaN and its error infinite where it was not measured."""

    test: Test
    condition: Condition
    frequency: Array
    frequency_sd: Array  # of ln frequency
    damping: Array
    damping_sd: Array  # of ln damping
    kind: tuple[str, ...]

    @property
    def count(self) -> int:
        return len(self.frequency) + int(np.isfinite(self.damping_sd).sum())


TestData = LineData | ModeData
"""What one test is to the inference."""


def mode_data(test: Test, condition: Condition) -> ModeData:
    rows = sorted(test.modes, key=lambda r: r.frequency)
    frequency = np.array([r.frequency for r in rows])
    damping = np.array([np.nan if r.damping_ratio is None else r.damping_ratio for r in rows])
    error = np.array([np.inf if r.damping_ratio_sd is None or not r.damping_ratio else r.damping_ratio_sd / r.damping_ratio for r in rows])
    return ModeData(
        test, condition, frequency, np.array([r.frequency_sd for r in rows]) / frequency, damping, error, tuple(r.kind for r in rows)
    )
