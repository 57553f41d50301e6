"""The air in the narrow gap under the turning hub is squeezed out and in as the hub moves: a damper that the model leaves out."""

from dataclasses import replace

import numpy as np

from thermospindle.model.rotor.chain import Element
from thermospindle.sim.effects.bearing.magnetic_pull import magnet_height, stator_body
from thermospindle.sim.effects.effect import Effect, Parameter


def viscosity(temperature):
    """Of air, relative to 20 C: Sutherland's law, mu ~ T^(3/2) / (T + 110.4 K)."""
    kelvin = np.array([temperature, 20.0]) + 273.15
    return float(np.divide(*(kelvin**1.5 / (kelvin + 110.4))))


def chain(spindle, condition, values, chain):
    c = values["damping"] * viscosity(condition.temperature)
    if c == 0.0:
        return chain
    damping = np.diag([0.0, 0.0, c, *2 * [c * (values["radius"] * 1e-3) ** 2 / 2]])
    ends = stator_body(spindle), spindle.structure.outer_body
    film = Element("air film", "air", *ends, magnet_height(spindle), np.zeros((5, 5)), damping)
    return replace(chain, elements=(*chain.elements, film))


EFFECT = Effect(
    name="air_film", title="Squeezed air in the gap under the hub",
    equation="ring of width b and gap h, Reynolds: c_z = 2 pi radius mu b^3 / h^3, c_tilt = c_z radius^2 / 2; mu(T) Sutherland's",
    parameters=(  # name, unit, neutral, typical, prior_sd, limits, meaning, source
        Parameter("damping", "N s/m", 0.0, 2.0, 2.0, (0.0, 50.0), "axial damping c_z at 20 C", "1.5 mm rim, 15 mm radius, 14 um gap: 2.0"),
        Parameter("radius", "mm", 15.0, 15.0, 1.0, (1.0, 100.0), "mean radius of the gap", "the rim of the reference spindle's hub"),
    ),
    sees="more damping of the modes that move the hub along and about the axis, a tenth more at 60 C than at 20 C",
    resembles=("grease_damping", "window_damping"), valid="squeeze number 12 mu omega b^2 / (p h^2) below one: no air spring", chain=chain,
)  # fmt: skip
