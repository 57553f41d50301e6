"""The misfit told: as JSON, and in sentences an engineer can act on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from itertools import pairwise
from typing import Any

import numpy as np

from diagnosis.misfit import Drift, Growth, Misfit
from diagnosis.shares import BY
from model.machine import Condition

RPM = 2 * np.pi / 60
AS_WELL = 0.9  # share of what the best removes at which another element would do nearly as well
CERTAIN = 3.0  # standard errors from which a constant change is called needed
LITTLE = 0.5  # and below which nothing else helps
TOLD = 8  # drifts in the JSON


def misfit_json(m: Misfit) -> dict[str, Any]:
    return {
        "chi2": m.chi2,
        "count": m.count,
        "rejected": m.rejected,
        "shares": {
            by: [{"name": s.name, "share": s.share, "chi2": s.misfit, "count": s.count} for s in m.shares if s.by == by] for by in BY
        },
        "growth": [_growth_json(g) for g in m.growth],
        "drift": [_drift_json(d) for d in m.drift[:TOLD]],
        "places": [_drift_json(d) for d in m.places],
        "words": words(m),
    }


def _growth_json(g: Growth) -> dict[str, Any]:
    row = asdict(g)
    row["step_C"] = row.pop("step")
    row["relative_frequency_change"] = row.pop("changes")
    row["tried"] = {name: {"removes": removes, "criterion": criterion} for name, (removes, criterion) in g.tried.items()}
    return row


def _drift_json(d: Drift) -> dict[str, Any]:
    return {
        "parameters": list(d.names),
        "change": [
            {**condition_json(c), "relative": float(v), "sd": float(s)} for c, v, s in zip(d.conditions, d.change, d.sd, strict=True)
        ],
        "with": d.pattern.shape.name,
        "explains": d.pattern.explains,
        "removes": d.removes,
        "criterion": d.criterion,
        "needed": d.needed,
    }


def condition_json(c: Condition) -> dict[str, Any]:
    row: dict[str, Any] = {"temperature_C": c.temperature, "speed_rpm": c.speed / RPM}
    row |= {"level_N": c.level} if c.level else {}
    return row | ({"soak_time_min": c.soak_time / 60} if np.isfinite(c.soak_time) else {})


# ---------------------------------------------------------------- sentences


def words(m: Misfit) -> list[str]:
    """Sentences: what would have to change, without any catalogue; then how large the misfit is, where it sits, and what it grows with."""
    if not m.rejected:
        return [f"The tolerances explain the data (chi2 {m.chi2:.0f} for {m.count} numbers): nothing has to change."]
    told = [must_change(m.places[0], m.places[1:])] if m.places else []
    if m.drift and m.drift[0].needed and not (m.places and m.places[0].names == m.drift[0].names):
        told.append(f"Of the toleranced parameters alone, {_lower(must_change(m.drift[0], m.drift[1:]))}")
    told.append(f"With all tolerances fitted a chi2 of {m.chi2:.0f} is left for {m.count} numbers: {_largest(m)}.")
    return told + [grows(g) for g in m.growth]


def _largest(m: Misfit) -> str:
    """The largest shares, where there is more than one part."""
    parts = []
    for by, text in (
        ("mode", "{:.0f} % in mode {}"),
        ("temperature", "{:.0f} % at {}"),
        ("speed", "{:.0f} % at {}"),
        ("point", "{:.0f} % {}"),
    ):
        own = [s for s in m.shares if s.by == by]
        if len(own) > 1:
            most = max(own, key=lambda s: s.share)
            name = most.name if by != "point" or most.name.startswith("of") else f"at {most.name}"
            parts.append(text.format(100 * most.share, name))
    return ", ".join(parts) if parts else "all in one place"


def grows(g: Growth) -> str:
    """What the residuals do over one variable."""
    if g.shape == "none":
        return f"It does not grow with {_variable(g)}."
    how = {"step": "in a step" + (f" between {g.step[0]:g} and {g.step[1]:g} C" if g.step else ""), "speed": "", "level": ""}
    way = how.get(g.shape, {"linear": "linearly", "curved": "along a curve"}.get(g.shape, f"with the {g.shape} part"))
    most = ", ".join(f"{name} {100 * change:+.2f} %" for name, change in g.changes.items())
    return f"It grows with {_variable(g)}{' ' if way else ''}{way}, which is {100 * g.removes:.0f} % of its variation" + (
        f"; the frequencies most concerned change, measured less computed, by: {most}." if most else "."
    )


def _variable(g: Growth) -> str:
    return {"level": "hammer level"}.get(g.variable, g.variable)


def must_change(best: Drift, others: Sequence[Drift]) -> str:
    """`upper and lower bearing radial stiffness must fall 11 % between 50 and 60 C; nothing else helps`."""
    rivals = [d for d in others if not set(d.names) <= set(best.names)]
    rival = max(rivals, key=lambda d: d.removes, default=None)
    if rival is None or rival.removes < LITTLE * best.removes:
        rest = "nothing else helps" if rival is None or rival.removes < LITTLE**2 * best.removes else "nothing else helps half as much"
    else:
        degree = "would do nearly as well" if rival.removes > AS_WELL * best.removes else f"alone would remove {100 * rival.removes:.0f} %"
        rest = f"{merged(rival.names)} {degree}"
    together = " together" if len(best.names) > 1 else ""
    sure = best.pattern.shape.name != "constant" or abs(_mean(best)[0]) > CERTAIN * _mean(best)[1]
    verb = "must" if sure else "would have to"
    return _upper(f"{merged(best.names)} {verb}{together} {_change(best)}, which removes {100 * best.removes:.0f} % of the misfit; {rest}.")


def merged(names: Sequence[str]) -> str:
    """Names with their common last words said once: upper and lower bearing radial stiffness."""
    split = [n.split() for n in names]
    common = 0
    while len(names) > 1 and all(len(s) > common + 1 for s in split) and len({s[-1 - common] for s in split}) == 1:
        common += 1
    if len(names) > 1 and not common and len({s[0] for s in split}) == 1:
        return f"{split[0][0]} {' and '.join(' '.join(s[1:]) for s in split)}"
    heads = [" ".join(s[: len(s) - common]) for s in split]
    order = sorted(heads, key=lambda h: (h.startswith("lower"), heads.index(h)))
    listed = order[0] if len(order) == 1 else f"{', '.join(order[:-1])} and {order[-1]}"
    return " ".join([listed, *split[0][len(split[0]) - common :]])


def _change(d: Drift) -> str:
    """The change over each variable it goes with, from its smoothed values."""
    shape = d.pattern.shape
    if shape.name == "constant":
        value, sd = _mean(d)
        return f"be {_size(value, sd)} {'higher' if value > 0 else 'lower'} everywhere"
    parts = []
    for variable in ("temperature", "speed", "level"):
        if not shape.of(variable):
            continue
        x = np.array([getattr(c, variable) for c in d.conditions])
        value, sd = _contrast(d, shape.basis[x == x.max()].mean(axis=0) - shape.basis[x == x.min()].mean(axis=0))
        between = shape.step if variable == "temperature" and shape.step else (float(x.min()), float(x.max()))
        parts.append(f"{'rise' if value > 0 else 'fall'} {_size(value, sd)} {_interval(variable, between)}")
        if variable == "temperature" and shape.temperature == "curved":
            parts[-1] += _steepest(d, x)
    cold = int(np.argmin([abs(c.speed) * 1e3 + c.temperature for c in d.conditions]))
    value, sd = _contrast(d, shape.basis[cold])
    already = f" from {_size(value, sd)} {'above' if value > 0 else 'below'} the drawing" if abs(value) > 2 * sd else ""
    return " and ".join(parts) + already


def _mean(d: Drift) -> tuple[float, float]:
    return _contrast(d, d.pattern.shape.basis.mean(axis=0))


def _contrast(d: Drift, row: np.ndarray) -> tuple[float, float]:
    """A combination (k,) of the coefficients of the pattern, with its standard error."""
    a = np.linalg.solve(np.linalg.cholesky(d.covariance), d.pattern.shape.basis)
    return float(row @ d.pattern.coefficients), float(np.sqrt(row @ np.linalg.solve(a.T @ a, row)))


def _size(value: float, sd: float) -> str:
    return f"{100 * abs(value):.{0 if abs(value) > 0.1 else 1}f} ± {100 * sd:.{0 if sd > 0.1 else 1}f} %"


def _interval(variable: str, between: tuple[float, float]) -> str:
    if variable == "temperature":
        return f"between {between[0]:g} and {between[1]:g} C"
    if variable == "speed":
        ends = ["rest" if v == 0 else f"{v / RPM:.0f} rpm" for v in between]
        return f"from {ends[0]} to {ends[1]}"
    return f"from a hammer level of {between[0]:g} to {between[1]:g} N"


def _steepest(d: Drift, temperature: np.ndarray) -> str:
    """Where most of a curved change happens, if in one interval of the temperatures tested."""
    every = np.unique(temperature)
    smooth = d.pattern.shape.basis @ d.pattern.coefficients
    means = [float(smooth[temperature == t].mean()) for t in every]
    steps = [b - a for a, b in pairwise(means)]
    k = int(np.argmax(np.abs(steps)))
    whole = means[-1] - means[0]
    if len(steps) > 1 and abs(steps[k]) > abs(whole) / 2:
        return f" (most of it between {every[k]:g} and {every[k + 1]:g} C)"
    return ""


def _upper(text: str) -> str:
    return text[:1].upper() + text[1:]


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]
