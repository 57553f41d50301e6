"""The influence of a part whose elastic moduli follow the temperature, by a reduced basis: solved at a few states, right at all.

Stiffness and thermal loads are sums over the regions, each in proportion to its own Young's modulus E_k. Displacements and adjoint
displacements of a few sets of moduli (the ends of every material's law, and states between) span a small space; at any other set the
problem projected on it is a dense one of some tens of unknowns. The error of a ring motion is the product of the two energy errors left,
of displacement and of adjoint, so it falls with the square of what the space misses (Hesthaven, Rozza, Stamm, *Certified Reduced Basis
Methods for Parametrized Partial Differential Equations*, 2016, ch. 3 and 4).

The space is checked at states it was not made from, in which every region has a temperature of its own anywhere in its law, and widened by
their whole solutions until the next one is met to `ACCURACY`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from skfem import Basis

from thermospindle.model.material import Law
from thermospindle.thermal.elastic import Elasticity, Race, Response, Solid, dilatation, stiffened
from thermospindle.thermal.mesh import PartMesh
from thermospindle.thermal.refine import largest_motion

ACCURACY = 1e-5
"""Of the ring motions, relative to the largest: a tenth of what the mesh is trusted for."""
SMALL = 1e-14  # share of the largest energy below which a direction of the snapshots is rounding
MOST = 40  # states solved whole, before the space is given as it is


@dataclass(frozen=True)
class Region:
    """What the elasticity of one region follows: its material's Young's modulus over temperature and Poisson's ratio."""

    name: str
    youngs_modulus: Law
    poisson_ratio: float


