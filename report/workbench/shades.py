"""Colours of the map of errors: those of the figures' maps on a light page, and on a dark one the same hues from its ground outwards."""

from __future__ import annotations

import numpy as np
from bokeh.palettes import RdBu11
from numpy.typing import ArrayLike

from thermospindle.model.types import Array
from thermospindle.report.typeset import LINEAR, SMALLEST

INK, PAPER = "#1b1c1d", "#ffffff"
DARK = "#17191b"  # the ground of the dark page


def _rgb(colour: str) -> Array:
    """Red, green and blue (3,), 0 to 1, of #rrggbb."""
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255


MIDDLE = 0.203  # relative luminance that has the same contrast to both inks
SCALE = np.array([_rgb(c) for c in RdBu11])  # blue for the most negative


def place(value: float, largest: float) -> float:
    """Where an error stands between -1 and 1: linear up to `LINEAR`, logarithmic beyond, as `report.figures.common.residual_norm` has it."""

    def bent(v: float) -> float:
        steep = 1 / (1 - 1 / 10)
        return steep * v / LINEAR if abs(v) <= LINEAR else float(np.sign(v)) * (steep + float(np.log10(abs(v) / LINEAR)))

    return bent(value) / bent(max(SMALLEST, largest))


def shades(value: float, largest: float) -> tuple[str, str, str, str]:
    """Colour of a cell and of the number in it on a light page, and both on a dark one.

    On the dark page lightness is turned about, hue kept (every channel moves by 1 - largest -
    smallest), and white becomes the page's ground.
    """
    light = np.array([np.interp(place(value, largest), np.linspace(-1, 1, len(SCALE)), channel) for channel in SCALE.T])
    ground = _rgb(DARK)
    dark = ground + (light + 1 - light.max() - light.min()) * (1 - ground)
    return hexadecimal(light), _ink(light), hexadecimal(dark), _ink(dark)


def hexadecimal(rgb: ArrayLike) -> str:
    """#rrggbb of red, green and blue, 0 to 1."""
    return "#" + "".join(f"{round(255 * float(v)):02x}" for v in np.asarray(rgb))


def _ink(rgb: Array) -> str:
    """The one of the two inks with more contrast (WCAG 2.2, relative luminance) to a cell."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return PAPER if float(np.dot((0.2126, 0.7152, 0.0722), linear)) < MIDDLE else INK
