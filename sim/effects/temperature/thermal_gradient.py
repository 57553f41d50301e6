"""The running bearings heat themselves: their friction leaves shaft and inner rings hotter than the hub.

Palmgren's torque at the lubricant's own temperature makes the heat, steady conduction spreads it. The heat equation is linear,
so the rise of every region for 1 W in each bearing is solved once for a spindle and kept.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import scipy

from thermospindle.model.bearing.row import relative_speed
from thermospindle.model.drawing.heating import Friction
from thermospindle.model.errors import OutsideRange
from thermospindle.model.machine import Bearing, Condition, RollerBearing, Spindle
from thermospindle.model.types import Array
from thermospindle.sim.effects.effect import RINGS, Effect, Parameter, Values, scale_parameter
from thermospindle.thermal import friction


@dataclass(frozen=True)
class Conduction:
    """A spindle as its conduction sees it: equal `key`, equal temperature rise for 1 W."""

    key: tuple
    spindle: Spindle = field(compare=False, repr=False)


@dataclass(frozen=True, eq=False)
class UnitRise:
    """Steady rise (K) for 1 W of friction in each bearing: of every region, and of the bearings themselves."""

    regions: tuple[str, ...]
    region: Array  # (bearings, regions)
    bearing: Array  # (bearings, bearings), symmetric


def temperatures(spindle: Spindle, condition: Condition, values: Values, by_region: dict[str, float]) -> dict[str, float]:
    scale = values["scale"]
    if scale == 0.0 or condition.speed == 0.0:
        return by_region
    unit = unit_rise(spindle)
    rise = heat(spindle, condition, unit) @ unit.region
    outer = [unit.regions.index(b.outer_ring) for b in spindle.ringed]
    rise = rise - (1 - values["common_share"]) * rise[outer].mean()
    if values["level_share"]:
        rise = rise + values["level_share"] * (levelled(spindle, unit.regions, rise) - rise)
    return by_region | {name: by_region[name] + scale * float(dt) for name, dt in zip(unit.regions, rise, strict=True)}


def levelled(spindle: Spindle, regions: tuple[str, ...], rise: Array) -> Array:
    """The `rise` (regions,) if each part were at one temperature, the mean of the bearing rings in it; a part without rings as it is."""
    part = np.array([spindle.region(name).part for name in regions])
    rings = [regions.index(name) for b in spindle.ringed for name in (b.inner_ring, b.outer_ring)]
    level = rise.copy()
    for p in set(part[rings]):
        level[part == p] = rise[[r for r in rings if part[r] == p]].mean()
    return level


def heat(spindle: Spindle, condition: Condition, unit: UnitRise) -> Array:
    """Friction heat (bearings,) in W where every lubricant has the temperature that all of it
    makes. OutsideRange where that is beyond its viscosity's law."""
    loads = friction.loads(spindle)
    bearings = tuple((b, relative_speed(spindle, b, condition.speed), loads[b.name]) for b in spindle.ringed)
    return _heat(spindle.thermal.friction, bearings, condition.temperature, unit)


@lru_cache(maxsize=256)
def _heat(law: Friction, bearings: tuple[tuple[Bearing | RollerBearing, float, float], ...], temperature: float, unit: UnitRise) -> Array:
    """Of bearings with the speed of their rings and their load, where all is at one temperature but
    for their own heat; read only. Spindles that differ in their structure ask for the same."""
    every, speeds, _ = zip(*bearings, strict=True)
    by_name, cold = {b.name: load for b, _, load in bearings}, np.full(len(bearings), temperature)
    low, high = law.viscosity.temperature[0], law.viscosity.temperature[-1]
    try:
        found = friction.balanced(law, every, speeds, by_name, cold, unit.bearing)
        found.flags.writeable = False
        return found
    except OutsideRange:
        end = high if temperature >= low else low
        at_end = [friction.heat(law, b, speed, end, load) for b, speed, load in bearings]
        warm = (cold + np.array(at_end) @ unit.bearing).max()
        raise OutsideRange(f"bearing friction brings the lubricant to {warm:.0f} C, and its viscosity is given from {low:g} to {high:g} C") from None


