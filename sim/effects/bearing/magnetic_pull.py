"""The motor's magnet pulls the hub: an axial bias on the bearings, and a negative stiffness across the spindle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from thermospindle.model.drawing.section import Region
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import Element, RotorBase
from thermospindle.sim.effects.effect import TURNING, Effect, Parameter, Values, mass_ratio
from thermospindle.sim.effects.roles import body


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    pull = pull_at(spindle, condition, values)
    if pull == 0.0:
        return spindle
    return replace(spindle, axial_load=spindle.axial_load + spindle.axial_on_turning(-pull))


def pull_at(spindle: Spindle, condition: Condition, values: Values) -> float:
    """The pull (N) at a condition: it goes with the square of the magnet's remanence."""
    rise = condition.temperature - spindle.reference_temperature
    return float(values["pull"] * max(1 + 1e-2 * values["remanence_slope"] * rise, 0.0) ** 2)


def chain(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase) -> RotorBase:
    stiffness = abs(pull_at(spindle, condition, values)) * values["radial_ratio"] * 1e3
    if stiffness == 0.0:
        return chain
    across = np.diag([-stiffness, -stiffness, values["axial_ratio"] * stiffness, 0.0, 0.0])
    element = Element(
        "magnet",
        "motor",
        stator_body(spindle, int(values["below"])),
        spindle.turning_at(magnet_height(spindle)).name,
        magnet_height(spindle),
        across,
        np.zeros((5, 5)),
    )
    return replace(chain, elements=(*chain.elements, element))


def stator_body(spindle: Spindle, below: int = 0) -> str:
    """The body that holds the stator: that with role seat, or with `below` that with role base; the ground where there is none."""
    found = body(spindle, "base" if below else "seat") or body(spindle, "base")
    return found.name if found else "ground"


def sized(spindle: Spindle) -> Mapping[str, float]:
    """A pull is a share of the preload, here of 16 N, and air gaps go with lengths."""
    return {"pull": max((s.preload for s in spindle.sets), default=16.0) / 16.0, "radial_ratio": mass_ratio(spindle) ** (-1 / 3)}


def magnet(spindle: Spindle) -> list[Region]:
    """The rotating regions in which the motor's loss is made."""
    names = {name for source in spindle.thermal.sources for name in source.regions}
    return [g for g in spindle.regions if g.name in names and g.part == "rotating"]


def magnet_height(spindle: Spindle) -> float:
    """Mean height (m) of the magnet; the turning body's own without any."""
    heights = [np.mean(g.z) for g in magnet(spindle)]
    return float(np.mean(heights)) if heights else spindle.turning.z


def idle(spindle: Spindle) -> str | None:
    driven = not spindle.structure.shafts or magnet(spindle)  # a rigid hub has its motor in it
    return None if driven else "the scene has no motor: no turning region in which a source of [thermal] makes heat"


EFFECT = Effect(
    name="magnetic_pull",
    title="Magnetic pull of the motor on the hub",
    equation=(
        "axial force on what turns F_z = -P, P = pull (1 + remanence_slope (T - T_ref))^2, in the pair's equilibrium (Jang et al. 2003, "
        "Eq. 8); between stator and hub K = diag(-k, -k, axial_ratio k, 0, 0) at the magnet's height, k = radial_ratio |P|: "
        "the pull grows as the gap closes; axial_ratio 2 without iron (Earnshaw: div grad of the energy is 0)"
    ),
    parameters=(
        Parameter(
            "pull",
            "N",
            neutral=0.0,
            typical=3.0,
            prior_sd=2.0,
            limits=(-10.0, 10.0),
            meaning="axial magnetic force on what turns, positive downward (towards -z)",
            source="assumed: disk-drive motors set their magnet off the stator's middle for some newtons of axial bias",
        ),
        Parameter(
            "radial_ratio",
            "1/mm",
            neutral=10.0,
            typical=10.0,
            prior_sd=5.0,
            limits=(0.0, 200.0),
            meaning="negative radial stiffness over axial pull",
            source="assumed: air-gap field energy changing over a gap of some tenths of a millimetre, several times the axial pull",
        ),
        Parameter(
            "axial_ratio",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=2.0,
            limits=(0.0, 2.0),
            meaning="restoring axial stiffness of the magnet over the negative radial one",
            source="2 between magnets without iron (Earnshaw's theorem), less where iron saturates; left out by default",
        ),
        Parameter(
            "remanence_slope",
            "%/K",
            neutral=-0.12,
            typical=-0.12,
            prior_sd=0.05,
            limits=(-0.3, 0.0),
            meaning="change of the magnet's remanence with temperature",
            source="sintered NdFeB -0.12 %/K, ferrite -0.2, SmCo -0.04 (makers' data sheets)",
        ),
        Parameter(
            "below",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=1.0,
            limits=(0.0, 1.0),
            meaning="where the stator is fixed: 0 on the body with role seat, 1 on that with role base",
            source="assumed: stators sit on the shaft's flange, or on the base plate round it",
            choices=(0.0, 1.0),
        ),
    ),
    sees=(
        "lower and upper bearing differ in preload by the pull, so their stiffness moves apart while its mean hardly changes; "
        "rocking modes fall slightly by the negative stiffness"
    ),
    resembles=("preload_loss", "bearing_misalignment"),
    valid=(
        "rigidly preloaded pairs (a spring-loaded pair takes the bias on one ring's stop and the model leaves it out); hub centred "
        "in the stator; the stator is rigid"
    ),
    spindle=spindle,
    chain=chain,
    sized=sized,
    idle=idle,
    acts_on=(TURNING,),
)
