"""Temperature of the spindle as the finite elements see it, and the free thermal strain that follows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from skfem import Basis, LinearForm

from thermospindle.model.machine import Material, Spindle
from thermospindle.model.material import Law
from thermospindle.thermal.mesh import PartMesh, element


@dataclass(frozen=True, eq=False)
class TemperatureField:
    """Nodal temperatures (C) of both parts: `nodal[part]` (nodes,) on the second-order nodes of `sections[part]`."""

    sections: Mapping[str, PartMesh]
    nodal: Mapping[str, np.ndarray]

    def region_means(self) -> dict[str, float]:
        """Mean temperature (C) over the volume of every region."""
        means = {}
        for part, section in self.sections.items():
            for name in section.regions:
                basis = Basis(section.mesh, element(section.mesh), elements=section.elements(name))
                weight = LinearForm(lambda v, w: v * w.x[0]).assemble(basis)
                means[name] = float(weight @ self.nodal[part] / weight.sum())
        return means

    def at_points(self, part: str, basis: Basis) -> np.ndarray:
        """Temperatures (elements, points) at the quadrature points of a basis on any mesh of the same part."""
        section = self.sections[part]
        if basis.mesh is section.mesh:
            return np.asarray(basis.interpolate(self.nodal[part]))
        points = np.asarray(basis.global_coordinates())
        own = Basis(section.mesh, element(section.mesh))
        return (own.probes(points.reshape(2, -1)) @ self.nodal[part]).reshape(points.shape[1:])


def region_temperatures(spindle: Spindle, temperature: float | Mapping[str, float] | TemperatureField) -> dict[str, float]:
    """Mean temperature (C) of every region; ValueError for a mapping that lacks a region or names an unknown one."""
    names = [g.name for g in spindle.regions]
    if isinstance(temperature, TemperatureField):
        means = temperature.region_means()
        return {name: means.get(name, spindle.reference_temperature) for name in names}  # a region cut away whole has no mean
    if not isinstance(temperature, Mapping):
        return dict.fromkeys(names, float(temperature))
    if wrong := sorted(set(names) ^ set(temperature)):
        raise ValueError(f"temperatures must be given for exactly the spindle's regions; missing or unknown: {', '.join(wrong)}")
    return {name: float(temperature[name]) for name in names}


def thermal_strain(material: Material, temperature: np.ndarray, reference: float) -> np.ndarray:
    """`Material.thermal_strain` of an array of temperatures (C): the integral of the piecewise linear expansion law."""
    return _integral(material.thermal_expansion, temperature) - _integral(material.thermal_expansion, np.array(reference))


def _integral(law: Law, temperature: np.ndarray) -> np.ndarray:
    """Integral of the law from its first temperature; of a constant law from zero."""
    if len(law.value) == 1:
        return law.value[0] * temperature
    t, v = np.array(law.temperature), np.array(law.value)
    law.check(temperature)
    below = np.concatenate([[0.0], np.cumsum(np.diff(t) * (v[1:] + v[:-1]) / 2)])
    k = np.clip(np.searchsorted(t, temperature, side="right") - 1, 0, t.size - 2)
    step = temperature - t[k]
    return below[k] + step * (v[k] + np.diff(v)[k] / np.diff(t)[k] * step / 2)
