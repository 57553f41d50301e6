"""Which mode of one set is which of another: one cost, one assignment, and the policies of those who ask.

Let a and b be modes with frequencies f and shapes phi. A pair costs

    1 - MAC(phi_a, phi_b)  +  (1 - S) / 2  +  |ln(f_b / f_a) / width|^power  +  a penalty for another kind,

and all pairs are chosen at once, so that their total cost, plus `alone` for every two modes that stay alone, is least (an
assignment problem). S, the likeness of subspaces, counts only where a policy has a `mixing` distance: modes closer than
that turn within the space they span with the least change of the structure, so that no single shape of a close pair can
be trusted. A `Policy` holds these numbers; who needs others makes another one, with the reason beside it. Where shapes at
few points are alike, what all other pairs share decides between a paired mode and one without a partner (`by_common`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from thermospindle.model.rotor.modes import Mode
from thermospindle.model.types import Array, ComplexArray


@dataclass(frozen=True)
class Policy:
    """What makes two modes the same.

    `power` 2 forgives small frequency changes; 1 keeps a few that lie far off from moving all the others by one place.
    """

    width: float  # natural logarithm of a frequency ratio that costs as much as shapes without likeness
    power: int = 2
    alone: float = 1e6  # cost of a pair from which both modes rather stay alone; the default pairs as many as there are
    limit: float = np.inf  # |ln frequency ratio| from which a chosen pair is dropped again
    mixing: float = 0.0  # relative distance below which modes mix their shapes, so that the space they span counts too
    other_kind: float = 0.0  # penalty of a pair of which one mode is axial and the other is not; infinity forbids it
    kind: float = 0.0  # penalty of a pair of different kinds, where shapes are not known
    alike: float = -1.0  # difference in shape cost up to which shapes tell nothing of two modes, and what pairs share decides; below zero they always tell


MIXING = 0.03
"""Relative distance of two modes below which they turn in their plane at the slightest asymmetry, so that no shape of one alone is trusted."""

FOLLOWED_BY_KIND = Policy(width=0.1, other_kind=np.inf, alone=4.0)
"""Modes of one model from one step to the next: modes that cross keep their shapes, and what is axial stays axial; and a
mode of bearings that lose contact ends there: from one step to the next no mode moves by a sixth and changes its shape."""
BY_SHAPE = Policy(width=1.0, alone=1.0, mixing=MIXING)
"""Modes of one model at conditions or of parameters far apart, which may move anywhere: likeness of shape decides, a
MAC of a third at least where frequencies agree (0.44 of one that moves by half), and what is like none has no partner."""
IDENTIFIED = Policy(width=0.02, limit=0.02)
"""Modes identified in a virtual test, and those of the model that was tested: they differ by the identification's error only."""
MEASURED = Policy(width=0.3, alone=1.25, mixing=MIXING)
"""Modes measured at two conditions, of which either may lack some; shapes without likeness in spaces without likeness cost 1.5."""
COMPARED = Policy(width=0.08, power=1, alone=4.0, kind=3.0, alike=0.1)
"""Measured modes and those of a model that may be wrong."""
COMPUTED = Policy(width=0.08, power=1, other_kind=3.0)
"""Computed modes from one test to the next; shapes may be missing, where tests have other measuring points."""
NEARBY = Policy(width=1e-3, power=1)
"""Modes of one model at conditions so close that frequencies hardly move, as for a difference quotient."""
REPEATED = Policy(width=0.36, alone=0.7)
"""Modes of two tests of one machine: a MAC above 0.3, and frequencies within a factor of e^0.3 of each other."""
NEAREST = Policy(width=1.0, power=1)
"""Modes known by their frequencies alone: as many as there are, at the least sum of distances."""

OF_A_TABLE = Policy(width=1.0, kind=9.0)
"""Modes of a table, whose shapes nobody told, and those of a model that fits it: squares, for two modes of a
kind on one side of two measured ones cost the same either way in absolute differences, and would swap at random."""

OF_SHAPES = Policy(width=1.0, mixing=MIXING)
"""The same where the table tells shapes: of modes that these do not part, the nearest."""

