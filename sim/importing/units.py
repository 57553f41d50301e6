"""Units as laboratories write them: of FRFs, `(m/s^2)/N`, `g/lbf`, `1/kg`, and of single channels."""

from __future__ import annotations

import math
import re

from thermospindle.sim.campaign.uff import FORCE, KINDS, QUANTITIES

OF_TYPE = {number: quantity for quantity, number in QUANTITIES.items()}
BARE = {"1/kg": "accelerance", "kg^-1": "accelerance", "s/kg": "mobility"}
"""FRFs of SI units that are written without metre and newton."""
WORDS = {
    "receptance": "receptance", "compliance": "receptance", "admittance": "receptance", "displacement": "receptance",
    "mobility": "mobility", "velocity": "mobility", "accelerance": "accelerance", "inertance": "accelerance", "acceleration": "accelerance",
}  # fmt: skip
"""What an FRF or its numerator may be called."""
HERTZ = {
    "hz": 1.0, "hertz": 1.0, "1/s": 1.0, "khz": 1e3, "rad/s": 1 / (2 * math.pi), "rad/sec": 1 / (2 * math.pi), "rpm": 1 / 60, "1/min": 1 / 60,
}  # fmt: skip
SECONDS = {"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "msec": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6}
"""Factors of an axis to Hz and s, by its unit in small letters."""
FREQUENCIES, TIMES = "Hz, kHz, rad/s, rpm", "s, ms, us"
"""What messages say is allowed of them."""
GRAVITY = ("g", "G", "gn")


def tidy(text: str) -> str:
    """One way of writing for many: powers with ^, no spaces, no brackets around the whole."""
    text = text.strip().replace("²", "^2").replace("**", "^").replace("·", "*").replace(" ", "").replace("µ", "u").replace("μ", "u")
    text = re.sub(r"(?<=s)(2\b|[\ufffd≤])", "^2", text)  # m/s2, and the superscript in another encoding than the file's header is read in
    text = text.replace(")(", ")/(")  # (m/s^2)(N), as one analyser writes
    text = re.sub(r"^1/\(?(\w+)\)?\*\(?([^()]+)\)?$", r"(\2)/\1", text)  # (1/N)*(m/s^2)
    text = re.sub(r"^\(1/(\w+)\)\*\(?([^()]+)\)?$", r"(\2)/\1", text)
    return re.sub(r"^\((?P<all>[^()]*)\)$", r"\g<all>", text).replace("sec", "s").replace("/s/s", "/s^2")


def of_frf(text: str) -> tuple[str, float] | None:
    """(quantity, factor to SI) of an FRF's unit; None where it is none that is known."""
    clean = tidy(text)
    if clean in BARE:
        return BARE[clean], 1.0
    match = re.fullmatch(r"\(?(.+?)\)?/\(?([A-Za-z]+)\)?", clean)
    if match is None:
        return None
    response, force = of_response(match[1]), of_force(match[2])
    return None if response is None or force is None else (response[0], response[1] / force)


def of_response(text: str) -> tuple[str, float] | None:
    """(quantity, factor to SI) of a response channel's unit: an acceleration makes an accelerance."""
    clean = tidy(text)
    clean = GRAVITY[0] if clean in GRAVITY else clean
    for number, quantity in OF_TYPE.items():
        for label, factor in KINDS[number].units.items():
            if clean == tidy(label) and label:
                return quantity, factor
    return None


def known() -> str:
    """What messages say is known of responses, and of forces."""
    of = [list(dict.fromkeys(tidy(label) for label in KINDS[number].units)) for number in (*OF_TYPE, FORCE)]
    return f"{', '.join(label for labels in of[:-1] for label in labels)} over {', '.join(of[-1][:-1])} or {of[-1][-1]}"


def of_force(text: str) -> float | None:
    return next((factor for label, factor in KINDS[FORCE].units.items() if tidy(text) == label), None)


def length_factor(text: str) -> float | None:
    """The factor of a unit's length alone: 1e-3 of mm/s/N, whatever the power of time says; None for g and what is not known."""
    clean = tidy(text)
    found = of_frf(clean)
    return None if found is None or re.match(rf"\(?({'|'.join(GRAVITY)})\b", clean) else found[1]


def of_frequency(text: str) -> float | None:
    """Factor to Hz of an axis of frequencies; None where its unit is none that is known."""
    return HERTZ.get(_bare(text))


def of_time(text: str) -> float | None:
    """Factor to s of an axis of time; None where its unit is none that is known."""
    return SECONDS.get(_bare(text))


def _bare(text: str) -> str:
    return text.strip().strip("()[]").replace(" ", "").lower()


def named(text: str) -> str:
    """The quantity that a label like "Receptance" or "Acceleration/Force" speaks of; "" where it speaks of none."""
    return next((quantity for word, quantity in WORDS.items() if word in text.lower()), "")


def with_article(quantity: str) -> str:
    return f"an {quantity}" if quantity == "accelerance" else f"a {quantity}"
