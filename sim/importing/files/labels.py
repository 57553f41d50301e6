"""What a column is, read off its heading or told by the mapping: `H(3,1) real`, `frequency`, `force`, `response 3`, `coherence(3,1)`."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from thermospindle.sim.importing import units
from thermospindle.sim.importing.measured import NOWHERE, End

PARTS = {
    "real": "real", "re": "real", "imaginary": "imaginary", "imag": "imaginary", "im": "imaginary", "img": "imaginary",
    "magnitude": "magnitude", "mag": "magnitude", "abs": "magnitude", "amplitude": "magnitude", "amp": "magnitude", "modulus": "magnitude",
    "db": "decibel", "decibel": "decibel", "decibels": "decibel", "phase": "phase", "arg": "phase", "angle": "phase", "complex": "complex",
    "realteil": "real", "imaginärteil": "imaginary", "betrag": "magnitude", "phasenwinkel": "phase", "winkel": "phase",
}  # fmt: skip
AXES = {"frequency": "frequency", "freq": "frequency", "f": "frequency", "frequenz": "frequency", "fréquence": "frequency", "omega": "frequency", "ω": "frequency", "time": "time", "t": "time", "zeit": "time"}
ANGULAR = ("omega", "ω")
"""Axes that are in rad/s where they name no unit."""
FUNCTIONS = ("h", "frf", "h1", "h2", "hv", "g", "tf")
COHERENCE = ("coherence", "coh", "kohärenz", "gamma2", "γ2", "γ²")
FORCES = ("force", "hammer", "excitation", "kraft", "anregung", "impact")
RESPONSES = ("response", "acceleration", "accelerometer", "accel", "acc", "velocity", "vibrometer", "vel", "displacement", "disp", "antwort", "beschleunigung", "schwinggeschwindigkeit", "schwingweg")
KINDS_OF_CHANNEL = {*FORCES, *RESPONSES}
ROLES = 'frequency, time, "H(3,1)" with real, imaginary, magnitude, decibel or phase behind it, coherence(3,1), sd(3,1), force, response 3, ignore'
"""What may stand in `columns` of a mapping."""


@dataclass(frozen=True)
class Role:
    """`kind`: frequency, time, H, coherence, sd, force, response or ignore; `part` of an H; `unit`
    as written in brackets; `level` is what 0 dB are of it."""

    kind: str
    part: str = ""
    response: End = NOWHERE
    reference: End = NOWHERE
    unit: str = ""
    level: float = 1.0


DECIBEL = re.compile(r"dB(?:\s*(?:ref|rel|re|//)\W*\s*([\d.,]+(?:[eE][+-]?\d+)?)?\s*(.*))?", re.IGNORECASE)


def role_of(heading: str) -> Role | None:
    """The role that a heading tells; None where it tells none."""
    text, unit = _without_unit(heading.strip())
    if decibel := DECIBEL.fullmatch(unit):  # "mag [dB]", "[dB re 1 um/N]"
        role = _role(text, (decibel[2] or "").strip())
        return role and replace(role, part="decibel" if role.part in ("magnitude", "complex") else role.part, level=float((decibel[1] or "1").replace(",", ".")))
    return _role(text, unit)


def _role(text: str, unit: str) -> Role | None:
    """The role that a heading without its unit tells."""
    low = text.lower().strip(" :_-")
    if (axis := re.sub(r"[ _-]+(domain|axis|vector)$", "", low)) in AXES:
        return Role(AXES[axis], unit=unit or ("rad/s" if axis in ANGULAR else ""))
    if not unit and (axis_unit := re.fullmatch(r"([^\W_]+)_(hz|khz|s|ms)", low)) and axis_unit[1] in AXES:  # "frequency_kHz"
        return Role(AXES[axis_unit[1]], unit=axis_unit[2].replace("hz", "Hz"))
    if low in ("hz", "s", "sec"):
        return Role("frequency" if low == "hz" else "time", unit=low)
    if low in ("ignore", ""):
        return Role("ignore") if low else None
    pair = re.search(r"\(\s*([^(),;/|]+?)\s*[,;/|]\s*([^(),;/|]+?)\s*\)", text)
    ends = (end(pair[1]), end(pair[2])) if pair else (End(), End())
    short = re.fullmatch(r"([HhGg])[_ ]?(\d)(\d)|([HhGg])[_ ]?(\d+)[_/-](\d+)", text.split(" ")[0]) if pair is None else None
    if short is not None:  # H21, H_2_1
        digits = [d for d in short.groups() if d and d.isdigit()]
        return _role(f"H({digits[0]},{digits[1]}){text[len(text.split(' ')[0]) :]}", unit)
    if pair is None and (over := re.fullmatch(r"([^\s/|]+)\s*[/|]\s*([^\s/|]+)[\s_:]+([A-Za-z]+)\W*", text)) and over[3].lower() in PARTS and not {*map(str.lower, over.groups()[:2])} & KINDS_OF_CHANNEL:
        return _role(f"H({over[1]},{over[2]}) {over[3]}", unit)  # "hub/seat mag"
    rest = text[: pair.start()] + " " + text[pair.end() :] if pair else text
    words = [w for w in re.split(r"[^A-Za-zäöüéγ²0-9]+", rest.lower()) if w]
    told = Role("H", "", *ends, unit)
    if any(w in COHERENCE for w in words):
        return replace(told, kind="coherence")
    if words[:1] in (["sd"], ["stderr"]) or words[:2] == ["standard", "error"]:
        return replace(told, kind="sd")
    part = next((PARTS[w] for w in words if w in PARTS), "")
    frf = (bool(words) and words[0] in FUNCTIONS) or (pair is not None and bool(part))
    if frf or (part and set(words) <= set(PARTS)):
        left = [w for w in words if w not in PARTS and w not in FUNCTIONS]
        if left and pair is None:  # "FRF-1 real": one of several, of which the heading tells no pair
            of = re.sub(rf"(?i)\b({'|'.join(PARTS)})\b", "", text).strip(" _-:")
            told = replace(told, response=End(name=of))
        return replace(told, part=part or "complex")
    if part and {*words} & {*FORCES} and {*words} & {*RESPONSES}:  # "Acceleration/Force magnitude"
        return replace(told, part=part)
    number = next((int(w) for w in words if w.isdecimal()), 0)
    for kind, known in (("force", FORCES), ("response", RESPONSES)):
        if any(w.rstrip("0123456789") in known for w in words):
            glued = next((re.sub(r"\D", "", w) for w in words if w.rstrip("0123456789") in known), "")
            place = end(pair[1]) if pair else End(number or int(glued or 0))
            if (pair is None and (called := re.fullmatch(r"\s*[^\W\d_]+[\s_]*(\d+\s*:?\s*[+-]?\s*[XYZxyz]\s*[+-]?)\s*", text))) or (not place.label and (called := re.fullmatch(r"\s*\w+?\s+([A-Za-z]\w*)\s*", text))):  # "acceleration 3:-X"
                place = end(called[1])
            return Role(kind, "", place if kind == "response" else End(), place if kind == "force" else End(), unit)
    return None


def end(text: str) -> End:
    """An end as people write it: 3, "3:+Z", "3Z", "3+Z", "hub_top0"."""
    match = re.fullmatch(r"(\d+)\s*:?\s*(?:([+-]?)\s*([XYZxyz]))?\s*([+-]?)", text.strip())
    if match is None:
        return End(name=text.strip())
    axis = match[3].upper() if match[3] else ""
    return End(int(match[1]), ((match[2] or match[4] or "+") + axis) if axis else "")


def told_of_end(heading: End, told: str | int | None) -> End:
    """An end as its heading has it, with what a mapping tells beside: all of one that the heading
    leaves open, and the direction of the same one."""
    if told is None:
        return heading
    own = end(str(told))
    if not heading.label:
        return own
    return replace(heading, direction=own.direction) if own.direction and same_end(own, heading) else heading


def same_end(one: End, other: End) -> bool:
    """Whether two ends are of one place, whichever way each looks."""
    return (one.node, one.name) == (other.node, other.name)


def _without_unit(text: str) -> tuple[str, str]:
    """The heading, and the unit in square or round brackets at its end."""
    match = re.search(r"\s*\[([^\[\]]*)\]\s*$", text)
    if match is None and (match := re.search(r"\s+\((.+)\)\s*$", text)) is None:
        match = re.search(r"(?<=\w)\((Hz|s|N|dB|deg|rad|°|g|V)\)\s*$", text)
    if match is None or (re.search(r"[,;|]", match[1]) is not None):
        return text, ""
    inside = match[1].strip()
    known = inside in ("deg", "°", "rad", "-", "1", "V") or units.of_frequency(inside) or units.of_time(inside) or DECIBEL.fullmatch(inside) or units.of_frf(inside) or units.of_response(inside) or units.of_force(inside)
    return (text[: match.start()], inside) if known or match[0].strip().startswith("[") else (text, "")
