"""Cylindrical roller rows: line contacts in slices along the rollers, with clearance, and their stiffness at a displacement.

A roller that the rings press by d (both contacts) carries Q = c d^(10/9), c = 35 948 L^(8/9) in N and mm for steel
(ISO/TS 16281:2008, 4.4, from Palmgren's 3.84e-5 Q^0.9 / L^0.8 mm a contact; Harris, Rolling Bearing Analysis, 4th
ed. 2001, Eq. 6.54). Written Q = e E' L^2 (d / L)^(10/9), it holds for other moduli too. Each roller is cut into
slices that respond by themselves (the lamina model of ISO/TS 16281), which gives the moment against tilt; its ends
are taken as straight to the edge. With centred rings each roller is pressed by half the negative clearance.

Rings that are displaced press some of the rollers, and which depends on where the cage stands: nobody knows that of a
shaft at rest, and a turning one passes all places. Forces are those of rollers spread evenly over the load zone, the mean
over all places of the cage (Sjovall's integral, slice by slice: Harris, ch. 7.4), smooth in the displacement; a single
place has steps, for a roller that comes into contact is stiff at once, as d^(1/9). `with_cage_at` is such a place.

Clearance follows the races and the rollers: c(T) = c0 + 2 (u_outer - u_inner) - 2 D strain_roller,
u the races' radial motions. Pressed rollers widen the outer race and narrow the inner one: c = c(T)
+ g sum(Q), g the races' give, with the loads of centred rings (rings stay round).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

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
ACROSS = [0, 1, 3, 4]
"""Of a displacement, what moves rollers."""
SLICES, WEIGHTS = np.polynomial.legendre.leggauss(15)
"""Places over half the length, and twice the shares of it."""
_NODES, _SHARES = np.polynomial.legendre.leggauss(20)
TURNS = 24
"""Places of the cage from one roller to the next at which a row is asked how far it departs from its mean."""
EDGE = 4
"""Places crowd at the edge of a load zone with this power, for stiffness goes there as the ninth
root: integrals to 1e-11 (`tests/model/test_roller.py`)."""
PLACES, SHARES = 1 - ((1 - _NODES) / 2) ** EDGE, _SHARES / 2 * EDGE * ((1 - _NODES) / 2) ** (EDGE - 1)
"""Places over half a load zone from its middle, and their shares."""


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
    """Answer at one displacement: `force` (5,) N, N m needed on the outer ring, its derivative
    `tangent` (5, 5), the sum of all contact loads (N)."""

    force: Array
    tangent: Array
    load: float


@dataclass(frozen=True)
class RollerState(LinearState):
    """A roller bearing at its operating point; `load` (N) is the sum of its contact loads, zero where it is loose."""

    clearance: float  # m, diametral
    load: float
    row: RollerRow
    displacement: tuple[float, ...] = (0.0,) * 5  # m, rad: of the outer ring against the inner one

    @cached_property
    def contact_force(self) -> float:
        """N, of the most loaded roller, which stands where the rings push; worked out for who asks, for no mode or FRF does."""
        u = np.array(self.displacement)
        force = respond(self.row, u).force
        return float(with_cage_at(self.row, u, float(np.arctan2(-force[1], -force[0])))[2].max())


def line_constant(length: float, modulus: float = STEEL) -> float:
    """c (N/m^(10/9)) of a roller of effective `length` (m) between two rings; `modulus` as of `STEEL` (Pa)."""
    millimetres = length * 1e3
    return float(ISO_CONSTANT * millimetres ** (8 / 9) * 1e3**EXPONENT * modulus / STEEL)


def respond(row: RollerRow, displacement: Array | None = None) -> RollerForce:
    """Forces and tangent at a displacement (5,) of the outer ring against the inner, order x, y, z,
    tilt_x, tilt_y: the mean over all places of the cage."""
    zones = _Zones(row, np.zeros(5) if displacement is None else np.asarray(displacement, float))
    slope = zones.share * zones.pressed ** (EXPONENT - 1)
    load = slope * zones.pressed
    along = EXPONENT * np.sum(slope * zones.cosine**2, axis=1)
    aside = EXPONENT * np.sum(slope, axis=1) - along
    (c, s), height = zones.deepest, zones.height
    deeper, beside = np.array([c, s, -s * height, c * height]), np.array([-s, c, -c * height, -s * height])  # radial motion of the outer ring there, and a quarter turn on
    force, tangent = np.zeros(5), np.zeros((5, 5))
    force[ACROSS] = -deeper @ np.sum(load * zones.cosine, axis=1)
    tangent[np.ix_(ACROSS, ACROSS)] = (deeper * along) @ deeper.T + (beside * aside) @ beside.T
    return RollerForce(force, tangent, float(load.sum()))


class _Zones:
    """The load zone of every slice of a row, at heights (slices,): where the rings press deepest, (2,
    slices) cosine and sine, and over half of the zone, for the other half is the same, cosines from
    there, what rollers are pressed by (m) and the constant that they have (N/m^(10/9)), (slices, places)."""

    def __init__(self, row: RollerRow, u: Array) -> None:
        self.height = (np.array(row.offsets)[:, None] + row.length / 2 * SLICES).ravel()
        moved = np.array([u[0] + u[4] * self.height, u[1] - u[3] * self.height])
        far, half = np.hypot(*moved), row.clearance / 2
        self.deepest = np.where(far > 0, -moved / np.where(far > 0, far, 1.0), [[1.0], [0.0]])
        zone = np.arccos(np.clip(half / np.maximum(far, 1e-300), -1, 1))[:, None]  # to either side
        self.cosine = np.cos(zone * PLACES)
        self.pressed = np.maximum(far[:, None] * self.cosine - half, 0.0)
        self.share = row.rollers * row.constant / 2 * np.tile(WEIGHTS, len(row.offsets))[:, None] * zone / np.pi * SHARES


def with_cage_at(row: RollerRow, displacement: Array, turn: float) -> tuple[Array, Array, Array]:
    """Force (5,), tangent (5, 5) and the load (rows, rollers) N of each roller at a displacement
    (5,), the first roller of each row `turn` rad from x."""
    outward, load, slope = at_azimuths(row, np.asarray(displacement, float), row.azimuths + turn)
    return -np.einsum("jbs,jbsk->k", load, outward), np.einsum("jbs,jbsk,jbsl->kl", slope, outward, outward), load.sum(axis=2).T


def at_azimuths(row: RollerRow, displacement: Array, azimuth: Array) -> tuple[Array, Array, Array]:
    """Of a roller of each row at every `azimuth` (n,), slice by slice: radial motion (n, rows, slices, 5) of the outer ring by
    its displacement, load (n, rows, slices) N, and the slope of that (N/m) by what presses the slice."""
    height = np.array(row.offsets)[:, None] + row.length / 2 * SLICES
    c, s = np.cos(azimuth)[:, None, None], np.sin(azimuth)[:, None, None]
    outward = np.zeros((len(azimuth), *height.shape, 5))
    outward[..., 0], outward[..., 1], outward[..., 3], outward[..., 4] = c, s, -s * height, c * height
    pressed = np.maximum(-(outward @ displacement) - row.clearance / 2, 0.0)
    load = row.constant * WEIGHTS / 2 * pressed**EXPONENT
    return outward, load, EXPONENT * load / np.where(pressed > 0, pressed, 1.0)


def cage_spread(row: RollerRow, displacement: Array) -> float:
    """By how much of itself the radial stiffness of a row whose rings stand at a displacement (5,)
    departs, at most, from its mean where the cage is at some place; 0 of one that carries nothing."""
    mean = respond(row, displacement).tangent
    turns = 2 * np.pi / row.rollers * np.arange(TURNS) / TURNS
    off = [abs(with_cage_at(row, displacement, turn)[1][i, i] / mean[i, i] - 1) for turn in turns for i in (0, 1) if mean[i, i] > 0]
    return float(max(off, default=0.0))


def energy(row: RollerRow, displacement: Array) -> float:
    """Elastic energy (J): sum of c d^(n + 1) / (n + 1), the mean over all places of the cage."""
    zones = _Zones(row, np.asarray(displacement, float))
    return float(np.sum(zones.share * zones.pressed ** (EXPONENT + 1))) / (EXPONENT + 1)


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
    """Clearance (m) c = clearance + give constant (-c / 2)^(10/9) of rollers pressed between races
    that give; `constant` (N/m^(10/9)) of all rollers."""
    if clearance >= 0 or give == 0.0:
        return clearance
    return float(scipy.optimize.brentq(lambda c: c - clearance - give * constant * (-c / 2) ** EXPONENT, clearance, 0.0, xtol=1e-15, rtol=1e-12))


def roller_state(spindle: Spindle, b: RollerBearing, motion: RingMotion | None, temperature: float) -> RollerState:
    """What a roller bearing is at a condition, centred."""
    return state_at(spindle, b, roller_row(spindle, b, motion, temperature))


def state_at(spindle: Spindle, b: RollerBearing, row: RollerRow, displacement: Array | None = None) -> RollerState:
    """What a bearing with these rollers is, centred or at a displacement (5,) of its outer ring against its inner one."""
    u = np.zeros(5) if displacement is None else displacement
    answer = respond(row, u)
    damping = spindle.structure.damping_time(b.damping_ratio) * answer.tangent
    return RollerState(b.name, b.z, answer.tangent, damping, row.clearance, answer.load, row, tuple(float(x) for x in u))