SHIFT, STRENGTH = 0.01, float(np.log(3))
"""Standard deviations of ln frequency and ln strength about what all pairs share, at least: a model
that is right but for what all modes share."""
SHARED = 3
"""Other pairs, at least, that tell what all share."""
CLEARLY = 4.0
"""Sum of squares by which another pair must lie nearer to what all share: two standard deviations."""


@dataclass(frozen=True, eq=False)
class ModeSet:
    """Modes of one condition. m modes at n places: `frequency` (m,) Hz, `shape` (m, n) or None,
    `kind` (m,) or none known, `strength` (m,) the largest residue of the mobility or None."""

    frequency: Array
    shape: ComplexArray | None = None
    kind: Sequence[str] = ()
    strength: Array | None = None


def at_shared(a: ModeSet, b: ModeSet, nodes: Sequence[int], others: Sequence[int]) -> tuple[ModeSet, ModeSet]:
    """Two sets whose shapes are at points of their own, `nodes` (n,) of `a` and `others` of `b` (their first columns): with those
    at the points that both have, in one order, and without any where there are none. As they are where neither tells its points."""
    if tuple(nodes) == tuple(others):
        return a, b
    both = [n for n in nodes if n in others]

    def at(modes: ModeSet, own: Sequence[int]) -> ModeSet:
        return replace(modes, shape=modes.shape[:, [list(own).index(n) for n in both]] if both and modes.shape is not None else None)

    return at(a, nodes), at(b, others)


def mac(a: ArrayLike, b: ArrayLike) -> Array:
    """Modal assurance criterion (ma, mb) of complex shapes (ma, n) and (mb, n): |a^H b|^2 / (a^H a b^H b); zero for a shape that is zero.

    Allemang & Brown, Proc. 1st IMAC (1982) 110.
    """
    first, second = (x / np.maximum(np.linalg.norm(x, axis=1, keepdims=True), 1e-300) for x in (np.asarray(a), np.asarray(b)))
    return np.asarray(np.abs(first.conj() @ second.T) ** 2, float)


def subspace_mac(frequency: Array, shape: ComplexArray, others: ComplexArray, mixing: float) -> Array:
    """Part (m, o) of each of `others` (o, n) that lies in the space spanned by each mode (m, n) and those within `mixing` of it."""
    rows = []
    for f in frequency:
        basis = np.linalg.qr(shape[np.abs(frequency / f - 1) < mixing].T)[0]
        rows.append((np.abs(basis.conj().T @ others.T) ** 2).sum(0) / (np.abs(others) ** 2).sum(1))
    return np.reshape(rows, (len(frequency), len(others)))


def cost(a: ModeSet, b: ModeSet, policy: Policy) -> Array:
    """Cost (ma, mb) of every pair. Without shapes on either side, kinds stand for them."""
    ratio = np.log(b.frequency / np.asarray(a.frequency)[:, None])
    return np.asarray(np.abs(ratio / policy.width) ** policy.power + _unlike(a, b, policy), float)


def _unlike(a: ModeSet, b: ModeSet, policy: Policy) -> Array:
    """The part (ma, mb) of the cost that shapes and kinds have."""
    total = np.zeros((len(a.frequency), len(b.frequency)))
    if a.shape is not None and b.shape is not None:
        total += 1 - mac(a.shape, b.shape)
        if policy.mixing:
            # the larger of: b in the space of a's neighbours, a in the space of b's
            space = subspace_mac(a.frequency, a.shape, b.shape, policy.mixing)
            back = subspace_mac(b.frequency, b.shape, a.shape, policy.mixing).T
            total += (1 - np.maximum(space, back)) / 2
    elif policy.kind:
        total += policy.kind * (np.array(a.kind)[:, None] != np.array(b.kind)[None, :])
    if policy.other_kind:
        axial = [np.array([k == "axial" for k in modes.kind], bool) for modes in (a, b)]
        total[axial[0][:, None] != axial[1]] += policy.other_kind
    return total


