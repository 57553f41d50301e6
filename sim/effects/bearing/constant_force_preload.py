"""A spring or a ring that slides under its adhesive keeps the preload, where the drawing has fixed positions."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.bearing.definitions import BearingSet, PreloadSpring
from thermospindle.model.bearing.pair import solve
from thermospindle.model.machine import Condition, RingMotion, Spindle
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values


def motions(spindle: Spindle, condition: Condition, values: Values, by_bearing: dict[str, RingMotion]) -> dict[str, RingMotion]:
    """Outer rings moved along their seats by `share` of what would bring each bearing back to its preload."""
    share = values["share"]
    if share == 0.0 or idle(spindle) is not None:
        return by_bearing
    rigid = solve(spindle, condition, by_bearing)
    sets = tuple(replace(s, spring=PreloadSpring(_upper(spindle, s))) if _opposed(spindle, s) else s for s in spindle.sets)
    sprung = solve(replace(spindle, sets=sets), condition, by_bearing)
    moved = {}
    for b, old, new in zip(spindle.bearings, rigid.bearings, sprung.bearings, strict=True):
        slide = new.row.axial - old.row.axial
        moved[b.name] = replace(by_bearing[b.name], outer_z=by_bearing[b.name].outer_z + share * slide)
    return by_bearing | moved


def idle(spindle: Spindle) -> str | None:
    if all(spindle.one_way(s) for s in spindle.sets):
        return "a tandem set has no opposed rings that would hold each other's preload"
    return None if any(_opposed(spindle, s) for s in spindle.sets) else "the scene's preload is by a spring already"


def _opposed(spindle: Spindle, s: BearingSet) -> bool:
    """Whether a set's rings load each other in fixed positions."""
    return s.spring is None and not spindle.one_way(s)


def _upper(spindle: Spindle, s: BearingSet) -> tuple[str, ...]:
    """The rows loaded as the uppermost one: any group of a set serves, all then carry the preload, but for an axial load."""
    rows = sorted((spindle.bearing(name) for name in s.bearings), key=lambda b: b.z)
    return tuple(b.name for b in rows if b.sense == rows[-1].sense)


EFFECT = Effect(
    name="constant_force_preload",
    title="Preload by constant force instead of fixed positions",
    equation=(
        "outer_z,b -> outer_z,b + share s_b (z_spring,b - z_rigid,b): ring movements at which axial force is the preload (spring) "
        "and at which the fixed pair balances (rigid; Jang et al. 2003, Eq. 8); a preload spring of stiffness k in series with the "
        "pair's k_p has share = k_p / (k_p + k)"
    ),
    parameters=(
        Parameter(
            "share",
            "1",
            neutral=0.0,
            typical=0.6,
            prior_sd=0.4,
            limits=(0.0, 1.0),
            meaning="share of the ring movement for constant force that a ring makes; 0 fixed, 1 a soft spring without friction",
            source="both kinds are built (Harris, Rolling Bearing Analysis, 2001); friction in the seat leaves shares between",
        ),
    ),
    sees="bearing modes hardly fall with temperature and hardly change with speed; the contact angle still rises",
    resembles=("soak_lag", "expansion_mismatch", "thermal_gradient"),
    valid=(
        "slow movements: the ring slides in its seat as temperature changes but sticks against vibration, so both bearings keep "
        "their dynamic stiffness; not for tandem pairs; where several sets locate the shaft, its expansion between them goes on shifting load from the rows in fixed positions of one to those of another"
    ),
    motions=motions,
    idle=idle,
    acts_on=(ROWS,),
)
