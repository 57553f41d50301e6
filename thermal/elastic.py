"""Axisymmetric thermo-elasticity with second-order elements, and the influence of every region's thermal strain.

Strains e_rr = u_r,r, e_zz = u_z,z, e_tt = u_r / r, g_rz = u_r,z + u_z,r; isotropic stress minus the free thermal strain
(Timoshenko, Goodier, Theory of Elasticity, ch. 13). All integrals are per radian: the common 2 pi is left out.
Nothing but temperature loads a part: it is free, u_r = 0 on the axis, and its mean axial displacement over its volume is zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.linalg import SuperLU, splu
from skfem import Basis, ElementVector, FacetBasis, LinearForm

from thermospindle.thermal.mesh import PartMesh, element

QUADRATURE_ORDER = 4


@dataclass(frozen=True)
class Elasticity:
    """Young's modulus (Pa) and Poisson's ratio of one region."""

    youngs_modulus: float
    poisson_ratio: float

    @property
    def lame(self) -> tuple[float, float]:
        """Lame's constants lambda and mu (Pa)."""
        e, nu = self.youngs_modulus, self.poisson_ratio
        return e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))


@dataclass(frozen=True)
class Race:
    """The raceway face of a ring: the side of `ring` at radius `r` (m), between the heights `z` (m) or, without them, all of it."""

    ring: str
    r: float
    z: tuple[float, float] | None = None


def strain(u, r):
    """e_rr, e_zz, e_tt, g_rz of a displacement (u_r, u_z)."""
    return u.grad[0, 0], u.grad[1, 1], u[0] / r, u.grad[0, 1] + u.grad[1, 0]


def dilatation(u, r):
    """Trace of the strain, e_rr + e_zz + e_tt."""
    return u.grad[0, 0] + u.grad[1, 1] + u[0] / r


@LinearForm
def thermal_load(v, w):
    """Virtual work of the stress that would suppress the thermal strain: (3 lambda + 2 mu) strain tr e(v)."""
    return (3 * w.lam + 2 * w.mu) * w.strain * dilatation(v, w.x[0]) * w.x[0]


@dataclass(frozen=True)
class Response:
    """How one part answers thermal strain. Rows of `gain` and `density`: race 0 r, race 0 z, race 1 r, ...

    `gain[i, k]` is the motion (m) for a unit strain of region k, `density[i, e, q]` that for a unit strain at quadrature point
    q of element e, weight included, `shape[k]` the displacement (nodes, 2) of every node for a unit strain of region k.
    `stiffening[i, k, m]` is what `gain[i, k]` changes by per relative change of Young's modulus of region m.
    """

    section: PartMesh
    races: tuple[Race, ...]
    gain: np.ndarray  # (2 races, regions)
    density: np.ndarray  # (2 races, elements, points)
    shape: np.ndarray  # (regions, nodes, 2)
    stiffening: np.ndarray  # (2 races, regions, regions)


