"""Cylindrical roller rows: line contacts in slices along the rollers, with clearance, and their stiffness at a displacement.

A roller that the rings press by d (both contacts) carries Q = c d^(10/9), c = 35 948 L^(8/9) in N and mm for steel (ISO/TS 16281:2008, 4.4, from
Palmgren's 3.84e-5 Q^0.9 / L^0.8 mm a contact; Harris, Rolling Bearing Analysis, 4th ed. 2001, Eq. 6.54). Written Q = e E' L^2 (d / L)^(10/9),
it holds for other moduli too. Each roller is cut into slices that respond by themselves (the lamina model of ISO/TS 16281), which gives the
moment against tilt; its ends are taken as straight to the edge. With centred rings each roller is pressed by half the negative clearance.

Clearance follows the races and the rollers: c(T) = c0 + 2 (u_outer - u_inner) - 2 D strain_roller, u the races' radial motions. Pressed
rollers widen the outer race and narrow the inner one: c = c(T) + g sum(Q), g the races' give, with the loads of centred rings (rings stay round).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from thermospindle.model.bearing.state import LinearState
from thermospindle.model.machine import RingMotion, RollerBearing, Spindle
from thermospindle.model.types import Array

EXPONENT = 10 / 9
ISO_CONSTANT = 35_948.0
"""N / mm^(10/9 + 8/9), of steel."""
STEEL = 206e9 / (2 * (1 - 0.3**2))
"""Pa: contact modulus, 1 / ((1 - nu^2) / E summed over both), of the steel for which the standard's constant holds."""
SLICES, WEIGHTS = np.polynomial.legendre.leggauss(15)
"""Places over half the length, and twice the shares of it."""


@dataclass(frozen=True)
class RollerRow:
    """Rollers at one condition: `constant` (N/m^(10/9)) of a whole roller, `offsets` (m) of the rows' middles from the bearing's."""

    rollers: int
    length: float
    constant: float
    clearance: float  # m, diametral
    offsets: tuple[float, ...]

    @property
    def azimuths(self) -> Array:
        return 2 * np.pi * np.arange(self.rollers) / self.rollers


@dataclass(frozen=True)
class RollerForce:
    """Answer at one displacement: `force` (5,) N, N m needed on the outer ring, its derivative `tangent` (5, 5), loads (rows, rollers) N."""

    force: Array
    tangent: Array
    roller_force: Array


@dataclass(frozen=True)
class RollerState(LinearState):
    """A roller bearing at its operating point; `load` (N) is the sum of its contact loads, zero where it is loose."""

    clearance: float  # m, diametral
    load: float
    contact_force: float  # N, of the most loaded roller
    row: RollerRow


def line_constant(length: float, modulus: float = STEEL) -> float:
    """c (N/m^(10/9)) of a roller of effective `length` (m) between two rings; `modulus` as of `STEEL` (Pa)."""
    millimetres = length * 1e3
    return float(ISO_CONSTANT * millimetres ** (8 / 9) * 1e3**EXPONENT * modulus / STEEL)


def respond(row: RollerRow, displacement: Array | None = None) -> RollerForce:
    """Forces and tangent at a displacement (5,) of the outer ring against the inner, order x, y, z, tilt_x, tilt_y."""
    u = np.zeros(5) if displacement is None else np.asarray(displacement, float)
    c, s = np.cos(row.azimuths), np.sin(row.azimuths)
    force, tangent, loads = np.zeros(5), np.zeros((5, 5)), []
    for offset in row.offsets:
        height = offset + row.length / 2 * SLICES  # (slices,)
        outward = np.zeros((row.rollers, SLICES.size, 5))  # radial motion of the outer ring by its displacement
        outward[:, :, 0], outward[:, :, 1] = c[:, None], s[:, None]
        outward[:, :, 3], outward[:, :, 4] = -s[:, None] * height, c[:, None] * height
        pressed = np.maximum(-(outward @ u) - row.clearance / 2, 0.0)
        share = row.constant * WEIGHTS / 2
        load = share * pressed**EXPONENT
        slope = np.where(pressed > 0, share * EXPONENT * np.maximum(pressed, 1e-30) ** (EXPONENT - 1), 0.0)
        force -= np.einsum("js,jsk->k", load, outward)
        tangent += np.einsum("js,jsk,jsl->kl", slope, outward, outward)
        loads.append(load.sum(axis=1))
    return RollerForce(force, tangent, np.array(loads))


def energy(row: RollerRow, displacement: Array) -> float:
    """Elastic energy (J): sum of c d^(n + 1) / (n + 1)."""
    c, s = np.cos(row.azimuths)[:, None], np.sin(row.azimuths)[:, None]
    x, y, _, tilt_x, tilt_y = displacement
    total = 0.0
    for offset in row.offsets:
        height = offset + row.length / 2 * SLICES
        pressed = np.maximum(-(c * (x + tilt_y * height) + s * (y - tilt_x * height)) - row.clearance / 2, 0.0)
        total += float((pressed ** (EXPONENT + 1) @ (WEIGHTS / 2)).sum())
    return row.constant * total / (EXPONENT + 1)


def roller_row(spindle: Spindle, b: RollerBearing, motion: RingMotion | None, temperature: float) -> RollerRow:
    """The rollers of a bearing whose rings have moved by `motion`; without rings in the section its clearance stays."""
    at = temperature if motion is None else motion.temperature
    softness = 0.0
    for name in (b.roller_material, b.ring_material):
        material = spindle.materials[name]
        softness += (1 - material.poisson_ratio**2) / material.youngs_modulus(at)
    clearance = b.clearance
    if motion is not None:
        clearance += 2 * (motion.outer_r - motion.inner_r) - 2 * b.roller_diameter * motion.ball_strain
    constant = line_constant(b.roller_length, 1 / softness)
    clearance = eased(float(clearance), b.rows * b.rollers * constant, b.race_give)
    return RollerRow(b.rollers, b.roller_length, constant, clearance, b.offsets)


def eased(clearance: float, constant: float, give: float) -> float:
    """Clearance (m) c = clearance + give constant (-c / 2)^(10/9) of rollers pressed between races that give; `constant` (N/m^(10/9)) of all rollers."""
    if clearance >= 0 or give == 0.0:
        return clearance
    return float(scipy.optimize.brentq(lambda c: c - clearance - give * constant * (-c / 2) ** EXPONENT, clearance, 0.0, xtol=1e-15, rtol=1e-12))


def roller_state(spindle: Spindle, b: RollerBearing, motion: RingMotion | None, temperature: float) -> RollerState:
    """What a roller bearing is at a condition, centred."""
    return state_at(spindle, b, roller_row(spindle, b, motion, temperature))


def state_at(spindle: Spindle, b: RollerBearing, row: RollerRow, displacement: Array | None = None) -> RollerState:
    """What a bearing with these rollers is, centred or at a displacement (5,) of its outer ring against its inner one."""
    answer = respond(row, displacement)
    damping = 2 * b.damping_ratio / (2 * np.pi * spindle.structure.damping_frequency) * answer.tangent
    loads = answer.roller_force
    return RollerState(b.name, b.z, answer.tangent, damping, row.clearance, float(loads.sum()), float(loads.max()), row)
