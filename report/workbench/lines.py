"""The effects on the bench fitted to the FRF lines, as `spindle diagnose` fits and weighs them:
same data, priors, discrepancies and evidence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

from thermospindle.diagnosis.compare.before_after import without
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.diagnosis.inference.hypothesis import Hypothesis, settled
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.mechanism import variants
from thermospindle.diagnosis.verdict import campaign_data
from thermospindle.model.errors import BadInput, NoEquilibrium
from thermospindle.report.text.diagnosis.answer import parameters_of
from thermospindle.report.typeset import plain_error
from thermospindle.report.workbench.bench import Bench
from thermospindle.report.workbench.state import Setting, key_of

STEPS = 3  # of the progress, beside the tests that are read


@dataclass(frozen=True)
class Weighed:
    """Values and standard errors by the names of `Setting.free`, effects' parameters and
    tolerances; `gain` in ln evidence over tolerances alone, and chi2 per number before and after."""

    value: dict[str, float]
    sd: dict[str, float]
    gain: float
    before: float
    after: float


def weighed(bench: Bench, s: Setting, progress: Callable[[str], None] = lambda done: None) -> Weighed:
    """The effects of a setting, every parameter of them, and all tolerances fitted to the tests that are not left out.

    Fits begin at no size and at that of the setting. `BadInput` where there is nothing to fit to,
    `NoEquilibrium` where no start has a spindle.
    """
    if bench.campaign is None:
        raise BadInput("without a campaign there is nothing to fit to")
    if all(shown.id in s.left_out for shown in bench.shown):
        raise BadInput("every test is left out; one at least is needed to fit to")
    model = campaign_data(bench.spindle, without(bench.campaign, sorted(s.left_out)), progress)
    first = fit(model)
    none = settled(model, Hypothesis(first, evidence(model, first)))
    progress("tolerances fitted")
    begun = []
    for mechanisms in product(*(variants(bench.effect(name)) for name in s.effects)) if s.effects else ():
        problem = Problem(model, mechanisms)
        sizes = {k: s.effects[m.name][m.size.name] for k, m in enumerate(mechanisms)}
        for start in (problem.start({}), problem.start(sizes)):
            try:
                found = fit(model, mechanisms, start)
            except NoEquilibrium:
                continue
            begun.append(Hypothesis(found, evidence(model, found)))
    if s.effects and not begun:
        raise NoEquilibrium(f"no spindle can be built with {' and '.join(s.effects)}")
    progress("effects fitted")
    best = settled(model, max(begun, key=lambda h: h.evidence.ln)) if begun else none
    progress("sizes of discrepancies learned")
    return _told(best, none, model.parameters)


def _told(best: Hypothesis, none: Hypothesis, parameters) -> Weighed:  # type: ignore[no-untyped-def]
    value, sd = {}, {}
    for k, m in enumerate(best.mechanisms):
        for name, row in parameters_of(best, k).items():
            value[key_of(m.name, name)], sd[key_of(m.name, name)] = row["value"], row["sd"]
    spread = best.evidence.covariance.diagonal()
    for p, mean, variance in zip(parameters, best.evidence.mean, spread, strict=False):
        if p.kind == kinds_of.BUILD:
            value[p.name], sd[p.name] = float(mean * p.sd), float(max(variance, 0.0) ** 0.5 * p.sd)
    n = best.fit.count
    return Weighed(value, sd, best.evidence.ln - none.evidence.ln, none.evidence.chi2 / n, best.evidence.chi2 / n)


def said(found: Weighed) -> str:
    """The fit in a sentence."""
    values = ", ".join(f"{key} {plain_error(v, found.sd[key])}" for key, v in found.value.items() if "." in key)
    values = values.replace("+-", "±")
    gain = f"ln evidence {found.gain:+z.0f} over tolerances alone; " if values else ""
    return f"Fitted to the lines, as spindle diagnose does. {values + '; ' if values else ''}{gain}chi2 per number {found.before:.3g} → {found.after:.3g}."
