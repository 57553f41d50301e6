"""From drift to an effect of one's own: what a free form found, as the simplest law of physics that fits it, written as an effect file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template

from thermospindle.diagnosis.draft.answer import place_of, whitening
from thermospindle.diagnosis.draft.laws import Fitted, fit_law, laws, ranked

LIMIT = 400.0  # of sizes in their unit, at least
NEAR = 10.0  # criterion within which rivals are named in the file


@dataclass(frozen=True)
class Draft:
    """The text of an effect file, of which element it is, how well its law fits in a sentence, and whether that leaves it in
    `doubt`; the effects that the diagnosis named instead, and whether the build tolerances of its answer go with the draft."""

    text: str
    element: str
    fits: str
    doubt: bool
    named: tuple[str, ...] = ()
    with_build: bool = False


def draft(diagnosis: Path, name: str, element: str | None = None) -> Draft:
    """An effect file called `name` from the free-form answer in an answer of `spindle diagnose --json`.

    The first element that would have to drift is taken, or `element`. Raises `BadInput` where the
    file holds none, or one that changes by nothing.
    """
    place, reference, named, with_build = place_of(diagnosis, element)
    temperature, speed = place.of_tests("temperature_C"), np.abs(place.of_tests("speed_rpm"))
    change, covariance = place.logarithmic
    top = float(speed.max()) or 1.0
    tried = [fit_law(law, temperature, speed / top, change, whitening(covariance)) for law in laws(temperature, speed / top, reference)]
    best, *others = ranked([f for f in tried if f is not None])
    fits, doubt = _fits(best)
    text = _template().render(
        name=name,
        place=place,
        best=best,
        rivals=[(f.law.name, f"{f.criterion - best.criterion:+.1f}") for f in others if f.criterion - best.criterion < NEAR],
        told=lambda sd, shape: sd < shape[3][1] - shape[3][0],  # a parameter, by its limits; what is not told stands in the law as a number
        shape=list(zip(best.law.shape, best.values[2:], best.sd[2:], strict=True)),
        formula=f"size * ({best.law.expression}{' + offset' if best.law.has_offset else ''})",
        top=top,
        file=diagnosis.name,
        limits=[_about(v) for v in best.values[:2]],
        fits=fits,
    )
    return Draft(text, place.element, fits, doubt, named, with_build)


def _fits(best: Fitted) -> tuple[str, bool]:
    if not best.tested:
        what = {(True, False): "temperatures", (False, True): "speeds"}.get(best.law.asks, "tests") if best.places < best.tests else "tests"
        return f"{best.count} parameters fit {best.places} {what} whatever changes over them: that it is this law is not tested", True
    misses = ": no law here fits, this one least badly" if best.refuted else ""
    return f"chi2 {best.chi2:.3g} of {best.tests} tests with {best.count} parameters{misses}", bool(best.refuted)


def _template() -> Template:
    loader = FileSystemLoader(str(Path(__file__).parent))
    environment = Environment(loader=loader, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True)
    environment.filters["short"] = lambda value, digits: f"{value:.{digits}g}"
    return environment.get_template("effect.py.j2")


def _about(value: float) -> tuple[float, float]:
    """Limits that leave a fit room about `value`."""
    most = max(LIMIT, float(f"{4 * abs(value):.1g}"))
    return -most, most
