"""The rings' seats lose interference as they grow, and rub more: the bearings' damping rises with temperature."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.bearing.pair import PairState
from thermospindle.model.bearing.roller import RollerState
from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import ROLLING, Effect, Parameter, Values

LOOSE = 0.1
"""Share of their pressure that seats keep at least, by the rings' ovality and by what clamps them along the axis."""


def pair(spindle: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
    rubbing = values["rubbing_share"]
    if rubbing == 0.0:
        return state
    pressure = max(1 - (condition.temperature - spindle.reference_temperature) / values["span"], LOOSE)
    factor = 1 + rubbing * (1 / pressure - 1)
    rolling = tuple(replace(b, damping=factor * b.damping) if isinstance(b, RollerState) else b for b in state.linear)
    return replace(state, bearings=tuple(replace(b, damping=factor * b.damping) for b in state.bearings), linear=rolling)


EFFECT = Effect(
    name="seat_friction",
    title="Bearing damping rises as the rings' seats loosen",
    equation=(
        "D(T) = D (1 + rubbing_share (1 / rho - 1)), rho = 1 - (T - T_ref) / span, at least 0.1: pressure of a press fit is proportional to its "
        "interference (Lame; Timoshenko & Goodier, Theory of Elasticity, 1970), and what a contact in microslip loses a cycle, at one amplitude of "
        "force, is inverse to pressure (Mindlin & Deresiewicz, J. Appl. Mech. 20, 1953, to the first order of slip)"
    ),
    parameters=(
        Parameter(
            "rubbing_share", "1", 0.0, 0.3, 0.3, (0.0, 1.0),
            "share of the bearings' damping at the reference temperature that their seats' friction gives",
            "assumed: film, contacts and the ring's seat are each a part of what a mounted bearing loses, their shares unlike from one mounting to "
            "the next (Dietl, Wensing, van Nijen, Rolling bearing damping for dynamic analysis of multi-body systems, 2000)",
        ),
        Parameter(
            "span", "K", 60.0, 60.0, 30.0, (20.0, 1000.0),
            "temperature above the reference at which growth has used up the interference",
            "assumed: a seat in aluminium leaves a steel ring 13 mm across by 0.15 um/K, and a light fit of 9 um (ISO 286-2) in 60 K",
        ),
    ),
    sees="damping ratios of the bearing modes rise with temperature, more and more, while their frequencies stay as computed",
    resembles=("grease_damping", "bond_softening", "window_damping"),
    valid=(
        "microslip of rings that their seats still hold, at small amplitude, the seats growing more than the rings; at chamber temperature, so without "
        "the bearings' own heat; of a bonded ring it stands for the bond's loss, which rises towards its glass transition"
    ),
    pair=pair,
    acts_on=(ROLLING,),
)  # fmt: skip
