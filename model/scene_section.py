"""The form of a scene file: materials and the regions of the section."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from model import machine as m
from model.file_table import MM, LawValue, Name, Positive, Radii, Span, Table


class Material(Table):
    youngs_modulus_GPa: LawValue
    poisson_ratio: Annotated[float, Field(gt=-1, lt=0.5)]
    thermal_expansion_um_per_m_K: LawValue
    density_kg_per_m3: Positive
    conductivity_W_per_m_K: Positive
    heat_capacity_J_per_kg_K: Positive

    def material(self, name: str) -> m.Material:
        return m.Material(
            name,
            self.youngs_modulus_GPa.law(1e9),
            self.poisson_ratio,
            self.thermal_expansion_um_per_m_K.law(1e-6),
            self.density_kg_per_m3,
            self.conductivity_W_per_m_K,
            self.heat_capacity_J_per_kg_K,
        )


class Region(Table):
    name: Name
    part: Literal["stationary", "rotating"]
    material: str
    r_mm: Radii
    z_mm: Span

    def region(self) -> m.Region:
        r, z = ((span[0] * MM, span[1] * MM) for span in (self.r_mm, self.z_mm))
        return m.Region(self.name, self.part, self.material, r, z)


class Section(Table):
    regions: list[Region] = Field(min_length=2)
