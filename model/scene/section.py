"""The form of a scene file: materials and the regions of the section."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from thermospindle.model import machine as m
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

    def material(self, name: str) -> m.Material:
        return m.Material(
            name=name,
            youngs_modulus=self.youngs_modulus_GPa.law(1e9),
            poisson_ratio=self.poisson_ratio,
            thermal_expansion=self.thermal_expansion_um_per_m_K.law(1e-6),
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
