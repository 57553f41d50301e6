"""One ring sits askew: its row carries more on one side than on the other, and its stiffness differs between x and y."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from thermospindle.model.bearing.ball_row import respond
from thermospindle.model.bearing.pair import BearingState, PairState, contact_status
from thermospindle.model.bearing.row import reference_deformation
from thermospindle.model.errors import listed
from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values, direction_parameter


def pair(spindle: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
    tilt = values["tilt"] * 1e-3
    if tilt == 0.0:
        return state
    along, across, direction = values["lower_share"], values["lower_across"], np.radians(values["direction"])
    upper, lower = (1.0, direction), (float(np.hypot(along, across)), direction + float(np.arctan2(across, along)))
    bearings = tuple(
        tilted(b, share * tilt, axis, spindle.structure.damping_time(drawing.damping_ratio))
        for b, drawing, (share, axis) in zip(state.bearings, spindle.bearings, [lower] * (len(state.bearings) - 1) + [upper], strict=True)
    )
    return replace(state, bearings=bearings, status=contact_status(bearings))


def tilted(b: BearingState, tilt: float, direction: float, damping_time: float) -> BearingState:
    """The bearing with its outer ring tilted by `tilt` (rad) about the axis at `direction` (rad from x) against the inner.

    What tilting changes is added to the stiffness that stands, and `damping_time` (s) times that to the damping.
    """
    if tilt == 0.0:
        return b
    answer = respond(b.row, np.array([0.0, 0.0, 0.0, tilt * np.cos(direction), tilt * np.sin(direction)]))
    change = answer.tangent - respond(b.row).tangent
    return replace(
        b,
        stiffness=b.stiffness + change,
        damping=b.damping + damping_time * change,
        in_contact=b.in_contact and bool(answer.in_contact.all()),
    )


def sized(spindle: Spindle) -> Mapping[str, float]:
    """A tilt counts by what it moves the balls, over their deformation: 1.05 um at 4.55 mm on the reference spindle."""
    return {"tilt": min(reference_deformation(spindle, b) * 2 / b.pitch_diameter for b in spindle.bearings) / (1.054e-6 / 4.55e-3)}


def meant(spindle: Spindle) -> Mapping[str, str]:
    """Of which of the scene's bearings `tilt` is, and of which the others."""
    *below, upper = (b.name for b in spindle.bearings)
    if not below:
        return {"tilt": TILTED.format(upper)} | dict.fromkeys(("lower_share", "lower_across"), "nothing here: the scene has one ball row alone")
    one = f"the {below[0]} bearing's ring" if len(below) == 1 else f"the rings of the {listed(below)} bearings, of all alike"
    other = f"over that of the {upper}'s"
    return {
        "tilt": TILTED.format(upper),
        "lower_share": f"tilt of {one}, about the same axis, {other}",
        "lower_across": f"tilt of {one} about the axis at right angles, {other}",
    }


TILTED = "tilt of the {} bearing's non-turning ring; the change grows with its square"


EFFECT = Effect(
    name="bearing_misalignment",
    title="A bearing ring sits askew in its seat",
    equation=(
        "deformation_j = |centre line + arm tilt sin(psi_j - direction) e_z| - A at every ball; "
        "K = sum_j B_j^T (F' e e^T + F / L (1 - e e^T)) B_j there (model.bearing.ball_row)"
    ),
    parameters=(
        Parameter(
            "tilt",
            "mrad",
            neutral=0.0,
            typical=0.2,
            prior_sd=0.15,
            limits=(-2.0, 2.0),
            meaning=TILTED.format("upper"),
            source="1 um of axial runout of a shoulder 7.5 mm across is 0.13 mrad (ISO 492 class 4 allows 2 to 3 um)",
        ),
        direction_parameter(60.0, 180.0, "axis of the tilt, from x towards y"),
        Parameter(
            "lower_share",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=0.5,
            limits=(-2.0, 2.0),
            meaning="tilt of the lower bearing's ring, about the same axis, over that of the upper's",
            source="assumed: one faulty seat",
        ),
        Parameter(
            "lower_across",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=0.5,
            limits=(-2.0, 2.0),
            meaning="tilt of the lower bearing's ring about the axis at right angles, over that of the upper's",
            source="assumed: one faulty seat; two that know nothing of each other are askew by as much in any directions",
        ),
    ),
    sees=(
        "rocking modes split further, or less when the split runs across the structure's own; mean frequencies rise slightly until "
        "balls lift off"
    ),
    resembles=("magnetic_pull", "hertz_amplitude"),
    valid=(
        "a ring that does not turn (one that turns gives speed-periodic stiffness); hub held by the other bearing: the rigid pair's "
        "balance is not solved anew for the tilted ring's moment; of more than two rows the highest is the upper, and all others are askew alike"
    ),
    pair=pair,
    sized=sized,
    meant=meant,
    acts_on=(ROWS,),
)
