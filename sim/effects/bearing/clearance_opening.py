"""The diametral clearance opens, by wear, by temperature, or by a fit looser than drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from thermospindle.model.bearing.row import reference_deformation
from thermospindle.model.machine import Condition, RingMotion, Spindle
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values

RISE = 40.0
"""Temperature rise (K) at which `opening` is told."""


def motions(spindle: Spindle, condition: Condition, values: Values, by_bearing: dict[str, RingMotion]) -> dict[str, RingMotion]:
    if values["opening"] == 0.0:
        return by_bearing
    warm = (condition.temperature - spindle.reference_temperature) / RISE
    share = values["thermal_share"]
    radial = 0.5e-6 * values["opening"] * (1 - share + share * warm)
    return {name: replace(motion, outer_r=motion.outer_r + radial) for name, motion in by_bearing.items()}


def sized(spindle: Spindle) -> Mapping[str, float]:
    """What counts is the share of the balls' deformation under the preload, 1.05 um on the reference spindle."""
    return {"opening": min(reference_deformation(spindle, b) for b in spindle.bearings) / 1.054e-6}


EFFECT = Effect(
    name="clearance_opening",
    title="The diametral clearance of the bearings opens",
    equation=(
        "radial distance of the groove centres, inner less outer, falls by (opening / 2) (1 - w + w (T - T_ref) / 40 K), "
        "w = thermal_share (Jang et al. 2003, Eq. 1 with the outer race moved outward)"
    ),
    parameters=(
        Parameter(
            "opening",
            "um",
            neutral=0.0,
            typical=0.2,
            prior_sd=0.15,
            limits=(-3.0, 3.0),
            meaning="growth of the diametral clearance 40 K above the reference temperature; negative closes",
            source="a few percent of the printed 13 to 20 um clearance; a fit's interference passes to the raceway by tenths of a um",
        ),
        Parameter(
            "thermal_share",
            "1",
            neutral=1.0,
            typical=1.0,
            prior_sd=0.5,
            limits=(0.0, 1.0),
            meaning="share of the opening that comes with temperature (0.025 um/K for 1 um); 0 is wear, the same at every temperature",
            source="assumed: temperature until a test says else",
        ),
    ),
    sees="preload and bearing modes fall, rocking more than axial, and the contact angle rises: with temperature, or everywhere",
    resembles=("preload_loss", "expansion_mismatch", "loose_inserts", "soak_lag"),
    valid="both bearings alike; fixed-position preload (a spring would take the opening up)",
    motions=motions,
    sized=sized,
    acts_on=(ROWS,),
)