@dataclass(frozen=True, eq=False)
class Reduced:
    """A part on its space of n displacements.

    `fields` (n, nodes, 2) span it; `stiffness` (regions, n, n) and `load` (regions, n) are those of one region after the
    other for a modulus of 1 Pa and a unit strain, `motion` (2 races, n) the ring motions of `fields`. `error` is that at the
    last state, before it joined the space, relative to the largest motion there; `solved` counts the whole solutions it took.
    """

    section: PartMesh
    races: tuple[Race, ...]
    regions: tuple[Region, ...]
    fields: np.ndarray
    stiffness: np.ndarray
    load: np.ndarray
    motion: np.ndarray
    error: float
    solved: int

    def solution(self, moduli: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gain (2 races, regions), displacements (regions, n) and adjoint ones (2 races, n) in the space, for moduli (regions,) in Pa."""
        matrix = np.tensordot(moduli, self.stiffness, axes=1)
        unit = np.linalg.solve(matrix, (moduli[:, None] * self.load).T).T
        return self.motion @ unit.T, unit, np.linalg.solve(matrix, self.motion.T).T

    def response(self, moduli: Mapping[str, float]) -> Response:
        """The influence at moduli (Pa) by region, as `Solid.respond` has it to `error`."""
        own = np.array([moduli[r.name] for r in self.regions])
        gain, unit, adjoint = self.solution(own)
        bulk = own / (1 - 2 * np.array([r.poisson_ratio for r in self.regions]))  # 3 lambda + 2 mu
        weight = bulk[self.section.region_of][:, None] * self.volume
        density = weight * np.tensordot(adjoint, self.dilatations, axes=1)
        work = np.einsum("ia,mab,kb->ikm", adjoint, own[:, None, None] * self.stiffness, unit, optimize=True)
        return Response(self.section, self.races, gain, density, np.tensordot(unit, self.fields, axes=1), stiffened(gain, work))

    @cached_property
    def volume(self) -> np.ndarray:
        """r dr dz (elements, points) of the quadrature points."""
        basis = self._basis
        return np.asarray(basis.global_coordinates()[0] * basis.dx)

    @cached_property
    def dilatations(self) -> np.ndarray:
        """Of every field, (n, elements, points)."""
        basis = self._basis
        r = basis.global_coordinates()[0]
        return np.array([np.asarray(dilatation(basis.interpolate(u.ravel()), r)) for u in self.fields])

    @cached_property
    def _basis(self) -> Basis:
        return Solid(self.section, {r.name: Elasticity(1.0, r.poisson_ratio) for r in self.regions}).basis


def reduced(section: PartMesh, races: Sequence[Race], regions: Sequence[Region], reference: float) -> Reduced:
    """The space of a part on a mesh, from `reference` (C) and the ends of every material's law, widened until it holds `ACCURACY`."""
    regions = tuple(next(r for r in regions if r.name == name) for name in section.regions)
    centre = _moduli(regions, dict.fromkeys((r.youngs_modulus for r in regions), reference))
    at_centre = Solid(section, _elastic(regions, centre))
    snapshots: list[np.ndarray] = []
    solved = 0

    def whole(moduli: np.ndarray) -> np.ndarray:
        """Solve at a state, keep its fields, and return its gain."""
        nonlocal solved
        solved += 1
        response, adjoint = at_centre.with_moduli(_elastic(regions, moduli)).respond(races)
        scale = moduli.mean()  # adjoint displacements are per newton
        snapshots.extend([*response.shape, *(scale * adjoint)])
        return response.gain

    whole(centre)
    for state in _ends(regions, reference):
        whole(state)
    found = _project(at_centre, races, regions, snapshots, solved)
    for state in _between(regions):
        guess = found.solution(state)[0]
        gain = whole(state)
        error = largest_motion(guess - gain) / largest_motion(gain)
        found = _project(at_centre, races, regions, snapshots, solved)
        if error <= ACCURACY or solved >= MOST:
            break
    return replace(found, error=error, solved=solved)


def _ends(regions: Sequence[Region], reference: float) -> list[np.ndarray]:
    """Moduli (regions,) with one material after the other at the end of its law that is farther from the reference."""
    laws = dict.fromkeys(r.youngs_modulus for r in regions)
    rest = dict.fromkeys(laws, reference)
    return [
        _moduli(regions, rest | {law: max(law.temperature[0], law.temperature[-1], key=lambda t: abs(t - reference))})
        for law in laws
        if len(law.value) > 1
    ]


def _between(regions: Sequence[Region]) -> Iterator[np.ndarray]:
    """Moduli (regions,) to check at, without end: every region at a temperature of its own, drawn from its material's law."""
    spans = [(r.youngs_modulus.temperature[0], r.youngs_modulus.temperature[-1]) for r in regions]
    random = np.random.default_rng(0)
    while True:
        warmth = [low + float(x) * (high - low) for x, (low, high) in zip(random.uniform(size=len(regions)), spans, strict=True)]
        yield np.array([r.youngs_modulus(t) for r, t in zip(regions, warmth, strict=True)])


def _moduli(regions: Sequence[Region], temperature: Mapping[Law, float]) -> np.ndarray:
    """Moduli (regions,) in Pa with every law asked at its temperature (C), or at its nearest end."""
    return np.array([r.youngs_modulus(_within(r.youngs_modulus, temperature[r.youngs_modulus])) for r in regions])


def _within(law: Law, temperature: float) -> float:
    return temperature if len(law.value) == 1 else float(np.clip(temperature, law.temperature[0], law.temperature[-1]))


def _elastic(regions: Sequence[Region], moduli: np.ndarray) -> dict[str, Elasticity]:
    return {r.name: Elasticity(float(e), r.poisson_ratio) for r, e in zip(regions, moduli, strict=True)}


def _project(solid: Solid, races: Sequence[Race], regions: tuple[Region, ...], snapshots: list[np.ndarray], solved: int) -> Reduced:
    """The span of snapshots (nodes, 2) each, orthonormal in the elastic energy of `solid`, and the problem on it."""
    section, flat = solid.section, np.array(snapshots).reshape(len(snapshots), -1)
    modulus = np.array([solid.elasticity[r.name].youngs_modulus for r in regions])
    inner = np.array([flat @ (solid.stiffness(section.region_of == k) @ flat.T) for k in range(len(regions))])
    whole = inner.sum(axis=0)
    size = np.sqrt(np.diag(whole))
    value, vector = np.linalg.eigh(whole / np.outer(size, size))
    kept = value > SMALL * value[-1]
    turn = (vector[:, kept] / np.sqrt(value[kept])).T / size
    fields = turn @ flat
    return Reduced(
        section,
        tuple(races),
        regions,
        fields.reshape(len(fields), -1, 2),
        np.array([turn @ k @ turn.T for k in inner]) / modulus[:, None, None],
        (solid.region_loads() @ fields.T) / modulus[:, None],
        solid.functionals(races) @ fields.T,
        error=float("inf"),
        solved=solved,
    )
