"""Modes of the reference condition, in whose coordinates a model is constantly a little wrong, and
what such an error makes of the stiffness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigh

from thermospindle.model.rotor.chain import Matrices
from thermospindle.model.types import Array, Integers

COINCIDE = 0.01  # of a frequency, within which modes are a pair or a cluster
FAR_APART = 0.1  # of the lower square of two frequencies, from which an error of the stiffness between two modes turns their shapes alone
RIGID = 1e-6  # of the highest frequency, below which a mode is a rigid body's: rounding leaves some 1e-8 of it, and a beam's highest is in MHz


@dataclass(frozen=True, eq=False)
class ReferenceModes:
    """Undamped modes of the reference condition: angular frequencies (m,), damping ratios (m,), M f (n, m) over the named dofs.

    The first `seen` lie in the band of the measurement; those above lend them some of their shapes.
    """

    omega: Array
    damping: Array
    weighted: Array
    dofs: tuple[tuple[str, str], ...]
    seen: int

    def turned(self, stated: Array) -> Turned:
        """The error of the stiffness over the modal matrix (m, m) where so much is `stated` of each pair."""
        return Turned(stated, self.gaps, self.seen)

    @cached_property
    def gaps(self) -> Array:
        """1 / (w_i^2 - w_j^2) (m, m) of modes that are `FAR_APART`, else zero."""
        square = self.omega**2
        difference = square[:, None] - square
        apart = np.abs(difference) > FAR_APART * np.minimum(square[:, None], square)
        return np.where(apart, 1 / np.where(apart, difference, 1.0), 0.0)

    def over(self, dofs: Sequence[tuple[str, str]]) -> Array:
        """M f over other dofs: zero for those that the reference has not; read only."""
        if (known := tuple(dofs)) not in self._over:
            place = {dof: i for i, dof in enumerate(self.dofs)}
            found = np.array([self.weighted[place[dof]] if dof in place else np.zeros(len(self.omega)) for dof in dofs])
            found.flags.writeable = False
            self._over[known] = found
        return self._over[known]

    @cached_property
    def _over(self) -> dict[tuple[tuple[str, str], ...], Array]:
        return {}

    def moved(self, plain: Matrices, acting: Matrices) -> Array:
        """Relative changes (2, seen) of the frequency and the damping of the modes seen from one
        state to another of the same dofs, to first order."""
        omega, damping = self.omega[: self.seen], self.damping[: self.seen]
        shape = np.linalg.solve(plain.mass, self.over(plain.dofs)[:, : self.seen])
        of_k, of_m, of_c = (np.einsum("ni,nj,ji->i", shape, getattr(acting, w) - getattr(plain, w), shape) for w in ("stiffness", "mass", "damping"))
        return np.array([(of_k - omega**2 * of_m) / (2 * omega**2), of_c / (2 * damping * omega)])


@dataclass(frozen=True, eq=False)
class Turned:
    """A constant error of the stiffness between modes, E (m, m) over the modal matrix, of what is
    `stated` of every pair of modes: with what keeps frequencies, to the second order, as these have them.

    An error of the stiffness between two modes turns their shapes, to the first order, and pushes their frequencies apart, to
    the second, by more than these are known to: what fits a shape would bend the valley of every fit. So shapes of modes that
    are `FAR_APART` turn, and frequencies stay: K = e^-T (K_0 + X) e^T, T_ij = X_ij / (w_i^2 - w_j^2), to the second order in X.
    """

    stated: Array
    gaps: Array  # 1 / (w_i^2 - w_j^2) of modes that are apart, else zero
    seen: int

    @property
    def whole(self) -> Array:
        far = np.where(self.gaps != 0.0, self.stated, 0.0)
        turn = self.gaps * self.stated
        second = (far @ turn - turn @ far) / 2
        second[self.seen :, self.seen :] = 0.0  # modes beyond the band only lend those in it their shapes
        return np.asarray(self.stated + second)

    def by_pairs(self, i: Integers, j: Integers) -> Array:
        """Vectors v (m, 2 k) of the derivatives e_i v^T + v e_i^T + e_j v'^T + v' e_j^T by what is
        stated of k pairs of modes: those beside e_i first, then those beside e_j."""
        one = np.eye(len(self.stated))
        apart = self.gaps[i, j] != 0.0
        found = []
        for a, b in ((i, j), (j, i)):
            beside = np.where(apart, (np.where(self.gaps[b] != 0.0, self.stated[b], 0.0) * (self.gaps[b] + self.gaps[b, a][:, None])).T, 0.0)
            beside[self.seen :, a >= self.seen] = 0.0
            found.append((one[b].T + beside) * np.where(i == j, 0.25, 0.5))
        return np.concatenate(found, axis=1)


def reference_modes(linear: Matrices, seen: float, highest: float, most: int) -> ReferenceModes:
    """Modes of the undamped, standing reference below `highest`, `most` of them, and how many of these
    lie below `seen` (rad/s). Where there are more, those that coincide are kept or left together: one
    of the two planes of a shaft alone would make the other a change of what is measured."""
    squares, vectors = eigh(linear.stiffness, linear.mass)
    omega = np.sqrt(np.maximum(squares, 0.0))
    keep = np.flatnonzero((omega > RIGID * omega.max()) & (omega < highest))
    while len(keep) > most:
        keep = keep[: int(np.argmax(omega[keep] > (1 - COINCIDE) * omega[keep[-1]]))]
    modal = vectors[:, keep]
    damping = np.einsum("ni,nm,mi->i", modal, (linear.damping + linear.damping.T) / 2, modal) / (2 * omega[keep])
    return ReferenceModes(omega[keep], np.maximum(damping, 1e-4), linear.mass @ modal, linear.dofs, int(np.sum(omega[keep] < seen)))
