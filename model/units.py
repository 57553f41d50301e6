"""Units in which people write and read; everything inside is SI. Multiply to come in, divide to go out."""

import numpy as np

RPM = 2 * np.pi / 60
"""rad/s of one revolution per minute."""
HERTZ = 2 * np.pi
"""rad/s of one cycle per second."""
DEGREE = np.pi / 180
"""rad."""
MINUTE = 60.0
"""s."""
MM, NM = 1e-3, 1e-9
"""m."""
TO_MM, TO_UM, TO_NM = 1e3, 1e6, 1e9
"""A length in m, to show."""


def in_rpm(speed: float) -> float:
    """A speed (rad/s) in rpm as it was given: to 12 significant digits, for 24000 rpm to rad/s and back is 24000.000000000004."""
    return float(f"{speed / RPM:.12g}")


def small_length(length: float, least: str = "nm") -> str:
    """A length (m) in words, to three digits: in the `least` unit, or in um or mm from 1000 of the one below on."""
    units = {"nm": TO_NM, "um": TO_UM, "mm": TO_MM}
    for unit in list(units)[list(units).index(least) :]:
        if abs(units[unit] * length) < 999.5 or unit == "mm":
            break
    return f"{units[unit] * length:.3g} {unit}"