class Solid:
    """The factorised elasticity of one part on one mesh."""

    def __init__(self, section: PartMesh, elasticity: Mapping[str, Elasticity]):
        self.section = section
        self.elasticity = elasticity
        self.scalar = Basis(section.mesh, element(section.mesh), intorder=QUADRATURE_ORDER)
        lame = np.array([elasticity[name].lame for name in section.regions])[section.region_of]
        points = (1, self.scalar.X.shape[-1])
        self.lam, self.mu = (np.tile(constant[:, None], points) for constant in lame.T)

    @cached_property
    def basis(self) -> Basis:
        return Basis(self.section.mesh, ElementVector(element(self.section.mesh)), intorder=QUADRATURE_ORDER)

    @cached_property
    def nodes(self) -> np.ndarray:
        """Coordinates (nodes, 2) of every node, vertices first; degree of freedom 2 k + c is direction c of node k."""
        return self.scalar.doflocs.T

    @cached_property
    def element_stiffness(self) -> np.ndarray:
        """Stiffness matrices (n, n, elements) of the n functions of every element: virtual work of
        the stress of one on the strain of the other."""
        r = self.basis.global_coordinates()[0]
        normal = np.array([strain(of[0], r)[:3] for of in self.basis.basis])  # (n, 3, elements, points)
        shear = np.array([strain(of[0], r)[3] for of in self.basis.basis])
        trace, volume = normal.sum(axis=1), r * self.basis.dx
        found = np.einsum("iep,jep->ije", trace * (self.lam * volume), trace)
        found += np.einsum("icep,jcep->ije", normal * (2 * self.mu * volume), normal)
        return found + np.einsum("iep,jep->ije", shear * (self.mu * volume), shear)

    def stiffness(self, elements: np.ndarray | slice = slice(None)) -> csr_matrix:
        """Stiffness matrix (dofs, dofs) of the part, or of some of its `elements` alone."""
        own, dofs = self.element_stiffness[..., elements], self.basis.element_dofs[:, elements]
        rows, columns = np.broadcast_arrays(dofs[:, None], dofs[None, :])
        return coo_matrix((own.ravel(), (rows.ravel(), columns.ravel())), shape=(self.basis.N, self.basis.N)).tocsr()

    def with_moduli(self, elasticity: Mapping[str, Elasticity]) -> Solid:
        """The same part with other Young's moduli but the same Poisson's ratios, in whose proportion its elements are stiffer."""
        other = Solid(self.section, elasticity)
        ratio = np.array([elasticity[name].youngs_modulus / self.elasticity[name].youngs_modulus for name in self.section.regions])
        other.basis, other.element_stiffness = self.basis, self.element_stiffness * ratio[self.section.region_of]
        return other

    @cached_property
    def _free(self) -> np.ndarray:
        """Degrees of freedom that are not held."""
        held = np.zeros(self.basis.N, dtype=bool)
        held[0::2] = self.nodes[:, 0] == 0.0
        held[1] = True  # loads are in axial balance, so this node takes no force
        return np.flatnonzero(~held)

    @cached_property
    def _factors(self) -> SuperLU:
        matrix = self.stiffness().tocsc()[self._free][:, self._free]
        return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})

    def _solve(self, loads: np.ndarray) -> np.ndarray:
        """Displacements (dofs, k) under `loads` (dofs, k)."""
        answer = np.zeros_like(loads)
        answer[self._free] = self._factors.solve(np.ascontiguousarray(loads[self._free]))
        answer[1::2] -= self.axial_mean @ answer[1::2]
        return answer

    @cached_property
    def axial_mean(self) -> np.ndarray:
        """Weights (nodes,) of the mean of a scalar over the part's volume."""
        volume = LinearForm(lambda v, w: v * w.x[0]).assemble(self.scalar)
        return volume / volume.sum()

    def displacement(self, strains: np.ndarray) -> np.ndarray:
        """Displacement (loads, nodes, 2) in m of free thermal strains (loads, elements, points) at the quadrature points."""
        loads = [thermal_load.assemble(self.basis, lam=self.lam, mu=self.mu, strain=one) for one in strains]
        return self._solve(np.array(loads).T).T.reshape(len(strains), -1, 2)

    def region_loads(self) -> np.ndarray:
        """Loads (regions, dofs) of a unit strain of one region after the other: each stands in the region's own elements."""
        element_loads = thermal_load.coo_data(self.basis, lam=self.lam, mu=self.mu, strain=np.ones_like(self.lam)).data.reshape(self.basis.Nbfun, -1)
        own = [self.section.region_of == k for k in range(len(self.section.regions))]
        return np.array([np.bincount(self.basis.element_dofs[:, e].ravel(), element_loads[:, e].ravel(), self.basis.N) for e in own])

    def region_displacement(self) -> np.ndarray:
        """Displacement (regions, nodes, 2) in m of a unit strain of one region after the other."""
        loads = self.region_loads()
        return self._solve(loads.T).T.reshape(len(loads), -1, 2)

    def region_strains(self) -> np.ndarray:
        """Unit strain of one region after the other, (regions, elements, points)."""
        owner = np.arange(len(self.section.regions))[:, None] == self.section.region_of
        return np.repeat(owner[:, :, None].astype(float), self.basis.X.shape[-1], axis=2)

    def race_mean(self, race: Race) -> np.ndarray:
        """Weights (nodes,) of the mean of a scalar over a raceway face, every length of it counting alike."""
        facets = self.section.race(race.ring, race.r, race.z)
        face = FacetBasis(self.section.mesh, element(self.section.mesh), facets=facets, intorder=4)
        length = LinearForm(lambda v, w: v).assemble(face)
        return length / length.sum()

    def functionals(self, races: Sequence[Race]) -> np.ndarray:
        """Rows (2 races, dofs) that read the mean motion of raceways, r and z, off a displacement."""
        rows = np.zeros((2 * len(races), self.basis.N))
        for i, race in enumerate(races):
            rows[2 * i, 0::2] = rows[2 * i + 1, 1::2] = self.race_mean(race)
        rows[1::2, 1::2] -= self.axial_mean  # the motion is counted from the part's axial mean
        return rows

    def respond(self, races: Sequence[Race]) -> tuple[Response, np.ndarray]:
        """Influence of thermal strain on the motion of `races`, and the adjoint displacements (2 races, nodes, 2) behind it.

        The motion is a linear functional j of the displacement K^-1 f(strain), so it is f(strain) . K^-1 j: one adjoint
        solution a functional answers any thermal strain (Becker, Rannacher, Acta Numerica 10 (2001), sec. 2).
        """
        adjoint = self._solve(self.functionals(races).T).T
        r = self.basis.global_coordinates()[0]
        weight = (3 * self.lam + 2 * self.mu) * r * self.basis.dx
        density = np.array([weight * dilatation(self.basis.interpolate(a), r) for a in adjoint])
        units = self.region_strains()
        gain, shape = np.einsum("ieq,keq->ik", density, units), self.region_displacement()
        stiffening = stiffened(gain, self._virtual_work(adjoint, shape.reshape(len(shape), -1)))
        response = Response(self.section, tuple(races), gain, density, shape, stiffening)
        return response, adjoint.reshape(len(adjoint), -1, 2)

    def _virtual_work(self, adjoint: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        """Work (a, u, regions) of the stresses of displacements (u, dofs) on the strains of adjoint ones (a, dofs), region by region."""
        dofs = self.basis.element_dofs
        each = np.einsum("iae,abe,kbe->ike", adjoint[:, dofs], self.element_stiffness, displacement[:, dofs], optimize=True)
        return np.stack([each[..., self.section.region_of == m].sum(axis=-1) for m in range(len(self.section.regions))], axis=-1)


def stiffened(gain: np.ndarray, work: np.ndarray) -> np.ndarray:
    """`Response.stiffening` from the gain (i, k) and the virtual work (i, k, m) of region m.

    j . K^-1 f changes by a . (f' - K' u), a = K^-1 j and u = K^-1 f (Haug, Choi, Komkov, Design Sensitivity Analysis of Structural
    Systems, 1986, sec. 1.2). Both K and the load of a region are in proportion to Young's moduli, and a . f is the gain.
    """
    return gain[..., None] * np.eye(gain.shape[1]) - work
