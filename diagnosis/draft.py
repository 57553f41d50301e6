"""From drift to an effect of one's own: what a free form found, as the simplest law of physics that fits it, written as an effect file.

Laws over temperature T and speed n: none, linear, exponential, Arrhenius, sigmoid, step; and a power of speed, alone, times one of these or beside it.
Each is fitted to the drift of one element in every test, with an offset beside it, weighted by its covariance over the tests (an answer without one: by its
standard errors); the Bayesian information criterion chooses (Schwarz, *Ann. Statist.* 6 (1978) 461). A law with as many parameters as tests fits whatever they are: it is taken where chi2 rules all others out, and
the file says that it is not tested.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.special import chdtrc

from thermospindle.model.errors import BadInput
from thermospindle.model.files.formats import DIAGNOSIS, migrated
from thermospindle.model.types import Array

REFERENCE = 20.0  # C from which laws count temperature, where a diagnosis does not tell its scene's reference
LEAST = -0.999  # of what was: nothing falls further
LARGEST = 1e9  # of any number that is read
SURE = 1e-6  # of the mean variance, added to each: tests of one condition have one change
LIMIT = 400.0  # of sizes in their unit, at least
NEAR = 10.0  # criterion within which rivals are named in the file
REFUTED = 1e-3  # chance of a chi2 as large, below which a law is ruled out


SCALE = ("scale", "K", 20.0, (3.0, 200.0))
ACTIVATION = ("activation", "K", 4000.0, (300.0, 20000.0))
KELVIN = 273.15


@dataclass(frozen=True)
class Law:
    """A law g(T, n; shape): its Python expression, the shape parameters with unit, start and limits."""

    name: str
    expression: str
    shape: tuple[tuple[str, str, float, tuple[float, float]], ...] = ()

    def __call__(self, temperature: Array, share: Array, values: Any) -> Array:
        names = {"T": temperature, "n": share, "exp": np.exp, "where": np.where, **{s[0]: v for s, v in zip(self.shape, values, strict=True)}}
        return np.broadcast_to(np.asarray(eval(self.expression, {"__builtins__": {}}, names), float), temperature.shape)  # the text is one of ours, above


def of_temperature(reference: float, hottest: float) -> tuple[Law, ...]:
    """Laws that count temperature from a scene's reference (C); the steep ones are 1 at the hottest test (C), so that their sizes are what was seen there."""
    from_reference, from_hottest = _less(reference), _less(hottest)
    cold, hot = f"{reference + KELVIN:.8g}", f"{hottest + KELVIN:.8g}"
    exponential, arrhenius = f"exp(({reference - hottest:.6g}) / scale)", f"exp(activation * (1 / {hot} - 1 / {cold}))"
    return (
        Law("linear in temperature", f"({from_reference}) / 40"),
        Law("exponential in temperature", f"(exp(({from_hottest}) / scale) - {exponential}) / (1 - {exponential})", (SCALE,)),
        Law("Arrhenius", f"(exp(activation * (1 / {hot} - 1 / (T + 273.15))) - {arrhenius}) / (1 - {arrhenius})", (ACTIVATION,)),
        Law("sigmoid in temperature", "1 / (1 + exp((middle - T) / width))", (("middle", "C", 40.0, (-40.0, 200.0)), ("width", "K", 4.0, (0.5, 40.0)))),
        Law("step in temperature", "where(T > middle, 1.0, 0.0)", (("middle", "C", 35.0, (-40.0, 200.0)),)),
    )


def of_both(reference: float, hottest: float) -> tuple[Law, ...]:
    """Laws linear in speed whose slope grows with temperature."""
    return (
        Law("linear in speed, linear in temperature", f"n * (1 + ({_less(reference)}) / 40)"),
        Law("linear in speed, exponential in temperature", f"n * exp(({_less(hottest)}) / scale)", (SCALE,)),
        Law("linear in speed, Arrhenius", f"n * exp(activation * (1 / {hottest + KELVIN:.8g} - 1 / (T + 273.15)))", (ACTIVATION,)),
    )


def _less(temperature: float) -> str:
    return f"T {'-' if temperature >= 0 else '+'} {abs(temperature):.6g}"


OF_SPEED = (Law("linear in speed", "n"), Law("power of speed", "n ** power", (("power", "1", 1.0, (0.2, 4.0)),)))


