"""The adhesive between rings and their seats is a compliance in series with the bearing, and softens through its glass transition."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from thermospindle.model.bearing.pair import PairState
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array
from thermospindle.sim.effects.effect import ROWS, Effect, Parameter, Values, chosen, which_parameter

HELD = np.array([1.0, 1.0, 1.0, 0.0, 0.0])
"""Motions in which the bond gives, in the order of MOVES: the ring's length in its seat keeps it from tilting."""


def pair(spindle: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
    give = compliance(condition.temperature, values)
    if give == 0.0:
        return state
    omega = 2 * np.pi * spindle.structure.damping_frequency
    bearings, bonded = [], chosen(values, "bearing", [b.name for b in spindle.bearings])
    for b in state.bearings:
        if b.name not in bonded:
            bearings.append(b)
            continue
        stiffness, damping = in_series(b.stiffness, b.damping, give * HELD, values["loss_factor"], omega)
        bearings.append(replace(b, stiffness=stiffness, damping=damping))
    return replace(state, bearings=tuple(bearings))


def compliance(temperature: float, values: Values) -> float:
    """Compliance (m/N) of one ring's bond, radial and axial alike: 1 / (k_hot + (k_cold - k_hot) / (1 + exp((T - T_g) / w)))."""
    glassy = 0.5 * (1 - np.tanh((temperature - values["transition"]) / (2 * values["width"])))
    return float(values["hot_compliance"] * 1e-9 / (1 + (values["cold_ratio"] - 1) * glassy))


def in_series(stiffness: Array, damping: Array, give: Array, loss_factor: float, omega: float) -> tuple[Array, Array]:
    """Stiffness and damping (n, n) of a bearing in series with a diagonal compliance `give` (n,).

    K_s = (1 + K C)^-1 K; the complex stiffness K + i omega D with C / (1 + i eta), to first order in both, has the imaginary part
    (1 + K C)^-1 omega D (1 + C K)^-1 + eta K_s C K_s, which keeps damping matrices positive.
    """
    transmit = np.linalg.inv(np.eye(len(give)) + stiffness * give)  # K C with C diagonal; regular for positive K though K nearly is not
    series = transmit @ stiffness
    series = (series + series.T) / 2
    return series, transmit @ damping @ transmit.T + loss_factor / omega * (series * give) @ series


def sized(spindle: Spindle) -> Mapping[str, float]:
    """A bond as thick round a ring gives in inverse proportion to the area of its seat."""
    return {"hot_compliance": (9.1e-3 / spindle.bearings[-1].pitch_diameter) ** 2}


EFFECT = Effect(
    name="bond_softening",
    title="The bond between bearing rings and their seats softens with temperature",
    equation=(
        "K_s = (1 + K C)^-1 K with C = diag(c, c, c, 0, 0), 1/c = k_hot + (k_cold - k_hot) / (1 + exp((T - T_g) / w)), "
        "k_hot = 1 / hot_compliance, k_cold = cold_ratio k_hot; "
        "D_s = (1 + K C)^-1 D (1 + C K)^-1 + (eta / omega_0) K_s C K_s, omega_0 = 2 pi damping_frequency"
    ),
    parameters=(
        Parameter(
            "hot_compliance",
            "nm/N",
            neutral=0.0,
            typical=12.5,
            prior_sd=8.0,
            limits=(0.0, 200.0),
            meaning="compliance of one ring's bond well above its glass transition, radial and axial alike",
            source=(
                "a 20 um layer of 0.1 GPa shear modulus on a ring 13 mm across and 3 mm wide gives 1.6 nm/N axially, a soft or "
                "partly wetted one ten times that"
            ),
        ),
        Parameter(
            "cold_ratio",
            "1",
            neutral=4.75,
            typical=4.75,
            prior_sd=2.0,
            limits=(1.0, 100.0),
            meaning="stiffness of the bond below its glass transition over that above it",
            source="assumed: within the one to two decades that a filled epoxy loses at most (Ferry, Viscoelastic Properties, 1980)",
        ),
        Parameter(
            "transition",
            "C",
            neutral=50.0,
            typical=50.0,
            prior_sd=10.0,
            limits=(-40.0, 200.0),
            meaning="glass transition temperature, middle of the softening",
            source="room-temperature-cured epoxies and anaerobics: 40 to 70 C by their makers' data sheets",
        ),
        Parameter(
            "width",
            "K",
            neutral=4.0,
            typical=4.0,
            prior_sd=2.0,
            limits=(0.5, 40.0),
            meaning="width of the transition; 80 % of the softening takes 4.4 widths",
            source="assumed: a transition 20 K wide, as dynamic mechanical analysis shows",
        ),
        Parameter(
            "loss_factor",
            "1",
            neutral=0.04,
            typical=0.04,
            prior_sd=0.03,
            limits=(0.0, 1.5),
            meaning="loss factor of the bond, its dissipation over its elastic force; 0.04 is the bearings' own, twice 0.020",
            source="0.02 glassy to above 0.5 in the transition (Nashif, Jones, Henderson, Vibration Damping, 1985)",
        ),
        which_parameter("bearing", "bearings", 2, "whose bond softens", "unknown before looking: one batch of adhesive holds all, or one ring is poorly wetted"),
    ),
    sees=(
        "rocking modes fall more than axial ones and mostly within a few kelvin about the transition, at any speed alike; damping "
        "rises with the loss factor"
    ),
    resembles=("preload_loss", "clearance_opening", "expansion_mismatch", "hertz_amplitude"),
    valid=(
        "thin bond, small motions, frequencies about the damping frequency; vibration only: the bond's give under thermal "
        "expansion and preload is left out, and so is its tilt"
    ),
    pair=pair,
    sized=sized,
    acts_on=(ROWS,),
)
