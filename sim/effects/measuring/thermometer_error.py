"""Thermometers read wrong: the spindle is warmer than a test says."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import Effect, Parameter, Values


def condition(spindle: Spindle, condition: Condition, values: Values) -> Condition:
    offset = values["offset"]
    return replace(condition, temperature=condition.temperature + offset) if offset else condition


def idle(spindle: Spindle) -> str | None:
    """Rings that move, bearings told over temperature, moduli of shafts and joints and effects of the scene depend on it."""
    structure = spindle.structure
    elastic = {s.material for shaft in structure.shafts for s in shaft.segments} | {j.material for j in structure.joints if j.material}
    softens = any(len(set(spindle.materials[name].youngs_modulus.value)) > 1 for name in elastic)
    if spindle.rolling or spindle.effects or softens or any(len(b.temperature) > 1 for b in spindle.linear_bearings):
        return None
    return "nothing of this scene depends on temperature"


EFFECT = Effect(
    name="thermometer_error",
    title="Thermometers read wrong by more than their tolerance",
    equation="T = T_read + offset, of the spindle as a whole: all that depends on temperature is that of T",
    parameters=(
        Parameter(
            "offset",
            "K",
            neutral=0.0,
            typical=3.0,
            prior_sd=3.0,
            limits=(-40.0, 40.0),
            meaning="by how much the spindle is warmer than its thermometer reads",
            source="assumed: a thermometer on the chamber's wall, a thermocouple of another type (4 % between K and N), a test that was labelled wrongly",
        ),
    ),
    sees=(
        "modes lie where they would at another temperature, all of them; where one test's thermometer alone is wrong, the size is nothing in all "
        "others: its law is the data's own, and the test is to be corrected, not the spindle"
    ),
    resembles=("soak_lag", "expansion_mismatch", "modulus_softening"),
    valid="the whole spindle at one temperature; the offset changes from test to test as the data have it, and not within one",
    condition=condition,
    idle=idle,
)