def laws(temperature: Array, share: Array, reference: float = REFERENCE) -> list[Law]:
    """The laws that tests at temperatures (n,) C and shares (n,) of the highest speed can tell; temperature counts from the `reference` (C)."""
    found = [Law("constant", "1.0")]
    hottest = float(temperature.max() if abs(temperature.max() - reference) > 1 else temperature.min())  # a law from the reference is nothing there
    thermal = of_temperature(reference, hottest) if np.ptp(temperature) > 1 else ()
    speed = OF_SPEED if np.ptp(share) > 0 else ()
    found += [*thermal, *speed]
    if thermal and speed:
        found += of_both(reference, hottest)
        found += [Law(f"{t.name} and linear in speed", f"{t.expression} + of_speed * n", (*t.shape, ("of_speed", "1", 0.0, (-20.0, 20.0)))) for t in thermal[:4]]
    return found


@dataclass(frozen=True, eq=False)
class Fitted:
    """A law fitted: `size`, `offset` (0 for the constant law) and shape values with standard errors; chi2 in how many `tests`, and the number of parameters."""

    law: Law
    values: Array  # size, offset, shape...
    sd: Array
    chi2: float
    tests: int
    count: int

    @property
    def criterion(self) -> float:
        """The Bayesian information criterion; smaller is better."""
        return self.chi2 + self.count * float(np.log(self.tests))

    @property
    def refuted(self) -> bool:
        """By chi2; with as many parameters as tests nothing is tested, and that counts as refuted too."""
        freedom = self.tests - self.count
        return freedom == 0 or bool(chdtrc(freedom, self.chi2) < REFUTED)


def has_offset(law: Law) -> bool:
    return law.expression != "1.0"


def fit_law(law: Law, temperature: Array, share: Array, change: Array, white: Array) -> Fitted | None:
    """Least squares in size, offset and shape, the first two linear; None where there are more parameters than tests. `white` (n, n) makes errors of `change`
    (n,) independent and of unit variance."""
    offset = has_offset(law)
    count = 1 + offset + len(law.shape)
    if count > len(change):
        return None
    best: Fitted | None = None
    for begin in _starts(law, temperature):

        def linear(shape: Array) -> tuple[Any, Array]:
            columns = [law(temperature, share, shape)] + ([np.ones_like(change)] if offset else [])
            a = white @ np.stack(columns, axis=1)
            found = np.linalg.lstsq(a, white @ change, rcond=None)[0]
            return found, a @ found - white @ change

        low, high = ([s[3][k] for s in law.shape] for k in (0, 1))
        shape = begin
        if law.shape and law.name != "step in temperature":
            shape = least_squares(lambda v: linear(v)[1], begin, bounds=(low, high)).x
        amplitude, residual = linear(shape)
        squares = float(residual @ residual)
        if best is None or squares < best.chi2:
            values = np.concatenate([amplitude, np.zeros(int(not offset)), shape])
            best = Fitted(law, values, _errors(law, values, offset, temperature, share, white), squares, len(change), count)
    return best


def ranked(found: Sequence[Fitted]) -> list[Fitted]:
    """By the criterion, the best first; laws with as many parameters as tests, which fit whatever the tests are, only where all others are refuted."""
    tested = [f for f in found if f.count < f.tests]
    return sorted(found if all(f.refuted for f in tested) else tested, key=lambda f: f.criterion)


def _starts(law: Law, temperature: Array) -> list[Array]:
    if not law.shape:
        return [np.zeros(0)]
    start = np.array([s[2] for s in law.shape])
    names = [s[0] for s in law.shape]
    if "middle" not in names:
        return [start]
    every = np.unique(temperature)
    middles = np.clip((every[1:] + every[:-1]) / 2, *law.shape[names.index("middle")][3])
    return [np.where(np.array(names) == "middle", m, start) for m in middles] or [start]


def _errors(law: Law, values: Array, offset: bool, temperature: Array, share: Array, white: Array) -> Array:
    def model(v: Array) -> Array:
        return v[0] * law(temperature, share, v[2:]) + v[1]

    columns = []
    for i in range(len(values)):
        h = 1e-4 * max(abs(values[i]), 1e-3)
        step = values + h * (np.arange(len(values)) == i)
        columns.append((model(step) - model(values)) / h)
    columns[1] = columns[1] if offset else np.zeros_like(temperature)
    a = white @ np.stack(columns, axis=1)
    return np.sqrt(np.maximum(np.diag(np.linalg.pinv(a.T @ a)), 0.0))


