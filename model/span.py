"""The temperatures at which a spindle can be computed: where every law that it is asked for reaches."""

from __future__ import annotations

from thermospindle.model.machine import Spindle
from thermospindle.model.material import Entries

ABSOLUTE_ZERO = -273.15  # C


def temperature_range(spindle: Spindle, lubricant: bool = True) -> tuple[float, float]:
    """Lowest and highest temperature (C) that every law of the spindle's materials reaches, (-273.15, inf) where all are constant.

    The laws are Young's modulus and thermal expansion of the materials that regions, balls and rings are made of, Young's modulus of
    those of shafts and joints, and the lubricant's viscosity, which friction and films ask for; `lubricant` False leaves that out. A
    finite difference must stay inside: one-sided at either end. Empty (low > high) where two laws have no temperature in common.
    """
    laws: list[Entries] = [law for name in spindle.used_materials for law in (spindle.materials[name].youngs_modulus, spindle.materials[name].thermal_expansion)]
    laws += [spindle.materials[segment.material].youngs_modulus for shaft in spindle.structure.shafts for segment in shaft.segments]
    laws += [spindle.materials[joint.material].youngs_modulus for joint in spindle.structure.joints if joint.material]
    laws += [spindle.thermal.friction.viscosity] if lubricant else []
    spans = [_span(law) for law in laws]
    return max(low for low, _ in spans), min(high for _, high in spans)


def inside(temperature: float, reach: float, spindle: Spindle) -> tuple[float, float]:
    """Two temperatures (C) `reach` apart for a finite difference about `temperature`: central, or one-sided where a law ends.

    The lubricant's law is left out: an end of it nearer than `reach` matters to no stiffness.
    """
    low, high = temperature_range(spindle, lubricant=False)
    start = min(max(temperature - reach / 2, low), high - reach)
    return max(start, low), min(start + reach, high)


def _span(law: Entries) -> tuple[float, float]:
    return (ABSOLUTE_ZERO, float("inf")) if len(law.value) == 1 else (law.temperature[0], law.temperature[-1])
