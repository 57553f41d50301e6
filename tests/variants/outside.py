"""Effects that no catalogue lists: what a diagnosis must not name something else for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from model.ball_row import Array, kinematics
from model.machine import Body, Condition, RingMotion, Spindle
from model.modes import ComplexArray
from model.pair import BearingState, PairState
from model.rotor_base import Element, RotorBase
from sim.effect import Measurement
from tests.variants.variant import each_bearing, each_element, in_series, step, turning, variant, warm, with_joint, with_stiffness

AXIAL = np.diag([0.0, 0.0, 1.0, 0.0, 0.0])


def on_spring(chain: RotorBase, host: str, name: str, mass: float, frequency: float, damping_ratio: float) -> RotorBase:
    """A mass on an axial spring on a body."""
    omega = 2 * np.pi * frequency
    body = Body(name, mass, (0.0, 0.0, 0.0), 0.0, ("z",), False, ())
    spring = Element(name, "base", host, name, 0.0, mass * omega**2 * AXIAL, 2 * damping_ratio * mass * omega * AXIAL)
    return replace(chain, bodies=(*chain.bodies, body), elements=(*chain.elements, spring))


def cable(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """A cable of `size` g on the plate, 1350 Hz, 5 % damped, softer by a fifth at 60 C."""
    return on_spring(chain, "seat", "cable", 1e-3 * size, 1350 * (1 - 0.1 * warm(condition.temperature)), 0.05) if size else chain


def table(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """The mount stands on a table whose compliance is `size` of the mount's, 6 kg heavy."""
    if size == 0:
        return chain
    mount = next(e for e in chain.elements if e.name == "mount")
    k = mount.stiffness[2, 2] / size
    body = Body("table", 6.0, (0.0, 0.0, 0.0), -0.1, ("z",), False, ())
    legs = Element("legs", "base", "ground", "table", -0.1, k * AXIAL, 2 * 0.03 / (2 * np.pi * 1000) * k * AXIAL)
    elements = tuple(replace(e, a="table") if e.name == "mount" else e for e in chain.elements)
    return replace(chain, bodies=(body, *chain.bodies), elements=(legs, *elements))


def missing_ball(spindle: Spindle, condition: Condition, size: float, state: PairState) -> PairState:
    """One ball of the upper row carries (1 - size) of its share; the others share the rest, k ~ F^(1/3)."""

    def change(b: BearingState) -> BearingState:
        if b.name != "upper" or size == 0:
            return b
        c, s, sign = np.cos(b.contact_angle), np.sin(b.contact_angle), np.sign(b.row.axial)
        along, across = np.array([-c, sign * s]), np.array([sign * s, c])
        length = b.row.unloaded_distance + b.deformation
        local = b.ball_stiffness * np.outer(along, along) + b.contact_force / length * np.outer(across, across)
        ball = kinematics(b.row)[0].T @ local @ kinematics(b.row)[0]
        n = b.row.balls
        return with_stiffness(b, (b.stiffness - size * ball) * (n / (n - size)) ** (1 / 3))

    return each_bearing(state, change)


