"""A modal peak of a test, wherever it is from: what a log of a run keeps of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Peak:
    """A modal peak; `mode` counts the model's modes at the first temperature, 0 if none of them is the same."""

    source: str  # computed, identified, or the folder of a measured campaign
    test: str
    temperature: float  # C
    mode: int
    kind: str
    frequency: float  # Hz
    frequency_sd: float = np.nan  # Hz
    damping_ratio: float = np.nan
