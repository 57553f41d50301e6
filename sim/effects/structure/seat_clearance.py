"""One bearing is loose in its seat across the axis: only part of its ring is backed, and its row carries less of the shaft."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import RotorBase
from thermospindle.sim.effects.effect import Effect, Parameter, Values
from thermospindle.sim.effects.roles import held, lacking


def chain(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase) -> RotorBase:
    if values["share"] == 0.0:
        return chain
    name = spindle.all_bearings[min(int(values["bearing"]), len(spindle.all_bearings) - 1)].name
    keep = np.sqrt(1 - values["share"])
    loose = np.diag([keep, keep, 1.0, 1.0, 1.0])
    return replace(chain, elements=tuple(e.told_by(loose) if e.name == name else e for e in chain.elements))


def idle(spindle: Spindle) -> str | None:
    return None if held(spindle) else lacking("body", "housing")


EFFECT = Effect(
    name="seat_clearance",
    title="A bearing loose in its seat",
    equation=(
        "K -> S K S, S = diag(sqrt(1 - share), sqrt(1 - share), 1, 1, 1), for one bearing: of a ring that touches its seat over part of the "
        "circumference only that part backs the balls across the axis, while its shoulder holds it along it; K stays positive"
    ),
    parameters=(
        Parameter(
            "share", "1", 0.0, 0.3, 0.3, (0.0, 0.95),
            "share of the row's radial stiffness that is lost", "assumed: a seat 5 um loose backs a ring over a half to two thirds of it",
        ),
        Parameter(
            "bearing", "1", 0.0, 0.0, 1.0, (0.0, 1.0),
            "which bearing is loose, counted from the lowest, 0", "unknown before looking", choices=(0.0, 1.0), counts="all bearings",
        ),
    ),
    sees="rotor modes lower that move the shaft at that bearing, others not; the same at every temperature and speed",
    resembles=("housing_flexibility", "preload_loss", "bearing_misalignment"),
    valid="small vibration about a loaded state in which the ring lies in its seat; not a ring that rattles",
    chain=chain,
    idle=idle,
)  # fmt: skip