def pairs(a: ModeSet, b: ModeSet, policy: Policy) -> NDArray[np.intp]:
    """(p, 2) indices of the same mode in `a` and in `b`; modes without a partner are left out.

    The matrix is padded so that each mode may also be left alone, at half of `alone`, which makes it an assignment without conditions.
    """
    na, nb = len(a.frequency), len(b.frequency)
    if not na or not nb:
        return np.zeros((0, 2), np.intp)
    padded = np.full((na + nb, na + nb), policy.alone / 2)
    padded[:na, :nb], padded[na:, nb:] = cost(a, b, policy), 0.0
    rows, columns = scipy.optimize.linear_sum_assignment(padded)
    chosen = np.stack([rows, columns], 1)[(rows < na) & (columns < nb)]
    if policy.alike >= 0:
        chosen = by_common(chosen, a, b, policy)
    distance = np.abs(np.log(b.frequency[chosen[:, 1]] / a.frequency[chosen[:, 0]]))
    return np.asarray(chosen[distance < policy.limit], np.intp)


def by_common(paired: NDArray[np.intp], a: ModeSet, b: ModeSet, policy: Policy) -> NDArray[np.intp]:
    """Pairs (p, 2), in place of each that lies far from what all others share a nearer one of its
    mode of `a` or `b` with one of like shape that has no partner.

    Of a pair u = ln(f_b / f_a), and the same of the strengths where both sets have them: an error of stiffness or mass moves
    all modes alike, another unit makes all stronger, and a pole of a disturbance or of the noise is weak and stands anywhere.
    Far is the sum of the squares of (u - median) / s, s = 1.48 times the median deviation of the other pairs, at least `SHIFT`
    and `STRENGTH` (Huber, *Robust Statistics*, 1981, 5.1). Alike are shapes whose cost differs by no more than `alike`, as
    those of a bar that is measured at one end. No partner is one whose u in frequency is more than `width` from the median.
    """
    unlike, found = _unlike(a, b, policy), [(int(i), int(j)) for i, j in paired]
    told = [(np.log(a.frequency), np.log(b.frequency), SHIFT)]
    if a.strength is not None and b.strength is not None:
        told.append((np.log(np.maximum(a.strength, 1e-300)), np.log(np.maximum(b.strength, 1e-300)), STRENGTH))

    def squares(pair: tuple[int, int], others: NDArray[np.intp]) -> float:
        total = 0.0
        for of_a, of_b, least in told:
            shared = of_b[others[:, 1]] - of_a[others[:, 0]]
            middle = np.median(shared)
            total += float(((of_b[pair[1]] - of_a[pair[0]] - middle) / max(least, 1.48 * np.median(np.abs(shared - middle)))) ** 2)
        return total

    for pair in tuple(found):
        if pair not in found or len(found) <= SHARED:
            continue
        others = np.array([p for p in found if p != pair])
        ratio = np.log(b.frequency[others[:, 1]] / a.frequency[others[:, 0]])
        held = others[np.abs(ratio - np.median(ratio)) <= policy.width]
        free = [np.setdiff1d(np.arange(len(modes.frequency)), held[:, side]).tolist() for side, modes in enumerate((a, b))]
        rivals = [(i, pair[1]) for i in free[0]] + [(pair[0], j) for j in free[1]]
        like = [p for p in rivals if unlike[p] <= unlike[pair] + policy.alike]
        nearest = min(like, key=lambda p: squares(p, others))
        if squares(nearest, others) + CLEARLY < squares(pair, others):
            found = [p for p in found if p[0] != nearest[0] and p[1] != nearest[1]] + [nearest]
    return np.array(sorted(found), np.intp).reshape(-1, 2)


def partners(a: ModeSet, b: ModeSet, policy: Policy) -> NDArray[np.intp]:
    """(ma,) index into `b` of the partner of every mode of `a`, -1 without one."""
    return as_partners(pairs(a, b, policy), len(a.frequency))


def as_partners(paired: NDArray[np.intp], count: int) -> NDArray[np.intp]:
    """Pairs (p, 2) as the partner (count,) of every first one, -1 without one."""
    partner = np.full(count, -1)
    partner[paired[:, 0]] = paired[:, 1]
    return partner


