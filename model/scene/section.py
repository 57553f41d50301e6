"""The form of a scene file: materials and the regions of the section, and what regions make of a shaft."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field

from thermospindle.model import material as drawn
from thermospindle.model.drawing import section as m
from thermospindle.model.errors import instead
from thermospindle.model.scene.fields import LawValue, Name, Radii, Span, Table, values_within
from thermospindle.model.units import MM


class Material(Table):
    """Limits are those of solids: rubber to diamond, and no closer to incompressible than the finite elements carry."""

    youngs_modulus_GPa: Annotated[LawValue, values_within(1e-3, 2000)]
    poisson_ratio: Annotated[float, Field(ge=-0.9, le=0.49)]
    thermal_expansion_um_per_m_K: Annotated[LawValue, values_within(1e-6, 1000)]
    density_kg_per_m3: Annotated[float, Field(ge=1, le=1e5)]
    conductivity_W_per_m_K: Annotated[float, Field(ge=1e-3, le=1e4)]
    heat_capacity_J_per_kg_K: Annotated[float, Field(ge=1, le=1e5)]

    def material(self, name: str) -> drawn.Material:
        return drawn.Material(
            name=name,
            youngs_modulus=self.youngs_modulus_GPa.law(1e9, f"materials.{name}.youngs_modulus_GPa"),
            poisson_ratio=self.poisson_ratio,
            thermal_expansion=self.thermal_expansion_um_per_m_K.law(1e-6, f"materials.{name}.thermal_expansion_um_per_m_K"),
            density=self.density_kg_per_m3,
            conductivity=self.conductivity_W_per_m_K,
            heat_capacity=self.heat_capacity_J_per_kg_K,
        )


class Region(Table):
    name: Name
    part: Literal["stationary", "rotating"]
    material: str
    r_mm: Radii
    z_mm: Span
    role: Literal["shaft", "hub", "insert", "support"] | None = None

    def region(self) -> m.Region:
        r, z = ((span[0] * MM, span[1] * MM) for span in (self.r_mm, self.z_mm))
        return m.Region(name=self.name, part=self.part, material=self.material, r=r, z=z, role=self.role or "")


class Section(Table):
    regions: list[Region] = Field(default_factory=list, max_length=300)


@dataclass(frozen=True)
class Slab:
    """A shaft between two heights where nothing of its section changes, in mm: `mass_outer` is the
    diameter that would carry the mass of all."""

    z: tuple[float, float]
    outer: float
    bore: float
    mass_outer: float
    material: str

    @property
    def length(self) -> float:
        return self.z[1] - self.z[0]


def slabs(section: Section, densities: dict[str, float], names: Sequence[str], carried: Sequence[str], turns: bool) -> list[Slab]:
    """The shaft that the regions `names` are, lowest slab first, with the mass of the regions
    `carried` on it, which do not stiffen it; all of them turn, or stand.

    Densities (kg/m3) are by material. In every slab the regions that bend must be one tube of one material. What is
    carried counts with its mass; its rotary inertia is taken as that of a tube of the shaft's material directly around it.
    """
    known = {r.name: r for r in section.regions}
    for key, told in (("regions", names), ("mass_regions", carried)):
        for name in told:
            if name not in known:
                raise ValueError(f"{key}: {name!r} names no section region; {instead(name, list(known))}")
            if known[name].part != ("rotating" if turns else "stationary"):
                raise ValueError(f"{key}: {name!r} is of the {known[name].part} part, and the shaft {'turns' if turns else 'stands'}; allowed are regions that move with it")
            if (*names, *carried).count(name) > 1:
                raise ValueError(f"{key}: {name!r} stands twice; its mass counts once")
    bending, heavy = ([known[n] for n in told] for told in (names, carried))
    low, high = min(r.z_mm[0] for r in bending), max(r.z_mm[1] for r in bending)
    for region in heavy:
        if not low <= region.z_mm[0] < region.z_mm[1] <= high:
            raise ValueError(f"mass_regions: {region.name!r} reaches beyond the shaft, which spans {low:g} to {high:g} mm")
    found = []
    for a, b in pairwise(sorted({z for r in (*bending, *heavy) for z in r.z_mm})):
        here, on = ([r for r in told if r.z_mm[0] <= a and b <= r.z_mm[1]] for told in (bending, heavy))
        where = f"between z_mm = {a:g} and {b:g}"
        if not here:
            raise ValueError(f"regions: none {where}; the regions of a shaft follow each other without a gap")
        materials = sorted({r.material for r in here})
        if len(materials) > 1:
            raise ValueError(f"regions: {' and '.join(materials)} one around the other {where}; allowed is one material there, and mass_regions for what does not stiffen the shaft")
        tubes = sorted(r.r_mm for r in here)
        bore, outer = tubes[0]
        for inner, end in tubes[1:]:
            if inner > outer + 1e-9:
                raise ValueError(f"regions: nothing from r_mm = {outer:g} to {inner:g} {where}; the regions of a shaft touch")
            outer = max(outer, end)
        extra = sum(densities[r.material] / densities[materials[0]] * (r.r_mm[1] ** 2 - r.r_mm[0] ** 2) for r in on)
        found.append(Slab((a, b), 2 * outer, 2 * bore, 2 * (outer**2 + extra) ** 0.5, materials[0]))
    return found
