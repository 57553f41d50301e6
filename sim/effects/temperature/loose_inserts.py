"""Yoke and magnet hold the hub's expansion back less than bonded rings would: a weak bond, or left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.material import Law
from thermospindle.sim.effects.effect import SECTION, Effect, Parameter, Values
from thermospindle.sim.effects.roles import lacking, materials


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    loose = values["looseness"]
    if loose == 0.0 or idle(spindle) is not None:
        return spindle
    hub = spindle.materials[materials(spindle, "hub")[0]].thermal_expansion
    changed = {
        name: replace(spindle.materials[name], thermal_expansion=blend(spindle.materials[name].thermal_expansion, hub, loose))
        for name in insert_materials(spindle)
    }
    return replace(spindle, materials={**spindle.materials, **changed})


def insert_materials(spindle: Spindle) -> tuple[str, ...]:
    """Materials of the regions with role insert that no other region is made of."""
    elsewhere = {g.material for g in spindle.regions if g.role != "insert"}
    return tuple(name for name in materials(spindle, "insert") if name not in elsewhere)


def idle(spindle: Spindle) -> str | None:
    if not materials(spindle, "hub"):
        return lacking("region", "hub")
    return None if insert_materials(spindle) else f"{lacking('region', 'insert')} that is of a material of its own"


def blend(own: Law, other: Law, share: float) -> Law:
    """(1 - share) own + share other, on the knots of both; the range is the one both have."""
    if len(own.value) == 1 and len(other.value) == 1:
        return Law(own.temperature, ((1 - share) * own.value[0] + share * other.value[0],))
    tables = [law.temperature for law in (own, other) if len(law.value) > 1]
    low, high = max(t[0] for t in tables), min(t[-1] for t in tables)
    knots = [float(t) for t in np.unique(np.concatenate(tables)) if low <= t <= high]
    return Law(tuple(knots), tuple((1 - share) * own(t) + share * other(t) for t in knots))


EFFECT = Effect(
    name="loose_inserts",
    title="Yoke and magnet are bonded weakly, or left out of the model's hub",
    equation=(
        "alpha_insert = (1 - looseness) alpha_insert + looseness alpha_hub: an insert that follows the hub's free expansion puts "
        "no thermal stress on it, which is what a compliant bond does; linear in between by superposition of thermal strains"
    ),
    parameters=(
        Parameter(
            "looseness",
            "1",
            neutral=0.0,
            typical=0.5,
            prior_sd=0.35,
            limits=(0.0, 1.0),
            meaning="share of the inserts' hold on the hub's expansion that is lost; 1 is no bond",
            source="assumed: anything from a rigid to a soft adhesive is built; no drawing says which",
        ),
    ),
    sees="the lower bearing's preload and both bearings' modes fall more with temperature; nothing at the reference temperature",
    resembles=("expansion_mismatch", "soak_lag", "clearance_opening", "preload_loss"),
    valid=(
        "the hub about uniform in temperature; the inserts' elastic support of the hub against the steel rings' hold stays; "
        "inserts of a material that bearings or the stationary part use too are left as they are"
    ),
    spindle=spindle,
    idle=idle,
    acts_on=(SECTION,),
)
