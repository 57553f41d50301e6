"""What is set on the workbench, and how it got there: plain values and pure functions, without a page.

A `Setting` says what differs from the scene as it was opened; a `Session` is the setting now, those before and after it (undo,
redo) and the steps that were kept (the ladder). Every action returns a new one, and the same object where it changes nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from thermospindle.sim.effects.effect import Effect, Parameter

MOST = 200  # settings that undo remembers
REACH = 4.0  # of a typical size or prior standard deviation, how far a slider goes from the neutral value
FAR = 3.0  # standard deviations, how far the slider of a tolerance goes
FURTHEST = (-0.49, 0.99)  # relative deviations that a scene may have


@dataclass(frozen=True)
class Setting:
    """`effects`: parameter values by name of effect, in the order they were added; `deviations`: relative, of toleranced parameters by
    name, none of zero; `left_out`: ids of tests; `free`: what is to be fitted, tolerances by name and parameters as effect.parameter."""

    effects: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    deviations: Mapping[str, float] = field(default_factory=dict)
    left_out: frozenset[str] = frozenset()
    free: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Step:
    """A step that was kept: rms errors in standard errors of fitted and of left-out tests, None where there are none."""

    name: str
    setting: Setting
    fitted: float | None
    left_out: float | None


@dataclass(frozen=True)
class Session:
    now: Setting = field(default_factory=Setting)
    past: tuple[Setting, ...] = ()
    future: tuple[Setting, ...] = ()
    ladder: tuple[Step, ...] = ()


# ---------------------------------------------------------------- settings


def key_of(effect: str, parameter: str) -> str:
    return f"{effect}.{parameter}"


def add_effect(s: Setting, effect: Effect, values: Mapping[str, float] | None = None) -> Setting:
    """With an effect more, at its typical values where none are given; its size is to be fitted."""
    chosen = {name: min(max(v, p.limits[0]), p.limits[1]) for p in effect.parameters for name, v in [(p.name, (values or {}).get(p.name, p.typical))]}
    if s.effects.get(effect.name) == chosen:
        return s
    free = s.free if effect.name in s.effects else s.free | {key_of(effect.name, effect.parameters[0].name)}
    return replace(s, effects={**s.effects, effect.name: chosen}, free=free)


def remove_effect(s: Setting, name: str) -> Setting:
    if name not in s.effects:
        return s
    kept = {n: v for n, v in s.effects.items() if n != name}
    return replace(s, effects=kept, free=frozenset(k for k in s.free if k.rpartition(".")[0] != name))


def set_value(s: Setting, effect: str, parameter: str, value: float) -> Setting:
    """With another value; KeyError for an effect or parameter that is not there."""
    if s.effects[effect][parameter] == value:
        return s
    return replace(s, effects={**s.effects, effect: {**s.effects[effect], parameter: value}})


def set_deviation(s: Setting, name: str, value: float) -> Setting:
    if s.deviations.get(name, 0.0) == value:
        return s
    rest = {n: v for n, v in s.deviations.items() if n != name}
    return replace(s, deviations=rest if value == 0.0 else {**rest, name: value})


def set_named(s: Setting, values: Mapping[str, float]) -> Setting:
    """With values by the names of `Setting.free`."""
    for key, value in values.items():
        effect, dot, parameter = key.rpartition(".")
        s = set_value(s, effect, parameter, value) if dot and effect in s.effects else set_deviation(s, key, value)
    return s


def leave_out(s: Setting, tests: Sequence[str]) -> Setting:
    return s if s.left_out == frozenset(tests) else replace(s, left_out=frozenset(tests))


def set_free(s: Setting, name: str, free: bool) -> Setting:
    chosen = s.free | {name} if free else s.free - {name}
    return s if chosen == s.free else replace(s, free=chosen)


def computed(s: Setting) -> Setting:
    """The setting as far as anything is computed from it."""
    return replace(s, free=frozenset())


def words(s: Setting) -> str:
    """A setting in a line."""
    said = [f"{name} {next(iter(values.values())):.4g}" for name, values in s.effects.items()]
    count = len(s.deviations)
    said += [f"{name} {value:+.2%}" for name, value in s.deviations.items()] if count < 3 else [f"{count} tolerances"]
    return ", ".join(said) or "the scene as it was opened"


# ---------------------------------------------------------------- undo, redo, the ladder


def do(session: Session, setting: Setting) -> Session:
    """The session with another setting, which can be undone."""
    if setting == session.now:
        return session
    return replace(session, now=setting, past=(*session.past, session.now)[-MOST:], future=())


def amend(session: Session, setting: Setting) -> Session:
    """The session with another setting in place of the last, as one step: keys of a slider pressed one after the other."""
    if setting == session.now:
        return session
    return replace(session, now=setting, future=()) if session.past else do(session, setting)


def undo(session: Session) -> Session:
    if not session.past:
        return session
    return replace(session, now=session.past[-1], past=session.past[:-1], future=(session.now, *session.future))


def redo(session: Session) -> Session:
    if not session.future:
        return session
    return replace(session, now=session.future[0], past=(*session.past, session.now), future=session.future[1:])


def keep(session: Session, fitted: float | None, left_out: float | None) -> Session:
    """The session with the setting of now as a step of the ladder, unless it is the last one already."""
    if session.ladder and session.ladder[-1].setting == session.now:
        return session
    step = Step(f"{len(session.ladder) + 1}: {words(session.now)}", session.now, fitted, left_out)
    return replace(session, ladder=(*session.ladder, step))


def take_up(session: Session, step: int) -> Session:
    """The session with the setting of a step of the ladder, which can be undone."""
    return do(session, session.ladder[step].setting)


# ---------------------------------------------------------------- sliders


def span(p: Parameter, value: float | None = None) -> tuple[float, float]:
    """Ends of a slider: some typical sizes about the neutral value, inside the limits, and as far as `value` lies."""
    reach = REACH * max(abs(p.typical - p.neutral), p.prior_sd)
    low, high = max(p.limits[0], p.neutral - reach), min(p.limits[1], p.neutral + reach)
    return (low, high) if value is None else (min(low, value), max(high, value))


def span_of_tolerance(sd: float, value: float = 0.0) -> tuple[float, float]:
    return max(FURTHEST[0], min(-FAR * sd, value)), min(FURTHEST[1], max(FAR * sd, value))
