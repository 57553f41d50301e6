"""Which test would decide between explanations that survive, and what each of them says it will show.

A test not made yet is an observation at the mode frequencies and shapes that one explanation predicts, with errors like those of the
campaign. Two explanations differ there by D; with the errors S of the test and of what the fits leave open, the expected ln odds if
either is true are D^T (S + J_a C_a J_a^T + J_b C_b J_b^T)^-1 D / 2: Box & Hill (1967), *Technometrics* 9, 57, for linear models.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from diagnosis.data import data_of
from diagnosis.decide import Candidate, Diagnosis
from diagnosis.fit import Fit, prior_widths
from diagnosis.locate import Change, free_form
from diagnosis.observe import DAMPING_FLOOR, FREQUENCY_FLOOR, SHAPE_FLOOR, Observation
from diagnosis.sensitivity import derivative
from diagnosis.theory import Applied, Theory, predict, theory
from model.ball_row import Array
from model.machine import Condition, OutsideRange, Point, Spindle
from model.pair import NoEquilibrium
from sim.campaign import Test
from sim.effect import Effect, Parameter, Values

TEMPERATURES = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)  # C, a chamber's reach
SPEEDS = (0.0, 3600.0, 7200.0, 12000.0)  # rpm
HARD = 20.0  # N, a hard hit
SOAK = 14400.0  # s in the chamber: four hours, a night's worth for parts of some hundred grams
MASS = 2.0  # g, a piece of steel with a drop of wax
CERTAIN = 50.0  # ln odds beyond which nothing is gained
DECIDED = np.log(100.0)
REFINED = 6  # tests of the first look at which the errors are worked out
RPM = np.pi / 30
FREE = "free: "  # how names of free-form answers begin


@dataclass(frozen=True)
class Explanation:
    """A fitted model: what is applied, its nuisance parameters with their covariance (p, p)."""

    name: str
    applied: Applied = field(repr=False)
    nuisance: Array = field(repr=False)
    covariance: Array = field(repr=False)


@dataclass(frozen=True)
class Plan:
    """A test that could be made; `mass` (g) is waxed on body `on`, `point` is one more to look at."""

    condition: Condition
    mass: float = 0.0
    on: str = ""
    point: Point | None = None


@dataclass(frozen=True)
class ModePrediction:
    """Natural frequency (Hz) and damping ratio of a mode, with standard deviations."""

    frequency: float
    sd: float
    damping: float
    damping_sd: float


@dataclass(frozen=True)
class NextTest:
    """How far apart a test puts two explanations, as odds if either is true, how many repeats make them 100 to 1, what they differ in most,
    in words, and what each predicts of every mode."""

    plan: Plan
    separates: tuple[str, str]
    odds: float
    repeats: int
    tells: str
    predictions: tuple[tuple[ModePrediction, ...], tuple[ModePrediction, ...]]


def explanations(about: Theory, found: Diagnosis, places: Sequence[Change], near: float = 20.0, most: int = 4) -> list[Explanation]:
    """What survives: the candidates of the verdict and those near the best, and the best free-form answer."""
    ahead = found.candidates[0].delta_evidence if found.candidates else 0.0
    named = set(found.effects)
    alive: list[Candidate] = [c for c in found.candidates if set(c.effects) <= named or ahead - c.delta_evidence < near][:most]
    result = [_explanation(about, " + ".join(c.effects), c.fit) for c in alive]
    if places and found.verdict != "none":
        result.append(replace(_explanation(about, f"{FREE}{places[0].element}", found.base), applied=free_form(about.spindle, places[0])))
    return result


def _explanation(about: Theory, name: str, fit: Fit) -> Explanation:
    widths = prior_widths(about, fit)
    a = fit.whiten @ (fit.jacobian * widths)
    covariance = np.linalg.inv(a.T @ a + np.eye(len(widths))) * np.outer(widths, widths)
    own = len(about.sd)
    return Explanation(name, [(e, fit.values[e.name]) for e in fit.effects], fit.nuisance, covariance[:own, :own])


def plans(spindle: Spindle, done: Sequence[Condition]) -> Iterator[Plan]:
    """Feasible tests: other temperatures and speeds; at the coldest and hottest conditions at rest also a hard hit, a long
    soak, a mass, another point."""
    for temperature in TEMPERATURES:
        for rpm in SPEEDS:
            yield Plan(Condition(temperature, rpm * RPM))
    resting = sorted((c for c in done if c.speed == 0), key=lambda c: c.temperature)
    for condition in dict.fromkeys(replace(c, level=0.0, soak_time=np.inf) for c in (*resting[:1], *resting[-1:])):
        yield Plan(replace(condition, level=HARD))
        yield Plan(replace(condition, soak_time=SOAK))
        for body in spindle.structure.bodies:
            if {"x", "z"} <= set(body.moves):
                yield Plan(condition, mass=MASS, on=body.name)
                radius = max((abs(p.position[0]) + abs(p.position[1]) for p in spindle.points if p.body == body.name), default=0.0)
                node = max(p.node for p in spindle.points) + 1
                yield Plan(condition, point=Point(node, f"{body.name} side", body.name, (radius, 0.0, body.z), (1.0, 0.0, 0.0)))


def next_tests(about: Theory, alive: Sequence[Explanation], most: int = 4) -> list[NextTest]:
    """For every two explanations the feasible test that separates them best, the strongest first; free-form answers, which are no physics,
    come last."""
    every = list(plans(about.spindle, [o.condition for o in about.data.observations]))
    found = []
    for a, b in combinations(alive, 2):
        rough = sorted(((_separation(about, plan, a, b, exact=False), i) for i, plan in enumerate(every)), reverse=True)
        best = max(((_separation(about, every[i], a, b, exact=True), i) for odds, i in rough[:REFINED] if odds > 0), default=(0.0, -1))
        if best[1] >= 0 and best[0] > 0:
            plan = every[best[1]]
            repeats = next((n for n in range(1, 100) if _separation(about, plan, a, b, True, n) > DECIDED), 99)
            predictions = (_predicted(about, plan, a), _predicted(about, plan, b))
            odds = float(np.exp(min(best[0], CERTAIN)))
            found.append(NextTest(plan, (a.name, b.name), odds, repeats, _tells(about, plan, a, b), predictions))
    return sorted(found, key=lambda n: (any(name.startswith(FREE) for name in n.separates), -n.odds))[:most]


def _separation(about: Theory, plan: Plan, a: Explanation, b: Explanation, exact: bool, repeats: int = 1) -> float:
    """Expected ln odds; without `exact` only the errors of the test and of its thermometer count. Zero where it cannot be made."""
    try:
        _, difference, variance = _difference(about, plan, a, b, exact, repeats)
    except (NoEquilibrium, OutsideRange, ValueError):
        return 0.0
    return float(difference @ np.linalg.solve(variance, difference)) / 2


def _difference(about: Theory, plan: Plan, a: Explanation, b: Explanation, exact: bool, repeats: int) -> tuple[Theory, Array, Array]:
    """The planned test as `a` predicts it, by how much `b` differs there (n,), and the variance (n, n) of that difference."""
    there = _theory_there(about, plan, a)
    nuisance = [_nuisance_there(about, there, e.nuisance) for e in (a, b)]
    difference = there.features(nuisance[1], _applied(plan, b)) - there.features(nuisance[0], _applied(plan, a))
    variance = np.zeros((len(difference), len(difference)))
    for e, x in zip((a, b), nuisance, strict=True):
        by = derivative(there, x, _applied(plan, e)) if exact else np.zeros((len(difference), len(x)))
        variance += by @ _covariance_there(about, there, e.covariance) @ by.T
    floors = {"frequency": FREQUENCY_FLOOR, "damping": DAMPING_FLOOR}
    variance += np.diag([floors.get(f.what, SHAPE_FLOOR) ** 2 for f in there.data.features]) + np.diag(there.data.sd**2) / repeats
    return there, difference, variance


WORDS = {"amplitude": "the shape", "phase": "the phase of the shape", "size": "the residue", "turn": "the phase of the residue"}


def _tells(about: Theory, plan: Plan, a: Explanation, b: Explanation) -> str:
    """The one number of the test that the two differ in by most of its errors."""
    there, difference, variance = _difference(about, plan, a, b, True, 1)
    sd = np.sqrt(np.diag(variance))
    most = int(np.argmax(np.abs(difference) / sd))
    feature = there.data.features[most]
    what = f"{WORDS.get(feature.what, f'the {feature.what}')} of mode {feature.mode + 1}"
    if feature.what in WORDS:
        what += f" at channel {feature.channel + 1}"
    if feature.what in ("phase", "turn"):
        return f"{what}, {np.degrees(difference[most]):+.2g} +- {np.degrees(sd[most]):.2g} deg by {b.name}"
    return f"{what}, {100 * difference[most]:+.2g} +- {100 * sd[most]:.2g} % by {b.name}"


def _theory_there(about: Theory, plan: Plan, a: Explanation) -> Theory:
    """The planned test as an observation of what `a` predicts there."""
    spindle = about.spindle if plan.point is None else replace(about.spindle, points=(*about.spindle.points, plan.point))
    like = next((o for o in about.data.observations if o.shape is not None), about.data.observations[0])
    blank = Observation(
        Test("planned", plan.condition.temperature, plan.condition.speed), plan.condition, np.ones(1), np.ones(1), np.eye(2),
        None, None, None, None, ("axial",),
    )  # fmt: skip
    p = predict(replace(about, spindle=spindle).built(a.nuisance), blank, [*about.present, *_applied(plan, a)])
    low, high = spindle.hammer.band
    seen = np.flatnonzero((p.frequency > low) & (p.frequency < high))
    typical = np.sqrt(np.median(np.diag(like.covariance)[: len(like.frequency)]))
    sd = np.concatenate([np.full(len(seen), typical), np.full(len(seen), np.inf if like.shape is None else 2 * DAMPING_FLOOR)])
    o = replace(blank, frequency=p.frequency[seen], damping=p.damping[seen], covariance=np.diag(sd**2), kind=tuple(p.kind[i] for i in seen))
    if like.shape is not None:
        shape = p.shape[seen]
        largest = shape[np.arange(len(seen)), np.argmax(np.abs(shape), axis=1)][:, None]
        error = np.full(shape.shape, SHAPE_FLOOR)
        o = replace(o, shape=shape / largest, shape_sd=error, residue=largest * p.participation[seen], residue_sd=error[:, 0], kind=None)
    return theory(spindle, data_of([o]))


def _applied(plan: Plan, e: Explanation) -> Applied:
    return [*e.applied, (_waxed(plan.on), {"mass": plan.mass})] if plan.mass else e.applied


def _waxed(body: str) -> Effect:
    def spindle(s: Spindle, condition: Condition, values: Values) -> Spindle:
        bodies = tuple(replace(b, mass=b.mass + 1e-3 * values["mass"]) if b.name == body else b for b in s.structure.bodies)
        return replace(s, structure=replace(s.structure, bodies=bodies))

    mass = Parameter("mass", "g", 0.0, MASS, 1.0, (0.0, 1e3), "mass at the body's centre", "the plan")
    return Effect("waxed", f"A mass on {body}", "m + mass", (mass,), "", (), "small masses", spindle=spindle)


def _nuisance_there(about: Theory, there: Theory, x: Array) -> Array:
    """Build and gains as fitted; the new test's thermometer and a new channel are right."""
    result = np.zeros(len(there.sd))
    result[: len(about.build)] = x[: len(about.build)]
    first = len(there.build) + 1
    result[first : first + about.channels] = x[len(x) - about.channels :]
    return result


def _covariance_there(about: Theory, there: Theory, covariance: Array) -> Array:
    result = np.diag(there.sd**2)
    kept, first = len(about.build), len(there.build) + 1
    old = [*range(kept), *range(len(covariance) - about.channels, len(covariance))]
    new = [*range(kept), *range(first, first + about.channels)]
    result[np.ix_(new, new)] = covariance[np.ix_(old, old)]
    return result


def _predicted(about: Theory, plan: Plan, e: Explanation) -> tuple[ModePrediction, ...]:
    """Modes in the band, and how well they are known."""
    there = _theory_there(about, plan, e)
    by = derivative(there, _nuisance_there(about, there, e.nuisance), _applied(plan, e))
    sd = np.sqrt(np.diag(by @ _covariance_there(about, there, e.covariance) @ by.T))
    o, rows = there.data.observations[0], there.data.rows[0]
    damping = dict(zip(rows.mode_of_damping.tolist(), sd[rows.damping].tolist(), strict=True))
    found = zip(o.frequency.tolist(), sd[rows.frequency].tolist(), o.damping.tolist(), strict=True)
    return tuple(ModePrediction(f, f * s, zeta, zeta * damping.get(i, np.nan)) for i, (f, s, zeta) in enumerate(found))