def draft(diagnosis: Path, name: str, element: str | None = None) -> str:
    """The text of an effect file called `name` from the free-form answer in an answer of `spindle diagnose --json`.

    The first element that would have to drift is taken, or `element`. Raises `BadInput` where the file holds none, or one that changes by nothing.
    """
    place, reference = _place(diagnosis, element)
    unit = place["unit"]
    rows = place["change"]
    temperature, speed, sd = (np.array([float(r[k]) for r in rows]) for k in ("temperature_C", "speed_rpm", "sd"))
    change = np.array([float(r[_key(place)]) for r in rows])
    covariance = np.array(place["change_covariance"], float) if "change_covariance" in place else np.diag(sd**2)
    if _key(place) == "relative":  # free forms count per cent of a logarithm
        factor = 1 + np.maximum(change, LEAST)
        change, covariance = 100 * np.log(factor), 1e4 * covariance / np.outer(factor, factor)
    top = float(np.max(np.abs(speed))) or 1.0
    share = np.abs(speed) / top
    if not change.any():
        raise BadInput(f"{diagnosis}: where: {place['element']} changes by 0 in every test; there is nothing to draft")
    candidates = [fit_law(law, temperature, share, change, _whitening(covariance)) for law in laws(temperature, share, reference)]
    return _text(name, place, ranked([c for c in candidates if c is not None]), top, unit, diagnosis)


def _whitening(covariance: Array) -> Array:
    """W (n, n) with W C W^T = 1 of a covariance C, which may be that of tests without errors of their own."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-18))
    value, vector = np.linalg.eigh(covariance / np.outer(scale, scale))
    return np.asarray((vector / np.sqrt(np.maximum(value, 0.0) + SURE)).T / scale)


def _place(diagnosis: Path, element: str | None) -> tuple[Mapping[str, Any], float]:
    """What drifts, and the reference temperature (C) of the scene."""
    if not diagnosis.is_file():
        raise BadInput(f"{diagnosis}: cannot be read: no such file")
    try:
        told = migrated(DIAGNOSIS, json.loads(diagnosis.read_text(encoding="utf-8")), diagnosis)
        places, reference = told["where"], float(told.get("reference_temperature_C", REFERENCE))
        if not -273.15 < reference < LARGEST:
            raise ValueError
        found = [p for p in places if element is None or p["element"] == element]
        if found:
            unit = found[0]["unit"]
            keys = ("temperature_C", "speed_rpm", "sd", _key(found[0]))
            _plain(found[0]["element"], unit, diagnosis.name)
            effect = found[0].get("effect")
            if effect is not None:
                _plain(*effect["at"], *effect["values"])
                if not {"temperature_C", "speed_rpm"} <= set(effect["at"]) or not all(
                    abs(float(v)) <= LARGEST for part in ("at", "values") for v in effect[part].values()
                ):
                    raise ValueError
            if not found[0]["change"] or not all(abs(float(r[key])) <= LARGEST for r in found[0]["change"] for key in keys):
                raise ValueError
            _check_covariance(found[0])
            return found[0], reference
        named = [str(p["element"]) for p in places]
    except OSError as error:
        raise BadInput(f"{diagnosis}: cannot be read: {error.strerror}") from None
    except BadInput:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        raise BadInput(f"{diagnosis}: is not an answer of spindle diagnose --json with elements that drift in `where`") from None
    if element is None:
        raise BadInput(f"{diagnosis}: where: is empty; the diagnosis found nothing that drifts, and there is nothing to draft")
    raise BadInput(f"--element {element}: does not drift in {diagnosis}; allowed are {', '.join(named) or 'none'}")


def _check_covariance(place: Mapping[str, Any]) -> None:
    """`ValueError` or `TypeError` for one that is not of the changes, where an answer tells it."""
    if "change_covariance" in place:
        found, n = np.array(place["change_covariance"], float), len(place["change"])
        if found.shape != (n, n) or not np.all(np.abs(found) <= LARGEST**2) or np.any(np.diag(found) < 0):
            raise ValueError
        scale = np.sqrt(np.maximum(np.diag(found), 1e-18))
        correlation = found / np.outer(scale, scale)
        if not np.allclose(correlation, correlation.T, atol=1e-6) or np.linalg.eigvalsh(correlation).min() < -SURE:
            raise ValueError


def _key(place: Mapping[str, Any]) -> str:
    """Of a change: free forms tell per cent as a share of what was."""
    return "relative" if place["unit"] == "%" and "effect" not in place else f"change_{place['unit']}"


def _plain(*texts: str) -> None:
    """Refuse what would be more than a word in the Python file that is drafted: nothing of a data file becomes code."""
    for text in texts:
        if not isinstance(text, str) or not text.isprintable() or set(text) & set("\"\\{}"):
            raise BadInput(f"{str(text)[:80]!r}: cannot be written into an effect file; names without quotes, braces, backslashes and line ends are allowed")


def _text(name: str, place: Mapping[str, Any], fits: Sequence[Fitted], top: float, unit: str, diagnosis: Path) -> str:
    best = fits[0]
    size, offset = best.values[:2]
    rivals = "; ".join(f"{r.law.name} ({r.criterion - best.criterion:+.1f})" for r in fits[1:] if r.criterion - best.criterion < NEAR) or "none near"
    constant = has_offset(best.law)
    formula = f"size * ({best.law.expression}){' + offset' * constant}"
    step = best.law.expression.startswith("where")
    effect = place.get("effect")  # of the catalogue, with a law of the data's own
    shape = list(zip(best.law.shape, best.values[2:], best.sd[2:], strict=True))
    of_unit = "" if unit == "1" else f" {unit}"
    lines = [
        f'"""{place["element"]} drifts: {best.law.name}. Drafted by `spindle draft` from {diagnosis.name}; name it, read it, edit it.',
        "",
        f"change = {formula}{of_unit and f' in{of_unit}'}, T in C, n = speed / {top:g} rpm.",
        f"size {size:.4g} +- {best.sd[0]:.2g}{of_unit}"
        + (f"; what is there everywhere, offset {offset:.4g} +- {best.sd[1]:.2g}{of_unit}" if constant else "")
        + "".join(f", {s[0]} {v:.4g} +- {e:.2g} {s[1]}" for s, v, e in shape)
        + ".",
        *([f"Per cent of a logarithm: {place['element']} is exp(change / 100) of what it was."] if unit == "%" and effect is None else []),
        *([f"The change is of the size of {place['element']}, which acts as its formula has it at {_told(effect['at'])}, at any condition."] if effect else []),
        f"Rivals by the Bayesian information criterion: {rivals}.",
        _tested(best),
        '"""',
        "",
        *(["from math import exp", ""] if "exp(" in best.law.expression else []),
        "from thermospindle.diagnosis.inference.freeform import drifting",
        "from thermospindle.sim.effects.effect import Parameter",
        "",
        f"TOP = {top:g}  # rpm",
        "",
        "",
        "def law(T, rpm, values):",
        f'    """Change of {place["element"]}{of_unit and f" in{of_unit}"} at temperature T (C) and speed (rpm)."""',
        "    n = abs(rpm) / TOP",
        *(f"    {s[0]} = {v:g}  # {s[1]}, between two tests" if step else f'    {s[0]} = values["{s[0]}"]' for s, v, _ in shape),
        f'    return values["size"] * ({_scalar(best.law.expression)})' + ' + values["offset"]' * constant,
        "",
        "",
        "EFFECT = drifting(",
        f'    "{place["element"]}",',
        *([f"    at={_numbers(effect['at'])},", f"    others={_numbers(effect['values'])},"] if effect else []),
        f'    name="{name}",',
        f'    title="{place["element"]} drifts: {best.law.name}",',
        f'    equation="change = {formula}, T in C, n = speed / {top:g} rpm",',
        "    law=law,",
        "    parameters=(",
        _parameter("size", unit, 0.0, size, max(abs(size), 1e-3), "how much it changes", _about(size)),
        *([_parameter("offset", unit, 0.0, offset, max(abs(offset), best.sd[1], 1e-3), "what is there at every temperature and speed", _about(offset))] if constant else []),
        *(_parameter(s[0], s[1], v, v, max(0.3 * abs(v), 1e-3), f"shape of the law, +- {e:.2g}", s[3]) for s, v, e in shape if not step),
        "    ),",
        f'    source="fitted to the drift found in {diagnosis.name}",',
        ")",
    ]
    return "\n".join(lines) + "\n"


