"""Numbers as a page shows them: true minus signs, signs, standard errors to their own digit."""

from __future__ import annotations

import re

import numpy as np
from markupsafe import Markup, escape


def minus(text: str) -> str:
    """A true minus before digits, and units kept on the line of their number."""
    return re.sub(r"(?<=\d) (?=(%|Hz|N|°C)\b|%)", "\u00a0", re.sub(r"(?<![\w-])-(?=\d)", "−", text))


def prose(text: str) -> str:
    """Plain words of the terminal as HTML: escaped, with true minus, plus-minus and arrow."""
    return minus(str(escape(text))).replace("+-", "±").replace("-&gt;", "→")


def signed(value: float, digits: int = 1) -> str:
    return minus(f"{round(value, digits) + 0.0:+.{digits}f}")  # + 0.0: never -0.0


def with_error(pair: tuple[float, float] | None, sign: bool = False, digits: int = 1) -> Markup:
    """A number with its standard error, to the error's first digit (two, if that is a one); an en dash for no number."""
    if pair is None:
        return Markup("–")
    value, error = pair
    if not 0 < error < np.inf:
        return Markup(minus(f"{value:{'+' if sign else ''}.{digits}f}"))
    digits = int(np.clip(-np.floor(np.log10(error / 2)), 0, 5))
    return Markup(minus(f"{value:{'+' if sign else ''}.{digits}f}") + f" <small>± {error:.{digits}f}</small>")
