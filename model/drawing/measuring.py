"""How a spindle is measured: points, the virtual hammer test, and how far what is built and measured may be off."""

from __future__ import annotations

from dataclasses import dataclass

FAINTEST = 1e-6  # N, peak force of a hammer: squares of far fainter ones are no numbers any more


@dataclass(frozen=True)
class Point:
    """A measuring point; `direction` is a unit vector along an axis. `mass` (kg) is that of a sensor on it that the model
    is to carry, and `listens` whether there is a sensor at all, and it is not only struck. `channel` and `hammer` number
    the sensors and the hammer points of all tests of a campaign, from 1; 0 where its place among those of its spindle does."""

    node: int
    name: str
    body: str
    position: tuple[float, float, float]
    direction: tuple[float, float, float]
    mass: float = 0.0
    listens: bool = True
    channel: int = 0
    hammer: int = 0

    @property
    def axis(self) -> str:
        """Its direction as +X, -Y ..."""
        along = max(range(3), key=lambda i: abs(self.direction[i]))
        return ("+" if self.direction[along] > 0 else "-") + "XYZ"[along]


@dataclass(frozen=True)
class HammerTest:
    """The virtual impact test: hammer, vibrometer, acquisition and windows."""

    hammer_nodes: tuple[int, ...]
    tip_stiffness: float  # N/m
    hammer_mass: float  # kg
    level: float  # N, peak force
    level_scatter: float  # relative, hit to hit
    hits: int
    double_hit_probability: float
    sample_rate: float  # Hz
    record_length: float  # s
    exponential_end: float  # value of the exponential window at the end of the record; 1 is no window
    band: tuple[float, float]  # Hz
    noise_of_value: float  # relative FRF noise per line
    noise_of_largest: float  # of the largest response to that hammer
    step: float  # s, integration step


@dataclass(frozen=True)
class Tolerances:
    """One standard deviation of every build and measuring uncertainty, relative unless said."""

    structure: float
    hub: float
    preload: float
    damping: float
    temperature: float  # K
    gain: float