def _tested(best: Fitted) -> str:
    if best.count == best.tests:
        return f"{best.count} parameters fit {best.tests} tests whatever they are: that it is this law is not tested."
    said = f"chi2 {best.chi2:.3g} of {best.tests} tests with {best.count} parameters"
    return f"{said}: no law here fits, this one least badly." if best.refuted else f"{said}."


def _about(value: float) -> tuple[float, float]:
    """Limits that leave a fit room about `value`."""
    most = max(LIMIT, float(f"{4 * abs(value):.1g}"))
    return -most, most


def _told(at: Mapping[str, float]) -> str:
    return ", ".join(f"{value:g} {unit.replace('_', ' ')}" for value, unit in ((v, k.rpartition("_")[2]) for k, v in at.items()))


def _numbers(values: Mapping[str, float]) -> str:
    return "{" + ", ".join(f'"{key}": {float(value):.6g}' for key, value in values.items()) + "}"


def _scalar(expression: str) -> str:
    return "1.0 if T > middle else 0.0" if expression.startswith("where") else expression


def _parameter(name: str, unit: str, neutral: float, typical: float, width: float, meaning: str, limits: tuple[float, float]) -> str:
    return (
        f'        Parameter("{name}", "{unit}", {neutral:.6g}, {typical:.6g}, {width:.3g}, ({limits[0]:g}, {limits[1]:g}), "{meaning}", "fitted by spindle draft to what a diagnosis found to drift"),'
    )
