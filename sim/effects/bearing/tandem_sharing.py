"""Rows in tandem share their load unequally: their rings or spacers differ in length by some micrometres."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.machine import BearingSet, Condition, RingMotion, Spindle
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values


def motions(spindle: Spindle, condition: Condition, values: Values, by_bearing: dict[str, RingMotion]) -> dict[str, RingMotion]:
    """Outer rings moved apart along the axis, evenly from one end of each tandem group to the other."""
    if values["offset"] == 0.0:
        return by_bearing
    moved = dict(by_bearing)
    for group in groups(spindle):
        for k, name in enumerate(group):
            place = 2 * k / (len(group) - 1) - 1  # -1 for the lowest row, 1 for the highest
            moved[name] = replace(by_bearing[name], outer_z=by_bearing[name].outer_z + 0.5e-6 * place * values["offset"])
    return moved


def groups(spindle: Spindle) -> list[list[str]]:
    """Names of the rows of every set that are loaded the same way, where there are several, lowest first."""
    return [own for s in spindle.sets for sense in (-1, 1) if len(own := _alike(spindle, s, sense)) > 1]


def _alike(spindle: Spindle, s: BearingSet, sense: int) -> list[str]:
    rows = sorted((spindle.bearing(name) for name in s.bearings), key=lambda b: b.z)
    return [b.name for b in rows if b.sense == sense]


def idle(spindle: Spindle) -> str | None:
    return None if groups(spindle) else "no two rows of a set are in tandem"


EFFECT = Effect(
    name="tandem_sharing",
    title="Unequal load of rows in tandem",
    equation=(
        "outer_z -> outer_z + offset p / 2, p from -1 (lowest) to 1 (highest) over the rows of a tandem group, in the set's axial equilibrium: with equal "
        "rigidities k the rows of two differ by k offset in load (Harris, Rolling Bearing Analysis, 4th ed. 2001, ch. 9: preload of sets)"
    ),
    parameters=(
        Parameter(
            "offset", "um", 0.0, 1.0, 1.0, (-10.0, 10.0),
            "by how much the outer rings stand farther apart than the inner ones, over a tandem group",
            "universally ground rings agree to 1 to 2 um (makers' tolerances of sets of class P4S)",
        ),
    ),
    sees="of two rows in tandem one is stiffer and hotter than the other; modes move little, as stiffness goes with the cube root of load",
    resembles=("preload_loss", "bearing_misalignment", "cooling_imbalance"),
    valid="rings fixed in their seats; the offset does not change with temperature",
    motions=motions,
    acts_on=(ROWS,),
    idle=idle,
)  # fmt: skip