def unit_rise(spindle: Spindle) -> UnitRise:
    """Solved once for each section, set of conductivities and cooling."""
    from thermospindle.thermal.influence import every_race

    conductivity = tuple(spindle.materials[g.material].conductivity for g in spindle.regions)
    rings = tuple(every_race(spindle).values())
    thermal = spindle.thermal
    key = (tuple(g.outline for g in spindle.regions), conductivity, rings, thermal.convections, thermal.gaps, thermal.friction.conductance)
    return _unit_rise(Conduction(key, spindle))


@lru_cache(maxsize=8)
def _unit_rise(question: Conduction) -> UnitRise:
    from thermospindle.thermal import conduction
    from thermospindle.thermal.influence import influence  # finite elements, which the catalogue is read without

    model = conduction.model(question.spindle, influence(question.spindle).sections)
    if not model.cooled.any():
        raise ValueError("a spindle without convection has no steady temperature")
    rise = scipy.sparse.linalg.splu(scipy.sparse.csc_array(model.conductance), permc_spec="MMD_AT_PLUS_A").solve(np.ascontiguousarray(model.bearing.T)).T
    means = [model.field(r).region_means() for r in rise]
    regions = tuple(means[0])
    return UnitRise(regions, np.array([[m[name] for name in regions] for m in means]), rise @ model.bearing.T)


EFFECT = Effect(
    name="thermal_gradient",
    title="Bearing friction heats the running spindle, the shaft and inner rings most",
    equation=(
        "T_region = T + scale ((1 - level_share) D_region + level_share mean D_rings of its part), "
        "D = R - (1 - common_share) mean R_outer rings, R = sum_b G_region,b H_b with "
        "K G = (1 W in bearing b), K the steady conduction and convection matrix; "
        "H_b = (M0 + M1) speed at the lubricant's temperature T + sum_c G_bc H_c; "
        "M0 = 1e-7 f0 (nu n)^(2/3) d_m^3, of nu n below 2000 160e-7 f0 d_m^3, M1 = f1 P1 d_m, in N mm, mm, rpm, mm2/s (Palmgren; Harris, Rolling Bearing Analysis, 4th ed. 2001)"
    ),
    parameters=(
        scale_parameter(
            typical=1.0,
            prior_sd=0.7,
            limits=(0.0, 10.0),
            meaning="temperature rise by bearing friction in units of the one computed from the scene's Palmgren and cooling data",
            source="Palmgren's f0 spreads by about 2 for greased bearings (Harris 2001); convection is known no better",
        ),
        Parameter(
            "common_share",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=0.5,
            limits=(0.0, 1.0),
            meaning=(
                "share of the outer rings' own rise that a test's temperature leaves out: 0 the test tells the hub's temperature, "
                "1 that of the air far from it"
            ),
            source="a matter of where the thermometer sits; 0 keeps what is a gradient",
        ),
        Parameter(
            "level_share",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=0.5,
            limits=(0.0, 1.0),
            meaning=(
                "share by which the rise is levelled within each part that holds bearing rings: 0 the field as conduction computes it, "
                "1 each part at one temperature, the mean of its rings"
            ),
            source=(
                "where heat flows inside a part (fits, grease, air) is known no better, and what the bearings see is mostly the "
                "difference of the parts"
            ),
        ),
    ),
    sees=(
        "only at speed: inner rings run hotter than outer ones, which loads the bearings again, so bearing modes rise with speed "
        "beside their split, most in a cold chamber where the grease is stiff; a common rise (common_share) takes most of it back"
    ),
    resembles=("lubricant_film", "ring_growth", "ball_inertia", "soak_lag"),
    valid=(
        "steady state, reached after the spindle's time constant (minutes); bearings under their reference preload; "
        "no motor heat; below the temperature at which the viscosity table ends"
    ),
    temperatures=temperatures,
    acts_on=(RINGS,),
)