def cracked_plate(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    """Above 45 C a crack opens and the plate tilts more easily about x."""
    return with_joint(spindle, "plate", (1, 1, 1, 1 - size * step(condition.temperature, 45, 55), 1))


def air_film(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """Air between turning hub plate and seat: `size` N/um axially at 7200 rpm, on a radius of 11 mm, and its damping."""
    k = 1e6 * size * turning(condition.speed)
    stiffness = np.diag([0.0, 0.0, k, k * 11e-3**2 / 2, k * 11e-3**2 / 2])
    air = Element("air film", "bearings", "seat", "hub", 4e-3, stiffness, stiffness * 3e-5)
    return replace(chain, elements=(*chain.elements, air)) if k else chain


def rubber_feet(spindle: Spindle, condition: Condition, size: float, chain: RotorBase) -> RotorBase:
    """Standard linear solid in series with the mount, `size` of its compliance at 20 C and slow; it relaxes ten times faster every 30 K.

    Taken at 1 kHz, where the mode of the base lies: 1 / (1 + g i w tau / (1 + i w tau)) with g = 4.
    """
    if size == 0:
        return chain
    mount = next(e for e in chain.elements if e.name == "mount")
    iwt = 2j * np.pi * 1000 * 1e-4 * 10 ** (-(condition.temperature - 20) / 30)
    complex_compliance = size / mount.stiffness[2, 2] / (1 + 4 * iwt / (1 + iwt))
    real, loss = complex_compliance.real, -complex_compliance.imag / complex_compliance.real
    compliance = real * (1 + loss**2) * AXIAL  # in_series divides by 1 + i loss
    return each_element(chain, ("mount",), lambda e: in_series(e, compliance, loss, 1000.0))


def swollen_rings(spindle: Spindle, condition: Condition, size: float, motions: dict[str, RingMotion]) -> dict[str, RingMotion]:
    """Wet adhesive squeezes the upper outer ring by `size` um of radius when warm and dries at 60 C to three fifths of that."""
    squeeze = 1e-6 * size * float(np.interp(condition.temperature, [20, 50, 60], [0.0, 1.0, 0.6]))
    return motions | {"upper": replace(motions["upper"], outer_r=motions["upper"].outer_r - squeeze)}


def curing_flange(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    """The adhesive of the flange cures on above 40 C: stiffer, less damped."""
    part = size * step(condition.temperature, 40, 60)
    return with_joint(spindle, "flange", (1 + part,) * 5, 1 - part / (1 + part))


def servo_coil(spindle: Spindle, condition: Condition, size: float) -> Spindle:
    """A coil holds the plate about y while the spindle runs."""
    return with_joint(spindle, "plate", (1, 1, 1, 1, 1 + size * (condition.speed != 0)))


def thermometer(spindle: Spindle, condition: Condition, size: float, by_region: dict[str, float]) -> dict[str, float]:
    """The chamber's thermometer reads `size` K too little at 40 C and is right at 20 and 60 C."""
    error = size * (1 - ((condition.temperature - 40) / 20) ** 2)
    return {name: t + error for name, t in by_region.items()}


def crossed_axes(spindle: Spindle, condition: Condition, size: float, chain: RotorBase, m: Measurement) -> Measurement:
    """The sensors on hub_side0 and hub_side90 are turned into each other by `size` degrees."""
    rows, turn = m.response_rows.copy(), np.radians(size)
    rows[2] = np.cos(turn) * m.response_rows[2] + np.sin(turn) * m.response_rows[0]
    rows[3] = np.cos(turn) * m.response_rows[3] + np.sin(turn) * m.response_rows[1]
    return replace(m, response_rows=rows)


def roll_off(size: float, temperature: float, frequency: Array, frf: ComplexArray) -> ComplexArray:
    """A first-order low pass in all channels, `size` us slow."""
    return np.asarray(frf / (1 + 2j * np.pi * frequency * 1e-6 * size))


def warm_hammer(spindle: Spindle, condition: Condition, size: float, chain: RotorBase, m: Measurement) -> Measurement:
    """The hammer's force cell loses sensitivity when warm: all FRFs grow by `size` at 60 C."""
    return replace(m, gain=m.gain * (1 + size * warm(condition.temperature)))


def brinelled(spindle: Spindle, condition: Condition, size: float, state: PairState) -> PairState:
    """Dents in the lower race stretch along x: softer there, in translation and in tilt about y, by `size`, and half of it across."""
    soft = np.sqrt(1 - size * np.array([1.0, 0.5, 0.75, 0.5, 1.0]))
    return each_bearing(state, lambda b: with_stiffness(b, b.stiffness * np.outer(soft, soft)) if b.name == "lower" else b)


OUTSIDE = (
    variant("outside/cable", "a loose cable on the plate, a tuned absorber", "g", 0.1, 3.0, chain=cable),
    variant("outside/table", "a table under the mount", "1", 0.01, 0.15, chain=table),
    variant("outside/missing_ball", "a ball of the upper bearing is missing", "1", 0.3, 1.0, pair=missing_ball),
    variant("outside/cracked_plate", "a crack opens in the plate above 45 C", "1", 0.005, 0.15, spindle=cracked_plate),
    variant("outside/air_film", "an air film under the hub", "N/um", 0.02, 0.6, chain=air_film),
    variant("outside/rubber_feet", "rubber feet", "1", 0.02, 0.2, chain=rubber_feet),
    variant("outside/swollen_rings", "wet adhesive squeezes the upper ring", "um", 0.02, 0.4, motions=swollen_rings),
    variant("outside/curing_flange", "adhesive in the flange cures on when hot", "1", 0.01, 0.2, spindle=curing_flange),
    variant("outside/servo_coil", "a coil holds the plate while it runs", "1", 0.004, 0.1, spindle=servo_coil),
    variant("outside/thermometer", "a crooked thermometer", "K", 1.0, 10.0, temperatures=thermometer),
    variant("outside/crossed_axes", "two sensors turned askew", "deg", 2.0, 15.0, measurement=crossed_axes),
    variant("outside/roll_off", "the sensors' first-order roll-off", "us", 2.0, 40.0, record=roll_off),
    variant("outside/warm_hammer", "a hammer that is temperature-dependent", "1", 0.01, 0.15, measurement=warm_hammer),
    variant("outside/brinelled", "dents in the lower race", "1", 0.03, 0.3, pair=brinelled),
)
