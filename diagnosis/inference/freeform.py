"""What would have to drift, where nobody names a cause: every element's stiffness and damping, the
rings' positions, the preload, the mass of what turns, and a spring that holds it from outside.

Free-form models compete with the named effects by the same evidence. They have no law: how much they change in each test is free, only
continuous over the conditions, and its width is learned. So a named effect whose law holds beats them, for it has less to choose; one
whose law is wrong, or an effect that no catalogue has, does not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import lsq_linear

from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.inference.gaussian import CANNOT
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.parameters.mechanism import Mechanism, asked_at
from thermospindle.model.bearing.pair import BearingState, PairState
from thermospindle.model.built.tolerance import scaled_preload
from thermospindle.model.machine import Condition, RingMotion, Spindle
from thermospindle.model.rotor.chain import Element, RotorBase
from thermospindle.model.structure import MOVES, Body
from thermospindle.model.types import Array
from thermospindle.model.units import HERTZ, RPM, TO_UM
from thermospindle.sim.effects import CATALOGUE, by_name
from thermospindle.sim.effects.effect import HOOKS, Effect, Parameter, Values, fitted_to, refusal

STIFFNESS_WIDTH, DAMPING_WIDTH, PRELOAD_WIDTH, MASS_WIDTH = 3.0, 20.0, 5.0, 3.0  # %
CROSS_WIDTH = 1.0  # % of the radial stiffness; where k_xy = -k_yx is as large a share of it as the loss factor, a whirl is at its limit of stability
RING_WIDTH = 0.2  # um
TIE_WIDTH = 2e-3  # of the stiffness at which what turns would swing in the middle of the band: a thousandth of a frequency there
ALIKE = 2e-4  # of the squares of what an effect moves, that a free form which is its own change may leave
NEARLY = 0.1  # of them, likewise, where a fit of the effect may start from what the free form says
FLAT = 0.1  # of the most that a law does, by which it does more in one test than in another
OF_BEAMS: list[tuple[str, tuple[int, ...]]] = [("axial", (2,)), ("shear", (0, 1)), ("bending", (3, 4))]
"""What each stiffness of a beam element resists, as its moves are told in `model.rotor.beam`."""
OF_EACH: list[tuple[str, tuple[int, ...]]] = [("radial", (0, 1)), ("axial", (2,))]
OF_BEARINGS: list[tuple[str, tuple[int, ...]]] = [("radial", (0, 1)), ("x", (0,)), ("y", (1,)), ("axial", (2,)), ("tilt", (3, 4))]


SKEW = np.zeros((5, 5))
SKEW[0, 1], SKEW[1, 0] = 1.0, -1.0


def free_forms(spindle: Spindle, reference: Condition | None = None) -> list[Mechanism]:
    """One mechanism for everything that might drift; its size in per cent (of ln) or um is what changes in each test. With a `reference`
    what the drawing has drifts from there, where it may be off as it may in all tests; what the drawing does not have acts anywhere."""
    found = []
    shafts = spindle.structure.shafts
    joints = spindle.structure.own_joints
    parts: list[tuple[str, tuple[str, ...], list[tuple[str, tuple[int, ...]]]]] = [(j.name, (j.name,), _groups(j.stiffness)) for j in joints]
    parts += [(s.name, s.elements, OF_BEAMS) for s in shafts]  # a shaft is one piece: its elements drift together
    for name, elements, groups in parts:
        if len(groups) > 1:
            found.append(_form(f"{name} stiffness", "%", STIFFNESS_WIDTH, chain=_scaled(elements, range(5), damping_too=True)))
        for label, moves in groups:
            found.append(_form(f"{name} {label} stiffness", "%", STIFFNESS_WIDTH, chain=_scaled(elements, moves, damping_too=True)))
        found.append(_form(f"{name} damping", "%", DAMPING_WIDTH, chain=_scaled(elements, range(0), damping_too=True, damping_only=True)))
    for name, bodies in [(s.name, s.bodies) for s in shafts if s.turns] + [(b.name, (b.name,)) for b in spindle.structure.rigid_bodies if b.turns]:
        found.append(_form(f"{name} mass", "%", MASS_WIDTH, chain=_heavier(bodies, whole=True)))
        found.append(_form(f"{name} transverse inertia", "%", MASS_WIDTH, chain=_heavier(bodies, whole=False)))
    names = [b.name for b in spindle.bearings]
    sets = [("bearings", names), *([(name, [name]) for name in names] if len(names) > 1 else [])]
    for label, own in sets:
        found.append(_form(f"{label} stiffness", "%", STIFFNESS_WIDTH, pair=_stiffened(own, range(5))))
        found.append(_form(f"{label} rings apart radially", "um", RING_WIDTH, motions=_moved(own, "outer_r")))
    for label, moves in OF_BEARINGS:
        found.append(_form(f"bearings {label} stiffness", "%", STIFFNESS_WIDTH, pair=_stiffened(names, moves)))
    for name, (label, moves) in product(names if len(names) > 1 else (), OF_EACH):
        found.append(_form(f"{name} {label} stiffness", "%", STIFFNESS_WIDTH, pair=_stiffened([name], moves)))
    found.append(_form("bearings damping", "%", DAMPING_WIDTH, pair=_damped(names)))
    of_sets = [s.name for s in spindle.sets]
    for label, own in [("preload", of_sets), *([(f"{name} preload", [name]) for name in of_sets] if len(of_sets) > 1 else [])]:
        found.append(_form(label, "%", PRELOAD_WIDTH, spindle=_preloaded(own)))
    found = [replace(m, reference=reference) for m in found]
    return [*found, *_tied(spindle), _form("bearings cross-coupled stiffness", "%", CROSS_WIDTH, pair=_crossed(names))]


def _tied(spindle: Spindle) -> list[Mechanism]:
    """A spring between the ground and what turns: a seal that rubs, a hose, a tool that touches; one that pushes away
    is a magnet's (Earnshaw). It acts at the middle, and on a shaft, across the axis, at any measuring point too."""
    if not any(b.turns for b in spindle.structure.bodies):
        return []
    low, high = spindle.hammer.band
    rotor = spindle.turning
    shaft = next((s for s in spindle.structure.shafts if rotor.name in s.bodies), None)
    places = {p.body: p.name for p in reversed(spindle.points) if shaft and p.body in shaft.bodies and p.body != rotor.name}
    width = TIE_WIDTH * spindle.turning_mass * HERTZ**2 * low * high / TO_UM
    ways: list[tuple[str, Body, tuple[int, ...]]] = [("", rotor, (0, 1, 2)), (" across the axis", rotor, (0, 1)), (" along the axis", rotor, (2,))]
    ways += [(f" across the axis at {name}", spindle.structure.body(body), (0, 1)) for body, name in reversed(places.items())]
    named = shaft.name if shaft else rotor.name
    return [_form(f"spring from {named} to ground{label}", "N/um", width, chain=_tie(at, moves)) for label, at, moves in ways]


