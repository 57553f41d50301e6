"""The hub's rim tilts on its web, or its rings in their seats: parts of the hub follow each other only through compliant metal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import Element, RotorBase
from thermospindle.model.structure import Body
from thermospindle.sim.effects.bearing.bond_softening import in_series
from thermospindle.sim.effects.effect import Effect, Parameter, Values, mass_ratio
from thermospindle.sim.effects.roles import body, lacking

TILTS = np.array([0.0, 0.0, 0.0, 1.0, 1.0])
DAMPING_RATIO = 0.002
"""Of the web at the structure's damping frequency: half a loss factor of 0.004, a metal part with pressed-on rings."""


def chain(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase) -> RotorBase:
    drawn = body(spindle, "hub")
    if values["compliance"] == 0.0 or drawn is None or idle(spindle) is not None:
        return chain
    seats, compliance = values["seat_share"] * values["compliance"] * 1e-6, (1 - values["seat_share"]) * values["compliance"] * 1e-6
    if seats > 0.0:
        chain = replace(chain, elements=tuple(seated(e, seats) if e.group == "bearings" else e for e in chain.elements))
    if compliance == 0.0:
        return chain
    hub = chain.body(drawn.name)
    middle, rim = divided(hub, values["rim_share"])
    stiffness = np.diag([0.0, 0.0, 0.0, 1 / compliance, 1 / compliance])
    damping = 2 * DAMPING_RATIO / (2 * np.pi * spindle.structure.damping_frequency) * stiffness
    web = Element(f"{hub.name} web", "hub", hub.name, rim.name, hub.z, stiffness, damping)
    bodies = tuple(middle if b.name == hub.name else b for b in chain.bodies)
    return replace(chain, bodies=(*bodies, rim), elements=(*chain.elements, web))


def idle(spindle: Spindle) -> str | None:
    hub = body(spindle, "hub")
    return None if hub is not None and hub.turns else lacking("turning body", "hub")


def sized(spindle: Spindle) -> Mapping[str, float]:
    """A like web twice as long is eight times as stiff against tilt."""
    return {"compliance": 1 / mass_ratio(spindle)}


def seated(bearing: Element, compliance: float) -> Element:
    """The bearing with its ring tilting in a seat of a compliance (rad/(N m)) without losses of its own."""
    stiffness, damping = in_series(bearing.stiffness, bearing.damping, compliance * TILTS, 0.0, 1.0)
    return replace(bearing, stiffness=stiffness, damping=damping)


def divided(hub: Body, share: float) -> tuple[Body, Body]:
    """The hub's middle and a flat rim with `share` of its polar inertia, which only tilts.

    The rim's centre moves with the hub: its mass stays there, so that both together are the hub when they tilt alike.
    """
    polar = share * hub.inertia[2]
    middle = (hub.inertia[0] - polar / 2, hub.inertia[1] - polar / 2, hub.inertia[2] - polar)
    rim = Body(f"{hub.name} rim", share * hub.mass, (polar / 2, polar / 2, polar), hub.z, ("tilt_x", "tilt_y"), True, ())
    return replace(hub, inertia=middle), rim


EFFECT = Effect(
    name="hub_flexibility",
    title="The hub's rim tilts on a compliant web",
    equation=(
        "I_rim theta_r'' + G_rim theta_r' + k (theta_r - theta_h) = 0, I_rim = rim_share I_p / 2 about a diameter and "
        "rim_share I_p about the axis, taken off the hub; k = 1 / ((1 - seat_share) compliance), "
        "and every ring tilts in the hub by seat_share compliance, K (1 + C K)^-1; below resonance the hub's inertia grows: "
        "I(w) = I_h + I_rim / (1 - w^2 I_rim / k); annular web k = E t^3 / alpha (Roark & Young, Formulas for Stress and Strain, 1989)"
    ),
    parameters=(
        Parameter(
            "compliance",
            "urad/(N m)",
            neutral=0.0,
            typical=100.0,
            prior_sd=70.0,
            limits=(0.0, 5000.0),
            meaning="tilt of the rim against the hub's middle by a moment",
            source=(
                "aluminium web 3 mm thick from 7.5 to 14.5 mm radius, clamped at both: 37 urad/(N m) by thin-plate theory; "
                "shear and the give of its root make it two to three times that"
            ),
        ),
        Parameter(
            "rim_share",
            "1",
            neutral=0.63,
            typical=0.63,
            prior_sd=0.15,
            limits=(0.05, 0.95),
            meaning="share of the hub's polar inertia that is on the rim",
            source="yoke, magnet and the plate beyond the hub body of a disk-drive hub: 63 % by its section",
        ),
        Parameter(
            "seat_share",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=1.0,
            limits=(0.0, 1.0),
            meaning="share of the compliance that is between the rings and the hub, not between hub and rim",
            source="assumed: none, the hub is thick where it holds the rings",
        ),
    ),
    sees="rocking modes lower, the higher the mode the more, at every temperature; their split with speed changes; axial modes stay",
    resembles=("shaft_bending", "added_disk", "bearing_misalignment"),
    valid="below the rim's own tilting (15 kHz at typical values), which is a mode of the model too; axial and lateral give left out",
    chain=chain,
    idle=idle,
    sized=sized,
)
