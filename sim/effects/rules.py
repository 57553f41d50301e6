"""The rules every effect keeps, those of the catalogue and those of users alike.

`check_words` needs the effect alone; `check` tries it on a spindle at three conditions: at rest at the reference temperature, hot and
turning, and warm, turning, struck hard and short of soaked. Each rule refuses (`BadInput`) with one sentence that names the effect,
its parameter, and what is asked.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from math import isfinite

import numpy as np

from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor import mjcf
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.rotor.elements import ELEMENTS
from thermospindle.sim.effects import CATALOGUE, checked
from thermospindle.sim.effects.effect import HOOKS, Effect, Parameter
from thermospindle.sim.effects.trial import Broken, Trial, every_word, moved, told, trial
from thermospindle.sim.operating import operating_point
from thermospindle.thermal.expansion import expand

SEEN = 1e-6  # relative change of a frequency, damping ratio or FRF that counts; rounding of the eigenproblem is 1e-10
WORDS = 10  # letters, the least that say something


# ---------------------------------------------------------------- what an effect says of itself


def has_a_name(effect: Effect, known: Sequence[str]) -> None:
    if not (isinstance(effect.name, str) and effect.name.isidentifier()):
        raise Broken("its name must be one word of letters, digits and _")


def says_what_it_is(effect: Effect, known: Sequence[str]) -> None:
    for key in ("title", "equation", "sees", "valid"):
        text = getattr(effect, key)
        if not isinstance(text, str) or len(text.strip()) <= WORDS:
            raise Broken(f"{key} = {text!r}: must say it in words")


def resembles_others(effect: Effect, known: Sequence[str]) -> None:
    names = effect.resembles
    if not isinstance(names, tuple) or not names:
        raise Broken(f"resembles = {names!r}: must be a tuple of names of effects it is easily confused with, one at least")
    for name in names:
        if name not in known or name == effect.name or names.count(name) > 1:
            raise Broken(f"resembles: {name!r}: must name other effects, each once; allowed are {', '.join(known)}")


def does_something(effect: Effect, known: Sequence[str]) -> None:
    if not any(getattr(effect, hook) for hook in HOOKS):
        raise Broken(f"has no function; it needs one of {', '.join(HOOKS)}")


def has_full_rows(effect: Effect, known: Sequence[str]) -> None:
    rows = effect.parameters
    if not isinstance(rows, tuple) or not rows or not all(isinstance(p, Parameter) for p in rows):
        raise Broken("parameters must be a tuple of sim.effects.effect.Parameter, the size of the effect first")
    for p in rows:
        if not (isinstance(p.name, str) and p.name.isidentifier()) or [q.name for q in rows].count(p.name) > 1:
            raise Broken(f"parameter {p.name!r}: names of parameters must differ and be one word of letters, digits and _ each")
        for key in ("unit", "meaning", "source"):
            text, least = getattr(p, key), 0 if key == "unit" else WORDS
            if not isinstance(text, str) or len(text.strip()) <= least:
                raise Broken(f"parameter {p.name}: {key} = {text!r}: must say it in words" + (", 1 for a pure number" * (not least)))
        numbers = (p.neutral, p.typical, p.prior_sd, *p.limits)
        if len(p.limits) != 2 or not all(isinstance(v, int | float) and isfinite(v) for v in numbers):
            raise Broken(f"parameter {p.name}: neutral, typical, prior_sd and the two limits must be finite numbers")
        for key in ("neutral", "typical"):
            if not p.limits[0] <= (value := getattr(p, key)) <= p.limits[1]:
                raise Broken(f"parameter {p.name}: {key} = {value:g}: must lie within its limits, {p.limits[0]:g} to {p.limits[1]:g}")
        if p.prior_sd <= 0 or p.limits[0] == p.limits[1]:
            raise Broken(f"parameter {p.name}: prior_sd = {p.prior_sd:g}, limits = {p.limits}: both must leave it room")
    if rows[0].typical == rows[0].neutral:
        said = "the size of an effect must not be neutral where it is present"
        raise Broken(f"parameter {rows[0].name}: typical = {rows[0].typical:g}: {said}")


def travels(effect: Effect, known: Sequence[str]) -> None:
    try:
        same = pickle.loads(pickle.dumps(effect)) == effect
    except Exception as error:
        text = " ".join(str(error).split())
        raise Broken(f"cannot be sent to other processes: its functions must stand at the top of their file ({text})") from None
    if not same:
        raise Broken("comes back changed from another process: its functions must stand at the top of their file")


SAID: tuple[Callable[[Effect, Sequence[str]], None], ...] = (
    has_a_name,
    says_what_it_is,
    does_something,
    has_full_rows,
    resembles_others,
    travels,
)


# ---------------------------------------------------------------- what an effect does


def neutral_returns_the_same_objects(t: Trial) -> None:
    """Every function at neutral values returns what it was given, the object itself: an exact no-op."""
    effect, values = t.effect, t.effect.neutral()
    for condition in t.conditions:
        point = operating_point(t.spindle, condition, ())
        given: dict[str, object] = {
            "spindle": point.spindle,
            "temperatures": {g.name: condition.temperature for g in point.spindle.regions},
            "motions": dict(expand(point.spindle, condition.temperature)),
            "pair": point.state,
            "chain": point.chain,
            "imperfections": point.imperfections,
            "measurement": point.measurement,
        }
        for hook, before in given.items():
            function = getattr(effect, hook)
            if function is None:
                continue
            arguments = [] if hook == "spindle" else [point.chain, before] if hook == "measurement" else [before]
            if function(point.spindle, condition, values, *arguments) is not before:
                raise Broken(f"{hook} must return the object it was given when every parameter is neutral ({told(values)})")


def neutral_changes_nothing(t: Trial) -> None:
    """Bit for bit, and with the size neutral beside typical values of the other parameters."""
    main = t.effect.parameters[0]
    for values in (t.effect.neutral(), t.effect.typical() | {main.name: main.neutral}):
        for before, after in zip(t.before, t.seen(values), strict=True):
            if moved(before, after) != 0.0:
                raise Broken(f"parameter {main.name}: at its neutral value ({told(values)}) it must change nothing, to the last bit")


def elsewhere(p: Parameter) -> float:
    """A value that is not the neutral one: typical, or one prior standard deviation off, inside the limits."""
    if p.typical != p.neutral:
        return p.typical
    return p.neutral + p.prior_sd if p.neutral + p.prior_sd <= p.limits[1] else max(p.neutral - p.prior_sd, p.limits[0])


def every_parameter_moves_something(t: Trial) -> None:
    """With the effect at its typical size: each parameter elsewhere than neutral against neutral, at some condition."""
    for p in (p for p in t.effect.parameters if len(p.choices) != 1):  # of one alone there is nothing to choose
        ends = [t.seen(t.effect.typical() | {p.name: x}) for x in (p.neutral, elsewhere(p))]
        change = max(moved(a, b) for a, b in zip(*ends, strict=True))
        if change <= SEEN:
            raise Broken(
                f"parameter {p.name}: from {p.neutral:g} to {elsewhere(p):g} {p.unit} it moves frequencies, dampings and FRFs of "
                f"{t.spindle.name} by {change:.1g} at most; a parameter must move something by more than {SEEN:g}"
            )


def refuses_what_is_beyond_its_limits(t: Trial) -> None:
    for p in t.effect.parameters:
        for beyond in (p.limits[0] - 1.0, p.limits[1] + 1.0):
            try:
                checked(t.effect, {p.name: beyond})
            except BadInput:
                continue
            raise Broken(f"parameter {p.name}: takes {beyond:g}, beyond its limits")


def leaves_its_arguments_alone(t: Trial) -> None:
    t.seen(t.effect.typical())
    if every_word(t.spindle) != t.words:
        raise Broken("changes the spindle it is given; a function of an effect must return a changed copy")


def mujoco_carries_it(t: Trial) -> None:
    """The MuJoCo model of a point with the effect linearises to the chain's matrices."""
    point = t.points(t.effect.typical())[-1]
    own = matrices(point.chain)
    size = np.sqrt(np.abs(np.outer(np.diag(own.stiffness), np.diag(own.stiffness))))
    rounding = 1e-12 * np.abs(own.stiffness).max()  # what nothing holds, as between loose bearings, has no size
    for element in ELEMENTS:
        try:
            found = mjcf.linearise(point.spec(element).compile())
        except (ValueError, RuntimeError) as error:
            raise Broken(f"MuJoCo cannot carry it with {element} bearings: {' '.join(str(error).split())}") from None
        same = (
            found.dofs == own.dofs
            and np.abs(found.mass - own.mass).max() < 1e-9 * own.mass.max()
            and (np.abs(found.stiffness - own.stiffness) <= 1e-6 * size + rounding).all()
            and np.abs(found.damping - own.damping).max() < 1e-9 * np.abs(own.damping).max()
        )
        if not same:
            raise Broken(f"MuJoCo's model of it with {element} bearings has other matrices; stiffness and damping must be symmetric")


