"""Meshes that refine themselves where the ring motions need it.

The error of a ring motion is a(e, e'), e and e' being the errors of displacement and of adjoint displacement, hence at most
the sum over the elements of the product of the two local error energies (Becker, Rannacher, Acta Numerica 10 (2001)). Each
is estimated by averaging the strains at the vertices, region by region since strains jump at region boundaries (Zienkiewicz,
Zhu, Int. J. Numer. Meth. Engng 24 (1987)). Elements that carry most of the sum are divided (Doerfler marking).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from skfem import Basis

from thermospindle.model.errors import NotConverged
from thermospindle.thermal.elastic import Elasticity, Race, Response, Solid
from thermospindle.thermal.mesh import PartMesh, element

SHARE = 0.5  # of the estimated error that the divided elements carry
MOST_UNKNOWNS = 300_000
"""Of a mesh that is solved, which takes 2 GB then; `five_bearing` needs 120 000."""
EXACT = 1e-9  # change of the ring motions that is rounding
RATE = 2.0  # goal error ~ unknowns ** -RATE: twice the energy rate of second-order elements in the plane


@dataclass(frozen=True)
class Convergence:
    """How the ring motions of one part settled, mesh after mesh.

    `change[k]` is the largest change that any ring motion saw from mesh k to k + 1, relative to the largest motion, for the
    worst unit strains of the regions; `error` is the estimated relative error that is left.
    """

    unknowns: tuple[int, ...]
    change: tuple[float, ...]
    error: float

    @property
    def refinements(self) -> int:
        return len(self.unknowns) - 1


def converged_response(
    section: PartMesh, elasticity: Mapping[str, Elasticity], races: Sequence[Race], tolerance: float
) -> tuple[Response, Convergence]:
    """Refine `section` until the estimated relative error of the ring motions is at most `tolerance`.

    NotConverged when that would take more than `MOST_UNKNOWNS`.
    """
    unknowns: list[int] = []
    change: list[float] = []
    gain, error = None, float("inf")
    while True:
        solid = Solid(section, elasticity)
        if solid.basis.N > MOST_UNKNOWNS:
            reached = f"right to {error:.1e}, not {tolerance:.1e}, with {unknowns[-1] if unknowns else 0} unknowns, and {solid.basis.N} are too many"
            raise NotConverged(f"{section.part} part: ring motions are {reached}")
        response, adjoint = solid.respond(races)
        unknowns.append(int(solid.basis.N))
        if gain is not None:
            change.append(largest_motion(response.gain - gain) / largest_motion(response.gain))
        error = remaining_error(unknowns, change)
        if error <= tolerance:
            return response, Convergence(tuple(unknowns), tuple(change), error)
        gain = response.gain
        section = section.refined(worst_elements(section, elasticity, response.shape, adjoint))


def largest_motion(gain: np.ndarray) -> float:
    """Largest motion that strains between -1 and 1 in every region can make (m per unit strain)."""
    return float(np.abs(gain).sum(axis=1).max())


def remaining_error(unknowns: Sequence[int], change: Sequence[float]) -> float:
    """Relative error left after the last mesh: the sum of the changes to come, shrinking as the last three did.

    Two changes of rounding alone leave nothing: a part of one material grows by its free strain, which any mesh holds exactly.
    They are not taken to shrink faster than theory has it; one small change may be luck, so the one before must agree.
    """
    if len(change) >= 2 and max(change[-2:]) < EXACT:
        return EXACT
    if len(change) < 3:
        return float("inf")
    expected = (unknowns[-2] / unknowns[-1]) ** RATE
    shrink = max(expected, change[-1] / change[-2], (change[-1] / change[-3]) ** 0.5)
    return float(max(change[-1], shrink * change[-2]) * shrink / (1 - shrink)) if shrink < 1 else float("inf")


def worst_elements(section: PartMesh, elasticity: Mapping[str, Elasticity], shape: np.ndarray, adjoint: np.ndarray) -> np.ndarray:
    """Elements to divide: the fewest that carry `SHARE` of the estimated error."""
    modulus = np.array([elasticity[name].youngs_modulus for name in section.regions])[section.region_of]
    error = modulus * np.sqrt(strain_error(section, shape) * strain_error(section, adjoint))
    order = np.argsort(-error)
    return order[: 1 + int(np.searchsorted(np.cumsum(error[order]), SHARE * error.sum()))]


def strain_error(section: PartMesh, displacements: np.ndarray) -> np.ndarray:
    """Squared error (elements,) of the strains of `displacements` (fields, nodes, 2), integrated over r dr dz and summed."""
    corners = section.mesh.t.shape[0]
    points = section.mesh.init_refdom().p
    basis = Basis(section.mesh, element(section.mesh), quadrature=(points, np.full(corners, 0.5 / corners)))
    slope = np.array([of[0].grad for of in basis.basis])  # (n, 2, elements, points) of the functions of every element
    weight = basis.dx * basis.global_coordinates()[0]
    key = (section.region_of * section.mesh.nvertices + section.mesh.t).T.ravel()  # one value a vertex and region
    _, place = np.unique(key, return_inverse=True)
    share = basis.dx.ravel() / np.bincount(place, basis.dx.ravel())[place]
    total = np.zeros(section.mesh.nelements)
    for u in displacements:
        grad = np.einsum("nec,ndep->cdep", u[basis.element_dofs], slope)
        for part in (grad[0, 0], grad[1, 1], (grad[0, 1] + grad[1, 0]) / np.sqrt(2)):
            smooth = np.bincount(place, share * part.ravel())[place].reshape(part.shape)
            total += np.sum(weight * (part - smooth) ** 2, axis=1)
    return total
