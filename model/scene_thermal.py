"""The form of a scene file: convection, heat sources, air gaps and bearing friction."""

from __future__ import annotations

from pydantic import Field

from model import machine as m
from model.file_table import RPM, LawValue, Name, NotNegative, Positive, Table


class Convection(Table):
    regions: list[str] = Field(min_length=1)
    coefficient_W_per_m2_K: Positive


class Source(Table):
    name: Name
    regions: list[str] = Field(min_length=1)
    power_W: NotNegative
    speed_rpm: Positive
    exponent: NotNegative


class Gap(Table):
    regions: tuple[str, str]
    coefficient_W_per_m2_K: NotNegative


class Friction(Table):
    f0: NotNegative
    f1: NotNegative
    kinematic_viscosity_mm2_per_s: LawValue
    conductance_W_per_K: NotNegative


class Thermal(Table):
    convection: list[Convection] = Field(min_length=1)
    sources: list[Source] = Field(default_factory=list)
    gaps: list[Gap] = Field(default_factory=list)
    friction: Friction

    def thermal(self) -> m.Thermal:
        f = self.friction
        return m.Thermal(
            tuple(m.Convection(tuple(c.regions), c.coefficient_W_per_m2_K) for c in self.convection),
            tuple(m.HeatSource(s.name, tuple(s.regions), s.power_W, s.speed_rpm * RPM, s.exponent) for s in self.sources),
            tuple(m.AirGap(g.regions, g.coefficient_W_per_m2_K) for g in self.gaps),
            m.Friction(f.f0, f.f1, f.kinematic_viscosity_mm2_per_s.law(1e-6), f.conductance_W_per_K),
        )
