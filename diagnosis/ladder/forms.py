"""Model forms: how much of a bearing's thermal motion a model takes in, from the earlier literature to the full axial equilibrium.

fixed stiffness        bearings as at the reference temperature, whatever the test's: a spindle model without temperature
radial expansion only  the outer race moves radially against the inner one, and nothing moves axially: Tseng, Shen, Shen, Ku, ASME
                       J. Tribology, as Jang et al. 2003 describe it (their reference 6)
axial equilibrium      radial and axial motion, and the hub moves until the axial forces balance: Jang et al. 2003, Eqs. (1)-(8);
                       the model of this project, so it needs no change

The first two are effects of the same kind as those of the catalogue, so that a diagnosis can take them as rivals, but they are no
physics that a spindle could have: they stand here and not there. Applied after a scene's own effects.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from thermospindle.model.bearing.pair import BearingState, PairState, bearing_state, contact_status
from thermospindle.model.bearing.row import reference_deformation, reference_motion
from thermospindle.model.machine import Bearing, Condition, RingMotion, Spindle
from thermospindle.sim.effects.effect import Effect, Parameter, Values


@dataclass(frozen=True, eq=False)
class Form:
    """A model form: its name and the effects, fully applied, that turn the model of this project into it."""

    name: str
    effects: tuple[Effect, ...]

    @property
    def applied(self) -> tuple[tuple[Effect, Values], ...]:
        return tuple((e, e.typical()) for e in self.effects)


def _at_reference(spindle: Spindle, condition: Condition, values: Values, by_bearing: dict[str, RingMotion]) -> dict[str, RingMotion]:
    share = values["share"]
    if share == 0.0:
        return by_bearing
    still = reference_motion(spindle.reference_temperature)
    if share == 1.0:
        return {name: still for name in by_bearing}
    return {name: _between(motion, still, share) for name, motion in by_bearing.items()}


def _between(motion: RingMotion, still: RingMotion, share: float) -> RingMotion:
    names = [f.name for f in fields(RingMotion)]
    return RingMotion(**{n: (1 - share) * getattr(motion, n) + share * getattr(still, n) for n in names})


def _held_axially(spindle: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
    share = values["share"]
    if share == 0.0:
        return state
    bearings = tuple(_held(spindle, spindle.bearing(b.name), b, share) for b in state.bearings)
    return replace(state, bearings=bearings, hub_movement=(1 - share) * state.hub_movement, status=contact_status(bearings))


def _held(spindle: Spindle, drawing: Bearing, b: BearingState, share: float) -> BearingState:
    """The bearing with its groove centres' axial distance brought back to the reference state's by `share`."""
    reference = (drawing.unloaded_distance + reference_deformation(spindle, drawing)) * np.sin(drawing.contact_angle)
    row = replace(b.row, axial=float((1 - share) * b.row.axial + share * drawing.sense * reference))
    return bearing_state(spindle, drawing, row)


def _share(meaning: str) -> tuple[Parameter, ...]:
    return (Parameter("share", "1", 0.0, 1.0, 0.5, (0.0, 1.0), meaning, "a model form: 0 the full equilibrium, 1 the earlier form"),)


FIXED_STIFFNESS = Effect(
    name="fixed_stiffness",
    title="Bearing stiffness fixed at the reference temperature",
    equation="ring motion -> (1 - share) ring motion: no race, groove or ball moves or warms, so k(T) = k(T_ref)",
    parameters=_share("how far the bearings stay as at the reference temperature"),
    sees="bearing modes do not move with temperature at all",
    resembles=("constant_force_preload", "soak_lag", "radial_expansion"),
    valid="for comparison with the literature: no spindle with parts of different expansion does this",
    motions=_at_reference,
)

RADIAL_EXPANSION = Effect(
    name="radial_expansion",
    title="Radial thermal expansion only, the hub held axially",
    equation=(
        "axial distance of the groove centres -> (1 - share) that of the balanced pair + share (A + d_ref) sin(alpha_ref); the radial "
        "distance, grooves and balls as grown; the axial forces of the two rows need not balance (Jang et al. 2003, Eq. 1, without "
        "its axial terms)"
    ),
    parameters=_share("how far the rows keep the axial distance of the reference state"),
    sees="bearing modes fall with temperature by another amount than with the hub in balance, and the two rows carry unequal forces",
    resembles=("expansion_mismatch", "clearance_opening", "preload_loss"),
    valid="for comparison with the literature: a hub that only the bearings hold cannot stay where their forces do not balance",
    pair=_held_axially,
)

FORMS = (Form("fixed stiffness", (FIXED_STIFFNESS,)), Form("radial expansion only", (RADIAL_EXPANSION,)), Form("axial equilibrium", ()))
"""In the order in which the literature took them in."""
AS_DRAWN, EULER_BERNOULLI = "as drawn", "Euler-Bernoulli beam"


def forms_of(spindle: Spindle) -> tuple[Form, ...]:
    """The forms in which models of this spindle differ: of one without rolling bearings, which no
    thermal motion changes, there is one, as drawn."""
    if spindle.rolling:
        return FORMS
    shafts = spindle.structure.shafts
    plain = bool(shafts) and all(s.shear == s.rotary == 0.0 for s in shafts)
    return (Form(EULER_BERNOULLI if plain else AS_DRAWN, ()),)