def _form(name: str, unit: str, width: float, **hooks: Any) -> Mechanism:
    reach = {"%": 400.0, "um": 20.0}.get(unit, 1e3 * width)
    size = Parameter("change", unit, 0.0, width, width, (-reach, reach), f"change of {name}", "free")
    effect = Effect(name, f"{name} drifts freely", "", (size,), "", (), "", **hooks)
    return Mechanism(effect, {}, (), free=True)


def _groups(stiffness: tuple[float, ...]) -> list[tuple[str, tuple[int, ...]]]:
    """Moves that share a stiffness, as tolerances have them, and each of two by itself: what loosens, cracks or wears does so on one side."""
    found: list[tuple[str, tuple[int, ...]]] = []
    for label, moves in (("axial", (2,)), ("lateral", (0, 1)), ("tilt", (3, 4))):
        if not stiffness[moves[0]]:
            continue
        if len({stiffness[m] for m in moves}) == 1:
            found.append((label, moves))
        if len(moves) > 1:
            found += [(MOVES[m].replace("_", " "), (m,)) for m in moves]
    return found


def _factor(values: Values) -> float:
    return float(np.exp(values["change"] / 100))


def _congruent(matrix: Array, moves, factor: float) -> Array:
    """D K D with the root of `factor` on `moves`: those entries times the factor, and positive as before."""
    d = np.ones(5)
    d[list(moves)] = np.sqrt(factor)
    return d[:, None] * matrix * d[None, :]


