"""Friction heat of a ball bearing by Palmgren's torque: Harris, Rolling Bearing Analysis, 4th ed. (2001), ch. 14.

M0 = 1e-7 f0 (nu n)^(2/3) d_m^3 where nu n >= 2000, else 160e-7 f0 d_m^3; M1 = f1 P1 d_m; with N mm, mm, rpm of the
rings against each other and mm2/s (the base oil's for grease). P1 = max(0.9 F_a cot alpha - 0.1 F_r, F_r) of a ball
row, and the sum of the contact loads of cylindrical rollers. f0 is 2 for greased single-row angular contact; f1 = z
(Fs/Cs)^y, 0.001 and 0.33 for them: a share of the static load rating, so far below 0.001 under a light preload.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import scipy

from thermospindle.model.bearing.pair import PairState
from thermospindle.model.bearing.roller import roller_state
from thermospindle.model.drawing.heating import Friction
from thermospindle.model.machine import Bearing, RollerBearing, Spindle
from thermospindle.model.types import Array
from thermospindle.model.units import RPM


def torque(friction: Friction, bearing: Bearing | RollerBearing, speed: float, temperature: float, load: float) -> float:
    """Friction torque (N m, not negative) at `speed` (rad/s) of the rings against each other,
    `temperature` of the lubricant (C) and `load` P1 (N), as `loads` tells it.

    OutsideRange where the viscosity law does not reach. A bearing at rest gets its starting torque; it makes no heat.
    """
    return viscous_torque(friction, bearing, speed, temperature) + friction.f1 * abs(load) * bearing.pitch_diameter


def viscous_torque(friction: Friction, bearing: Bearing | RollerBearing, speed: float, temperature: float) -> float:
    """M0 (N m): churning and shearing of the lubricant."""
    product = friction.viscosity(temperature) * 1e6 * abs(speed) / RPM
    factor = 160e-7 if product < 2000 else 1e-7 * product ** (2 / 3)
    return factor * friction.f0 * (bearing.pitch_diameter * 1e3) ** 3 * 1e-3


def heat(friction: Friction, bearing: Bearing | RollerBearing, speed: float, temperature: float, load: float) -> float:
    """Friction heat (W): torque times speed."""
    return torque(friction, bearing, speed, temperature, load) * abs(speed)


def load(bearing: Bearing, axial: float, radial: float = 0.0) -> float:
    """P1 (N) of a ball row under an `axial` and a `radial` force (N), at its nominal contact angle."""
    return max(0.9 * abs(axial) / float(np.tan(bearing.contact_angle)) - 0.1 * radial, radial)


def loads(spindle: Spindle, state: PairState | None = None) -> dict[str, float]:
    """P1 (N) by bearing in a state; preloaded at the reference temperature where none is given."""
    if state is None:
        rollers = {b.name: roller_state(spindle, b, None, spindle.reference_temperature) for b in spindle.roller_bearings}
        return {b.name: load(b, b.preload) for b in spindle.bearings} | {name: r.load for name, r in rollers.items()}
    balls = {b.name: load(spindle.bearing(b.name), b.preload, float(np.hypot(*b.radial_force))) for b in state.bearings}
    return balls | {name: r.load for name, r in state.rollers.items()}


def balanced(
    friction: Friction, bearings: Sequence[Bearing | RollerBearing], speeds: Sequence[float], loads: Mapping[str, float], cold: Array, gain: Array
) -> Array:
    """Friction heat H (bearings,) in W with t = cold + gain H(t), t the temperatures (C) of the
    lubricant, `speeds` of the rings against each other, `gain` (bearings, bearings) in K/W.

    Bearing after bearing, each by bracketing: friction falls with temperature and `gain` is symmetric and positive, so this
    is a descent on a convex function. OutsideRange where the viscosity law does not reach the answer.
    """
    warmest = friction.viscosity.temperature[-1] if len(friction.viscosity.value) > 1 else np.inf

    def made(k: int, t: float) -> float:
        return heat(friction, bearings[k], speeds[k], t, loads[bearings[k].name])

    found = np.zeros(cold.size)
    for _ in range(200):
        before = found.copy()
        for k, own in enumerate(np.diag(gain)):
            base = float(cold[k] + gain[k] @ found - own * found[k])
            most = base + 1.01 * own * made(k, base)  # friction jumps up by 0.8 % where nu n falls below 2000
            if most > warmest > base and warmest - base >= own * made(k, warmest):
                most = warmest  # the root is inside the viscosity table though the bracket is not
            found[k] = made(k, scipy.optimize.brentq(lambda t, k=k, own=own, base=base: t - base - own * made(k, t), base, most, xtol=1e-12))
        if np.abs(gain @ (found - before)).max() < 1e-10:
            return found
    raise RuntimeError("bearing friction and temperature did not settle")
