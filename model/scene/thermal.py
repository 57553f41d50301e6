"""The form of a scene file: convection, heat sources, air gaps and bearing friction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field, model_validator

from thermospindle.model.drawing import heating as m
from thermospindle.model.drawing.section import Region
from thermospindle.model.material import LEAST_VISCOSITY, Viscosity
from thermospindle.model.scene.fields import LawTable, LawValue, Name, NotNegative, Positive, Table, Temperature, TwoNames
from thermospindle.model.units import RPM


class Convection(Table):
    regions: list[str] = Field(min_length=1)
    coefficient_W_per_m2_K: Positive
    coolant_temperature_C: Temperature | None = None


class Source(Table):
    name: Name
    regions: list[str] = Field(min_length=1)
    power_W: NotNegative
    speed_rpm: Annotated[float, Field(ge=1e-3, le=1e8)]
    exponent: Annotated[float, Field(ge=0, le=10)]


class Gap(Table):
    regions: TwoNames
    coefficient_W_per_m2_K: NotNegative


BASE_OIL = LawTable(temperature_C=[-20.0, 0.0, 20.0, 40.0, 60.0, 80.0, 100.0, 120.0], value=[1110.0, 209.0, 63.1, 26.0, 13.2, 7.79, 5.1, 3.6])
"""mm2/s: 26 at 40 C and 5.1 at 100 C, between them by ASTM D341."""


class Friction(Table):
    """Assumed where a scene says nothing: a greased angular contact row (Palmgren; Harris, ch. 14) with a base oil of 26 mm2/s at 40 C."""

    f0: NotNegative = 2.0
    f1: NotNegative = 0.0003
    kinematic_viscosity_mm2_per_s: LawValue = BASE_OIL
    conductance_W_per_K: NotNegative = 0.05

    @model_validator(mode="after")
    def _an_oil(self) -> Friction:
        if (least := min(self.kinematic_viscosity_mm2_per_s.value)) < 1e6 * LEAST_VISCOSITY:
            raise ValueError(f"kinematic_viscosity_mm2_per_s: {least:g} mm2/s; the law between its temperatures (ASTM D341) allows {1e6 * LEAST_VISCOSITY:g} and more")
        return self

    def viscosity(self) -> Viscosity:
        law = self.kinematic_viscosity_mm2_per_s.law(1e-6, "thermal.friction.kinematic_viscosity_mm2_per_s")
        return Viscosity(law.temperature, law.value, law.key)


STILL_AIR, MOVED_AIR = 10.0, 40.0  # W/(m2 K): free convection from standing faces, and that of a face that turns


class Thermal(Table):
    """Cooling, heat and friction. A scene without `convection` has still air about its standing regions and moved air about the turning
    ones; without `friction` a light grease. `model.scene.defaults` says so in the provenance."""

    convection: list[Convection] = Field(default_factory=list)
    sources: list[Source] = Field(default_factory=list)
    gaps: list[Gap] = Field(default_factory=list)
    friction: Friction = Friction()

    def thermal(self, regions: Sequence[Region]) -> m.Thermal:
        """`regions` are those of the section, cooled as assumed where no convection is told."""
        f = self.friction
        told = tuple(m.Convection(regions=tuple(c.regions), coefficient=c.coefficient_W_per_m2_K, coolant=c.coolant_temperature_C) for c in self.convection)
        assumed = tuple(
            m.Convection(regions=tuple(g.name for g in regions if g.part == part), coefficient=film)
            for part, film in (("stationary", STILL_AIR), ("rotating", MOVED_AIR))
        )
        return m.Thermal(
            convections=told or assumed,
            sources=tuple(
                m.HeatSource(name=s.name, regions=tuple(s.regions), power=s.power_W, speed=s.speed_rpm * RPM, exponent=s.exponent)
                for s in self.sources
            ),
            gaps=tuple(m.AirGap(regions=g.regions, coefficient=g.coefficient_W_per_m2_K) for g in self.gaps),
            friction=m.Friction(
                f0=f.f0, f1=f.f1, viscosity=f.viscosity(), conductance=f.conductance_W_per_K
            ),
        )