DONE: tuple[Callable[[Trial], None], ...] = (
    neutral_returns_the_same_objects,
    neutral_changes_nothing,
    refuses_what_is_beyond_its_limits,
    every_parameter_moves_something,
    leaves_its_arguments_alone,
    mujoco_carries_it,
)


# ---------------------------------------------------------------- all of them


def check_words(effect: Effect, known: Sequence[Effect] = CATALOGUE, where: str = "") -> None:
    """Refuse (`BadInput`) an effect that does not say what it is; `where` is its file, `known` what it may resemble."""
    for rule in SAID:
        try:
            rule(effect, [e.name for e in known])
        except Broken as error:
            raise BadInput(f"{_where(effect, where)}: {error}") from None


def check(effect: Effect, spindle: Spindle, known: Sequence[Effect] = CATALOGUE, where: str = "") -> None:
    """Refuse (`BadInput`) an effect that breaks a rule of the catalogue, in its words or on a spindle."""
    check_words(effect, known, where)
    on = trial(effect, spindle, where)
    for rule in DONE:
        try:
            rule(on)
        except Broken as error:
            raise BadInput(f"{_where(effect, where)}: {error}") from None


def _where(effect: Effect, where: str) -> str:
    return f"{where}: effect {effect.name}" if where else f"effect {effect.name}"
