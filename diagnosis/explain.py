"""Which effect is missing: screen all, refit the promising ones and pairs, and let evidence and held-out conditions decide."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from scipy.stats import chi2 as chi_squared

from diagnosis.decide import AHEAD, MISFIT, Diagnosis, decide
from diagnosis.fit import TEMPERS, Fit, fit, linearise
from diagnosis.many_fits import From, Task, side_by_side
from diagnosis.screening import CLEAR, Signature, best_starts, screen, starts
from diagnosis.theory import Theory
from model.ball_row import Array
from sim.effect import Effect

SINGLES, PAIRED = 5, 4  # effects refitted after the rough fits, and effects tried beside the best
STARTS = 2  # of every effect, those that leave least of the data
SAME = 0.2  # prior standard deviations within which two starts are one
CLOSE = 3.0  # root of chi2 a number, priors included, up to which tolerances alone come close to the data
NEAR = 60.0  # ln evidence within which a fit is polished


def explain(
    theory: Theory,
    catalogue: Sequence[Effect],
    workers: int = 2,
    progress: Callable[[str], None] = lambda done: None,
) -> Diagnosis:
    """The whole diagnosis of one campaign; effects that the scene has already are left as they are."""
    catalogue = [e for e in catalogue if e.name not in {present.name for present, _ in theory.present}]
    about = linearise(theory)

    def polished(found: Sequence[Fit]) -> list[Fit]:
        """Fits made again from where they came to rest, with errors of form and with laws that are exact."""
        again = [(*task, f.nuisance) for f in found for task in (_again(f), _exactly(f))]
        return side_by_side(theory, about, again, True, workers)

    def paired(first: Fit, best: Fit) -> dict[tuple[str, ...], Fit]:
        """Fits of the effect of the first and one of those that screening finds beside it; polished where that may decide."""
        # what another effect does may lie within the errors of form of the first: it shows where the first one's law is taken for exact
        exact = side_by_side(theory, about, [(*_exactly(first), first.nuisance)], True, workers)[0]
        refuted = chi_squared.sf(exact.misfit, len(theory.data.value)) < MISFIT
        where = [first, exact] if refuted else [first]
        seen = {s.effect.name: (f, s) for f in where for s in screen(theory, f, catalogue, 0.1)[:PAIRED] if s.gain > 2 * AHEAD}
        tasks = [(*_beside(first, f, s), None) for f, s in seen.values()]
        pairs = _best(side_by_side(theory, about, tasks, True, workers))
        level = [f for f in pairs.values() if abs(best.evidence - f.evidence) < NEAR]
        return _best([*pairs.values(), *polished(level)])

    base = fit(theory, about)
    progress(f"tolerances fitted: misfit {base.misfit:.0f} for {len(theory.data.value)} numbers")
    signatures = screen(theory, base, catalogue)
    progress(f"{len(signatures)} effects screened")
    strain = base.chi2 - base.misfit  # tolerances far from their nominal values tell of something too
    strained = chi_squared.sf(strain, len(theory.sd)) < 0.01
    quiet = chi_squared.sf(base.misfit, len(theory.data.value)) > 0.01 and not strained
    if quiet and all(s.gain < CLEAR for s in signatures):
        promising: list[Task] = [((s.effect,), s.effect.typical_list()) for s in signatures[:3]]
    else:
        seen = [s for s in signatures if s.visibility > 1 or s.gain > CLEAR]
        # where tolerances explain most, rough fits start from theirs; where they do not, or are strained, they have been dragged off by
        # what is missing, and rough fits start from the drawing, with errors enlarged
        comes_close = base.chi2 < CLOSE**2 * len(theory.data.value)
        ways: list[tuple[Array, Array | None, float]] = [(base.jacobian, base.nuisance, 1.0)] if comes_close else []
        ways += [(about, None, TEMPERS[1])] if not comes_close or strained else []
        promising, made = [], 0
        for slopes, first, enlarged in ways:
            tasks = best_starts(theory, slopes, first, seen, STARTS, enlarged)
            rough = _best(side_by_side(theory, slopes, [((effect,), start, first) for effect, start in tasks], False, workers))
            promising += [_again(f) for f in sorted(rough.values(), key=lambda f: -f.evidence)[:SINGLES] if not _tried(f, promising)]
            made += len(tasks)
        promising = promising or [((s.effect,), s.effect.typical_list()) for s in signatures[:3]]  # where nothing is visible at all
        progress(f"{made} rough fits made")
    fits = _best(side_by_side(theory, about, [(*task, None) for task in promising], True, workers))
    progress("promising effects refitted with all tolerances free")
    best = max(fits.values(), key=lambda f: f.evidence)
    if best.evidence - base.evidence > CLEAR:
        alike = [s for s in signatures if s.effect.name in best.effects[0].resembles and (s.effect.name,) not in fits and s.visibility > 1]
        tried = [((s.effect,), start, None) for s in alike for start in starts(s)[:1]]
        fits |= _best(side_by_side(theory, about, tried, True, workers))
        best = max(fits.values(), key=lambda f: f.evidence)
        progress(f"{len(alike)} effects refitted that the best resembles")
        close = [f for f in fits.values() if best.evidence - f.evidence < NEAR]
        fits |= _best([*close, *polished(close)])
        best = max(fits.values(), key=lambda f: f.evidence)
        fits |= paired(best, best)
        best = max(fits.values(), key=lambda f: f.evidence)
        if len(best.effects) == 2:
            # whether one of them would do is asked from where the two came to rest; where it would not, what else would beside the second
            each = side_by_side(theory, about, _members(best), True, workers)
            fits = _best([*fits.values(), *each])
            if best.evidence - max(f.evidence for f in fits.values() if len(f.effects) == 1) > CLEAR:
                fits = _best([*fits.values(), *paired(each[1], best).values()])
                better = max(fits.values(), key=lambda f: f.evidence)
                each = side_by_side(theory, about, _members(better), True, workers) if better is not best else []
                fits = _best([*fits.values(), *each])
        progress(f"{sum(len(names) == 2 for names in fits)} pairs fitted")
    return decide(theory, base, list(fits.values()), signatures)


def _again(found: Fit) -> Task:
    """The effects of a fit from where it came to rest."""
    return found.effects, [found.values[e.name][p.name] for e in found.effects for p in e.parameters]


def _members(pair: Fit) -> list[From]:
    """Each effect of a pair alone, from where the two came to rest."""
    return [((e,), list(pair.values[e.name].values()), pair.nuisance) for e in pair.effects]


def _tried(found: Fit, tasks: Sequence[Task]) -> bool:
    """Whether a fit came to rest where one of the tasks starts."""
    effects, values = _again(found)
    widths = [p.prior_sd for e in effects for p in e.parameters]
    return any(
        effects == other and all(abs(v - o) < SAME * w for v, o, w in zip(values, start, widths, strict=True)) for other, start in tasks
    )


def _beside(best: Fit, found: Fit, more: Signature) -> Task:
    """The effects of the best from where a fit came to rest, and one more, as large as screening beside it expects."""
    return (*best.effects, more.effect), [*_again(found)[1], *starts(more)[0]]


def _exactly(found: Fit) -> Task:
    """The effects of a fit from where it came to rest, with laws that are exact: errors of form keep a fit from finding that they are none."""
    effects = tuple(replace(e, form_error=0.0, damping_form_error=0.0) for e in found.effects)
    return effects, _again(found)[1]


def _best(fits: Sequence[Fit]) -> dict[tuple[str, ...], Fit]:
    """The best fit of every effect and every pair, whichever of the two came first."""
    best: dict[tuple[str, ...], Fit] = {}
    for f in fits:
        key = tuple(sorted(e.name for e in f.effects))
        if key not in best or f.evidence > best[key].evidence:
            best[key] = f
    return best
