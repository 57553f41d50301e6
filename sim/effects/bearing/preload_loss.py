"""The pair was assembled with less preload than its drawing says, or loses preload when warm."""

from __future__ import annotations

from thermospindle.model.built.tolerance import scaled_preload
from thermospindle.model.machine import Condition, Spindle
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values, chosen, which_parameter

RISE = 40.0
"""Temperature rise (K) at which `loss` is told."""


def spindle(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
    if values["loss"] == 0.0:
        return spindle
    return scaled_preload(spindle, remaining(spindle, condition, values), chosen(values, "set", [s.name for s in spindle.sets]))


def remaining(spindle: Spindle, condition: Condition, values: Values) -> float:
    """Preload left at a condition, in units of the drawing's."""
    warm = (condition.temperature - spindle.reference_temperature) / RISE
    return float((1 - values["loss"]) ** (1 - values["thermal_share"] + values["thermal_share"] * warm))


EFFECT = Effect(
    name="preload_loss",
    title="Preload lost at assembly or by relaxation",
    equation=(
        "P0 -> P0 (1 - loss)^(1 - w + w (T - T_ref) / 40 K), w = thermal_share; the groove centres' radial distance stays, "
        "n K delta^1.5 sin(alpha) = P0 gives the loaded angle and deformation of the reference state"
    ),
    parameters=(
        Parameter(
            "loss",
            "1",
            neutral=0.0,
            typical=0.15,
            prior_sd=0.10,
            limits=(-0.5, 0.8),
            meaning="share of the drawing's preload that is lost 40 K above the reference temperature; negative is a gain",
            source="assumed: embedding and adhesive creep take 5 to 20 % of a clamping force (VDI 2230-1, 2015, for bolted joints)",
        ),
        Parameter(
            "thermal_share",
            "1",
            neutral=0.0,
            typical=0.5,
            prior_sd=0.4,
            limits=(0.0, 1.0),
            meaning="share of the loss that comes with temperature; 0 lost at assembly, 1 nothing lost at the reference",
            source="assumed: assembly until a test says else",
        ),
        which_parameter("set", "sets", 1, "which set lost it", "unknown before looking"),
    ),
    sees="bearing modes lower at every temperature (thermal_share 0) or falling more (1); damping of the rocking modes changes little",
    resembles=("clearance_opening", "expansion_mismatch", "bond_softening", "hertz_amplitude"),
    valid="reversible relaxation, the same in every test of a campaign; at the drawing's ring positions, before thermal expansion",
    spindle=spindle,
    acts_on=(ROWS,),
)