def _scaled(names: Sequence[str], moves, damping_too: bool, damping_only: bool = False):
    def chain(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase) -> RotorBase:
        f = _factor(values)
        elements = []
        for e in chain.elements:
            if e.name in names and damping_only:
                e = replace(e, damping=f * e.damping)
            elif e.name in names:
                e = replace(e, stiffness=_congruent(e.stiffness, moves, f), damping=_congruent(e.damping, moves, f) if damping_too else e.damping)
            elements.append(e)
        return replace(chain, elements=tuple(elements))

    return chain


def _heavier(names: Sequence[str], whole: bool):
    """Mass and moments of inertia of bodies times the factor, or their transverse moments alone."""

    def chain(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase) -> RotorBase:
        f = _factor(values)

        def changed(b: Body) -> Body:
            x, y, z = b.inertia
            return replace(b, mass=f * b.mass if whole else b.mass, inertia=(f * x, f * y, f * z if whole else z))

        return replace(chain, bodies=tuple(changed(b) if b.name in names else b for b in chain.bodies))

    return chain


def _tie(rotor: Body, moves: Sequence[int]):
    along = np.diag([float(m in moves) for m in range(5)])

    def chain(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase) -> RotorBase:
        tie = Element("tie", "tie", "ground", rotor.name, rotor.z, values["change"] * TO_UM * along, 0 * along)
        return replace(chain, elements=(*chain.elements, tie))

    return chain


