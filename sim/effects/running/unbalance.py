"""The turning part is out of balance by more than its drawing allows."""

from __future__ import annotations

import cmath
from collections.abc import Mapping
from dataclasses import replace
from math import radians

from thermospindle.model.built.imperfections import Imperfections
from thermospindle.model.carrier import named, permissible_unbalance, unbalance_carrier
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.structure import Body
from thermospindle.model.units import RPM
from thermospindle.sim.effects.effect import REFERENCE_HUB, TURNING, Effect, Parameter, Values, mass_ratio, phase_parameter

G_MM, G_MM2 = 1e-6, 1e-9


def imperfections(spindle: Spindle, condition: Condition, values: Values, imperfections: Imperfections) -> Imperfections:
    if values["amount"] == 0.0 and values["couple"] == 0.0:
        return imperfections
    body = _on(spindle, imperfections)
    turn = cmath.rect(1.0, radians(values["phase"]))
    own = cmath.rect(imperfections.unbalance, imperfections.unbalance_phase)
    more = values["amount"] * G_MM * turn
    static = own + more
    # the scene's unbalance keeps its height: what moving it to the mass centre leaves is a couple
    couple = cmath.rect(imperfections.couple_unbalance, imperfections.couple_phase) + values["couple"] * G_MM2 * turn
    couple += own * (imperfections.unbalance_z - body.z)
    return replace(
        imperfections,
        unbalance=abs(static),
        unbalance_z=body.z,
        unbalance_phase=cmath.phase(static),
        couple_unbalance=abs(couple),
        couple_phase=cmath.phase(couple),
        unbalance_body=named(spindle, body),
    )


def _on(spindle: Spindle, imperfections: Imperfections) -> Body:
    """The body that the effect acts on: as vectors add up only unbalances that turn alike."""
    body = spindle.turning
    if imperfections.unbalance or imperfections.couple_unbalance:
        carrier = unbalance_carrier(spindle, imperfections)
        body = body if body.speed_ratio == carrier.speed_ratio else carrier
    return body


def sized(spindle: Spindle) -> Mapping[str, float]:
    """A balance grade allows mass over speed, both of what turns together."""
    if not spindle.structure.turns:
        return {}
    amount = permissible_unbalance(spindle, _on(spindle, spindle.imperfections), 1.0) / (REFERENCE_HUB / (7200 * RPM))
    return {"amount": amount, "couple": amount * mass_ratio(spindle) ** (1 / 3)}


EFFECT = Effect(
    name="unbalance",
    title="Unbalance of the turning part",
    equation="F = U omega^2 at the mass centre of the turning part (of several, of what turns as the scene's unbalance does), M = W omega^2, both turning with it; added to the scene's as vectors",
    parameters=(
        Parameter(
            "amount",
            "g mm",
            neutral=0.0,
            typical=0.5,
            prior_sd=0.5,
            limits=(0.0, 50.0),
            meaning="static unbalance beyond the scene's",
            source="ISO 21940-11:2016: a hub of 40 g at 7200 rpm in G 6.3 (not balanced further) may have 0.33 g mm, in G 16 0.85",
        ),
        phase_parameter("azimuth to which it points at time zero"),
        Parameter(
            "couple",
            "g mm2",
            neutral=0.0,
            typical=0.0,
            prior_sd=3.0,
            limits=(-500.0, 500.0),
            meaning="couple unbalance beyond the scene's, at the same azimuth",
            source="half the static prior times the distance of the bearings, as ISO 21940-11 shares a limit between two planes",
        ),
    ),
    sees="the once-per-revolution line (1x, forward) grows as the square of the speed; frequencies and damping of modes stay",
    resembles=("race_waviness",),
    valid="small eccentricity (the response is linear in it); an eccentric turning race has the same line, but hardly changes with speed",
    imperfections=imperfections,
    sized=sized,
    acts_on=(TURNING,),
)
