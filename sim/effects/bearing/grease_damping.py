"""The bearings' damping comes from the grease, and falls with its viscosity."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.bearing.pair import PairState
from thermospindle.model.bearing.roller import RollerState
from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import ROLLING, Effect, Parameter, Values


def pair(spindle: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
    share = values["viscous_share"]
    if share == 0.0:
        return state
    viscosity = spindle.thermal.friction.viscosity
    ratio = viscosity(condition.temperature) / viscosity(spindle.reference_temperature)
    factor = 1 + share * (ratio - 1)
    rolling = tuple(replace(b, damping=factor * b.damping) if isinstance(b, RollerState) else b for b in state.linear)
    return replace(state, bearings=tuple(replace(b, damping=factor * b.damping) for b in state.bearings), linear=rolling)


EFFECT = Effect(
    name="grease_damping",
    title="Bearing damping follows the grease's viscosity",
    equation="D(T) = D (1 + viscous_share (nu(T) / nu(T_ref) - 1)), nu the scene's kinematic viscosity",
    parameters=(
        Parameter(
            "viscous_share",
            "1",
            neutral=0.0,
            typical=0.5,
            prior_sd=0.4,
            limits=(0.0, 1.0),
            meaning="share of the bearings' damping at the reference temperature that is proportional to viscosity",
            source=(
                "measured bearing damping grows less than viscosity does: squeeze film and grease share it with friction "
                "(Dietl, Wensing, van Nijen, Rolling bearing damping for dynamic analysis of multi-body systems, 2000)"
            ),
        ),
    ),
    sees="damping ratios of the bearing modes fall with temperature while their frequencies stay as computed",
    resembles=("bond_softening",),
    valid="within the viscosity table; at chamber temperature, so without the bearings' own heat",
    pair=pair,
    acts_on=(ROLLING,),
)