def _stiffened(names: list[str], moves):
    def pair(spindle: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
        f = _factor(values)
        bearings = tuple(
            replace(b, stiffness=_congruent(b.stiffness, moves, f), damping=_congruent(b.damping, moves, f)) if b.name in names else b
            for b in state.bearings
        )
        return replace(state, bearings=bearings)

    return pair


def _crossed(names: list[str]):
    """k_xy = -k_yx, told as a change of the radial stiffness would be: what films and seals have, and feeds
    one whirl while it damps the other (Friswell and others, *Dynamics of Rotating Machines*, 2010, 7.3)."""

    def pair(spindle: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
        def crossed(b: BearingState) -> BearingState:
            cross = (_factor(values) - 1) * (b.stiffness[0, 0] + b.stiffness[1, 1]) / 2
            return replace(b, stiffness=b.stiffness + cross * SKEW)

        return replace(state, bearings=tuple(crossed(b) if b.name in names else b for b in state.bearings))

    return pair


def _damped(names: list[str]):
    def pair(spindle: Spindle, condition: Condition, values: Values, state: PairState) -> PairState:
        f = _factor(values)
        return replace(state, bearings=tuple(replace(b, damping=f * b.damping) if b.name in names else b for b in state.bearings))

    return pair


def _moved(names: list[str], coordinate: str):
    def motions(spindle: Spindle, condition: Condition, values: Values, by_bearing: dict[str, RingMotion]) -> dict[str, RingMotion]:
        move = 1e-6 * values["change"]
        return {b: replace(m, **{coordinate: getattr(m, coordinate) + move}) if b in names else m for b, m in by_bearing.items()}

    return motions


def _preloaded(sets: list[str]):
    def changed(spindle: Spindle, condition: Condition, values: Values) -> Spindle:
        return scaled_preload(spindle, _factor(values), sets)

    return changed


def alike(model: CampaignModel, x: Array, free: Mechanism, named: Mechanism, shape: Sequence[float] | None = None, errors: Array | None = None) -> bool:
    """Whether a free form changes what an effect of the catalogue changes, whatever the law:
    whether in every test the two move all lines in the same direction, to `ALIKE` of their squares.
    `x` (P,) are the nuisances where that is asked, and `shape` (k,) the effect's (neutral unless given), with standard
    `errors` (k,) of it: the two do change the same where they do at a shape no more than `CANNOT` of these away."""
    of_free, of_named = _by_size(model, x, free), _by_size(model, x, named, shape)
    apart = _apart(of_free, of_named)
    if apart < ALIKE or errors is None or shape is None or apart >= NEARLY or not errors.any():
        return apart < ALIKE
    nearest = _nearest(model, x, of_free, of_named, named, np.asarray(shape, float), CANNOT * errors)
    return _apart(of_free, _by_size(model, x, named, nearest.tolist())) < ALIKE


def _nearest(model: CampaignModel, x: Array, of_free: Sequence[Array], of_named: Sequence[Array], named: Mechanism, shape: Array, reach: Array) -> Array:
    """The shape (k,) within limits and `reach` (k,) of the one given at which, to first order, an effect moves lines most as a free form does."""
    low, high = (np.clip(shape + way * reach, *np.array([q.limits for q in named.shape]).T) for way in (-1, 1))
    moved = np.flatnonzero(high > low)
    columns = []
    for k in moved:
        there = shape.copy()
        there[k] = high[k] if high[k] - shape[k] > shape[k] - low[k] else low[k]
        turned = zip(_by_size(model, x, named, there.tolist()), of_named, strict=True)
        columns.append(np.concatenate([_beside(f, n - o) for f, (n, o) in zip(of_free, turned, strict=True)]) / (there[k] - shape[k]))
    left = np.concatenate([_beside(f, n) for f, n in zip(of_free, of_named, strict=True)])
    found = shape.copy()
    if len(moved):
        found[moved] += lsq_linear(np.stack(columns, axis=1), -left, (low[moved] - shape[moved], high[moved] - shape[moved])).x
    return found


def as_told_by(model: CampaignModel, x: Array, free: Mechanism, named: Mechanism, sizes: Array) -> Array | None:
    """Sizes (tests,) of an effect of the catalogue with a law of the data's own that do, to first order about nuisances `x` (P,), what
    `sizes` (tests,) of a free form do; None where the two do not move the same: to `NEARLY` of the squares, enough to start a fit from."""
    of_free, of_named = _by_size(model, x, free), _by_size(model, x, named)
    if _apart(of_free, of_named) >= NEARLY:
        return None
    return named.size.neutral + sizes * _shares(of_free, of_named)


def runs_against(model: CampaignModel, x: Array, law: Mechanism, own: Mechanism, sizes: Array, covariance: Array) -> bool:
    """Whether an effect that can only be of one sign, with a law of the data's `own`, is told by nothing but that there is
    less of it where its `law` has more: sizes (tests,) of which none is known to be there, for a tolerance does what all have
    in common, and which are less, by more than `CANNOT` standard errors, where the law does more, and nowhere there more."""
    amounts = own.size.sign * (sizes - own.size.neutral)
    if not own.size.sign or np.any(amounts > 2 * np.sqrt(np.maximum(np.diag(covariance), 0.0))):
        return False
    by_law = _shares(_by_size(model, x, law), _by_size(model, x, own))
    least = int(np.argmin(by_law))
    more = by_law - by_law[least] > FLAT * np.abs(by_law).max()
    apart, variance = amounts - amounts[least], np.diag(covariance) + covariance[least, least] - 2 * covariance[least]
    by = (apart / np.sqrt(np.maximum(variance, 1e-300)))[more]
    return bool(np.any(by < -CANNOT) and not np.any(by > 2))


def _by_size(model: CampaignModel, x: Array, m: Mechanism, shape: Sequence[float] | None = None) -> list[Array]:
    """Derivatives (N,) of every test by the size of a mechanism that does nothing yet."""
    at = [(m.effect, m.values(m.size.neutral, [q.neutral for q in m.shape] if shape is None else shape))]
    return [Problem(model, (m,)).by_size(t, x, at, 0) for t in range(len(model.tests))]


def _shares(of: Sequence[Array], by: Sequence[Array]) -> Array:
    """How much (tests,) of what moves lines `by` so much does what another moves them, by least squares; none where it moves nothing."""
    return np.array([float(o @ b) / float(b @ b) if b.any() else 0.0 for o, b in zip(of, by, strict=True)])


def _apart(of_free: Sequence[Array], of_named: Sequence[Array]) -> float:
    """The share of the squares of what an effect moves that a free form's change leaves; all of it where it moves nothing."""
    whole = sum(float(n @ n) for n in of_named)
    return sum(float(r @ r) for r in map(_beside, of_free, of_named)) / whole if whole > 0 else 1.0


def _beside(form: Array, moved: Array) -> Array:
    """What is left (N,) of what is `moved` in a test beside a free form of any size there."""
    square = float(form @ form)
    return moved - (form @ moved) / square * form if square > 0 else moved


def drifting(
    element: str, *, name: str, title: str, equation: str, law: Callable, parameters: tuple[Parameter, ...], source: str,
    at: Mapping[str, float] | None = None, others: Mapping[str, float] | None = None,
) -> Effect:
    """An effect of one's own: what the free form called `element` changes, by `law`(temperature C, speed rpm, values) in its
    unit; with `others` what the effect of the catalogue called `element` changes, its size by the law and these parameters as
    given, by its formula or with `at` as that has it at this condition (temperature_C, speed_rpm, level_N, soak_time_min).

    What `spindle draft` writes is made with it; it acts where the free form or that effect acts, and at size zero not at all.
    """
    known = None if others is None else by_name(element, CATALOGUE)

    def acts(spindle: Spindle) -> Effect:
        if known is not None:
            effect = fitted_to(known, spindle)
            return effect if at is None else asked_at(effect, _condition(at))
        found = next((m for m in free_forms(spindle) if m.name == element), None)
        if found is None:
            raise ValueError(f"effect {name}: spindle {spindle.name} has no {element}")
        return found.effect

    def hook(key: str) -> Callable:
        def changed(spindle: Spindle, condition: Condition, values: Values, *what: Any) -> Any:
            effect, change = acts(spindle), float(law(condition.temperature, condition.speed / RPM, values))
            acting, size = getattr(effect, key), effect.parameters[0]
            sized = {**effect.neutral(), **(others or {}), size.name: float(np.clip(size.neutral + change, *size.limits))}
            unchanged = what[-1] if what else condition if key == "condition" else spindle
            return acting(spindle, condition, sized, *what) if acting and change else unchanged

        return changed

    def idle(spindle: Spindle) -> str | None:
        if known is not None:
            return refusal(known, spindle)
        return None if any(m.name == element for m in free_forms(spindle)) else f"the scene has no {element}"

    alike: tuple[str, ...] = ("grease_damping",) if "damping" in element else ("mount_compliance", "modulus_softening")
    if any(word in element for word in ("rings", "preload", "bearings")):
        alike = ("preload_loss", "bond_softening")
    if element.endswith(("mass", "inertia")):
        alike = ("added_disk", "sensor_mass")
    if known is not None:
        alike = (known.name, *known.resembles)
    hooks: dict[str, Any] = {key: hook(key) for key in HOOKS if known is None or getattr(known, key)}
    sees = f"whatever a change of {element} shows, over the conditions of its law"
    return Effect(
        name, title, equation, parameters, sees, alike, f"the tests it was drafted from: {source}", idle=idle, drifts=element, **hooks
    )  # fmt: skip


def _condition(at: Mapping[str, float]) -> Condition:
    soak = 60 * at["soak_time_min"] if "soak_time_min" in at else np.inf
    return Condition(at["temperature_C"], at["speed_rpm"] * RPM, at.get("level_N", 0.0), soak)
