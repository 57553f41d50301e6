"""The housing gives under the bearings: its seats are springs in series with the rows that sit in them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import RotorBase
from thermospindle.sim.effects.effect import Effect, Parameter, Values
from thermospindle.sim.effects.roles import held, in_series, lacking


def chain(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase) -> RotorBase:
    if values["radial"] == 0.0:
        return chain
    seats = held(spindle)
    radial, tilt = 1e-9 * values["radial"], 1e-6 * values["radial"] * values["tilt"]
    soft = np.diag([radial, radial, 0.0, tilt, tilt])
    return replace(chain, elements=tuple(in_series(e, soft) if e.name in seats else e for e in chain.elements))


def idle(spindle: Spindle) -> str | None:
    return None if held(spindle) else lacking("body", "housing")


EFFECT = Effect(
    name="housing_flexibility",
    title="Housing seats that give under the bearings",
    equation=(
        "K_s = (1 + K F)^-1 K, F = radial diag(1, 1, 0, tilt, tilt), for every bearing in the housing: seat and row in series "
        "(Weck & Brecher, Werkzeugmaschinen 2, 8th ed. 2006, ch. 5: static compliance of spindle-bearing systems)"
    ),
    parameters=(
        Parameter(
            "radial", "nm/N", 0.0, 0.5, 0.5, (0.0, 20.0),
            "compliance of a seat across the axis", "assumed: a bore in a cast wall gives a tenth of what a row of 200 N/um does",
        ),
        Parameter(
            "tilt", "urad/(N m) per nm/N", 0.0, 2.0, 1.0, (0.0, 20.0),
            "compliance of a seat against tilting, over that across the axis", "assumed: a few percent of a row's own; thin end walls give more",
        ),
    ),
    sees="rotor modes lower and, as part of their strain energy leaves the bearings, less dependent on preload, temperature and speed",
    resembles=("seat_clearance", "mount_compliance", "bond_softening", "shear"),
    valid="seats far from each other, each giving for itself; rigid against axial load; lossless",
    chain=chain,
    idle=idle,
)  # fmt: skip