def in_order(partner: NDArray[np.intp], a: ModeSet, b: ModeSet, close: float, trusted: float | None = None) -> NDArray[np.intp]:
    """Partners (ma,) with those of close modes put in the order of their frequencies.

    Modes of `a`, whose frequencies rise, that are less than `close` apart (ln frequency) and whose partners are not axial turn in their
    plane, and their shapes there are chance. `trusted`: groups of which every member's 1 - MAC with its partner is less stay as they
    are, for modes with reliable shapes may cross.
    """
    partner = np.array(partner)
    free = np.array([i for i, j in enumerate(partner) if j >= 0 and b.kind[j] != "axial"], int)
    if not len(free):
        return partner
    for group in np.split(free, np.flatnonzero(np.diff(np.log(a.frequency[free])) > close) + 1):
        if trusted is not None and a.shape is not None and b.shape is not None:
            unlike = 1 - np.diag(mac(a.shape[group], b.shape[partner[group]]))
            if (unlike < trusted).all():
                continue
        partner[group] = partner[group][np.argsort(b.frequency[partner[group]])]
    return partner


def kept_in_order(partner: NDArray[np.intp], a: ModeSet, b: ModeSet, close: float) -> NDArray[np.intp]:
    """Partners (ma,) with neighbours of `b` that are close in both sets, and not axial, in the order of their frequencies.

    Unlike `in_order` this leaves pairs alone that are close in one set only: those have come apart, and their shapes count.
    """
    back = {int(j): i for i, j in enumerate(partner) if j >= 0 and b.kind[j] != "axial"}
    for j, k in pairwise(sorted(back)):
        i, h = back[j], back[k]
        if i > h and a.frequency[i] < (1 + close) * a.frequency[h] and b.frequency[k] < (1 + close) * b.frequency[j]:
            back[j], back[k] = h, i
    kept = np.array(partner)
    for j, i in back.items():
        kept[i] = j
    return kept


def track(conditions: Sequence[ModeSet], policy: Policy = MEASURED) -> NDArray[np.intp]:
    """(conditions, tracks) index of each mode in each condition, -1 where it was not found.

    Every condition is paired with the latest appearance of each track, so neighbours in the list should be neighbours in nature.
    """
    table = np.zeros((0, 0), np.intp)
    shapes = [np.asarray(c.shape) for c in conditions]
    frequency, shape = np.zeros(0), np.zeros((0, shapes[0].shape[1]), complex)
    for modes, own in zip(conditions, shapes, strict=True):
        row = partners(ModeSet(frequency, shape), modes, policy)
        new = np.setdiff1d(np.arange(len(modes.frequency)), row)
        table = np.pad(table, ((0, 0), (0, len(new))), constant_values=-1)
        table = np.vstack([table.reshape(-1, len(row) + len(new)), np.append(row, new)])
        found = np.flatnonzero(row >= 0)
        frequency[found], shape[found] = modes.frequency[row[found]], own[row[found]]
        frequency, shape = np.append(frequency, modes.frequency[new]), np.vstack([shape, own[new]])
    return table


# ---------------------------------------------------------------- modes of a model


def weighted(mass: Array, modes: Sequence[Mode]) -> ModeSet:
    """Modes of a model with their shapes times the root of its diagonal mass (n, n): then the MAC of two modes of one model is zero."""
    root = np.sqrt(np.diag(mass))
    return ModeSet(np.array([m.frequency for m in modes]), np.array([m.shape * root for m in modes]), [m.kind for m in modes])


def follow(mass: Array, first: Sequence[Mode], then: Sequence[Mode], policy: Policy = BY_SHAPE) -> list[int]:
    """Index into `then` of the partner of every mode of `first`, both of a model with the mass matrix (n, n); -1 without one."""
    return [int(j) for j in partners(weighted(mass, first), weighted(mass, then), policy)]


def by_kind(known: Sequence[tuple[str, float]], kinds: Sequence[str]) -> dict[int, int]:
    """Index among computed modes, whose `kinds` stand in order of frequency, by index of each `known` (kind, frequency): the
    k-th of a kind is the k-th of this kind. For modes measured or published without shapes."""
    found: dict[int, int] = {}
    for kind in dict.fromkeys(k for k, _ in known):
        own = sorted((i for i, (k, _) in enumerate(known) if k == kind), key=lambda i: known[i][1])
        found |= dict(zip(own, (i for i, k in enumerate(kinds) if k == kind), strict=False))
    return dict(sorted(found.items()))
