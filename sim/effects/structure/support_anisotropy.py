"""What holds the spindle is stiffer in one direction across its axis than in the other: screws on two sides, ribs, a slot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import RotorBase
from thermospindle.model.types import Array
from thermospindle.sim.effects.effect import Effect, Parameter, Values, direction_parameter
from thermospindle.sim.effects.roles import joints, lacking


def chain(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase) -> RotorBase:
    split = values["split"]
    if split == 0.0:
        return chain
    direction = np.radians(values["direction"])
    by_role = {"flange": split, "plate": values["plate_share"] * split}
    uneven = {name: unevenness(own, direction) for role, own in by_role.items() for name in joints(spindle, role)}
    return replace(chain, elements=tuple(e.told_by(uneven[e.name]) if e.name in uneven else e for e in chain.elements))


def unevenness(split: float, direction: float) -> Array:
    """Matrix S (5, 5) of K -> S K S, which multiplies stiffness in the plane of z and `direction` (rad from x) by 1 + split / 2.

    In that plane a body moves along the direction and tilts about the axis across it; across it the factor is 1 - split / 2.
    """
    c, s = np.cos(direction), np.sin(direction)
    turn = np.eye(5)
    turn[:2, :2] = turn[3:, 3:] = [[c, -s], [s, c]]
    strong, weak = np.sqrt(1 + split / 2), np.sqrt(1 - split / 2)
    return turn @ np.diag([strong, weak, 1.0, weak, strong]) @ turn.T


def idle(spindle: Spindle) -> str | None:
    return None if joints(spindle, "flange") or joints(spindle, "plate") else lacking("joint", "flange", "plate")


EFFECT = Effect(
    name="support_anisotropy",
    title="Flange and plate are stiffer one way than across",
    equation=(
        "K -> S K S, S = R diag(sqrt(1 + s/2), sqrt(1 - s/2), 1, sqrt(1 - s/2), sqrt(1 + s/2)) R^T: bending stiffness in the plane "
        "at `direction` times 1 + s/2, in the plane across times 1 - s/2; s = split at the flange, plate_share split at the plate "
        "(split of forward and backward modes by anisotropic supports: Genta, Dynamics of Rotating Systems, 2005)"
    ),
    parameters=(
        Parameter(
            "split",
            "1",
            neutral=0.0,
            typical=0.10,
            prior_sd=0.07,
            limits=(-1.5, 1.5),
            meaning="stiffness of the flange joint across the axis and against tilt: difference of the two planes over their mean",
            source="assumed: flanges on three or four screws, 5 to 20 %; the build tolerance scales both planes alike",
        ),
        Parameter(
            "plate_share",
            "1",
            neutral=0.5,
            typical=0.5,
            prior_sd=0.5,
            limits=(-1.3, 1.3),
            meaning="split of the plate's tilt stiffness, beyond the drawing's, over that of the flange",
            source="assumed: a plate wider than its flange is less uneven",
        ),
        direction_parameter(45.0, 90.0, "direction of the stiffer plane, from x towards y"),
    ),
    sees="rocking pairs split further (or less, across the drawing's own split) at rest as at speed, the same at every temperature",
    resembles=("bearing_misalignment", "flange_fit_loosening", "added_disk"),
    valid="linear joints whose two planes stay at right angles; axial stiffness as drawn",
    chain=chain,
    idle=idle,
)
