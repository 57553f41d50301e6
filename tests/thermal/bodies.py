"""Simple bodies of one material or two, whose conduction is known."""

from dataclasses import replace

from skfem import Basis

from thermospindle.model.drawing.heating import Convection, Friction, HeatSource, Thermal
from thermospindle.model.drawing.section import PARTS, Region
from thermospindle.model.machine import Material, Spindle
from thermospindle.model.material import Law
from thermospindle.thermal import conduction
from thermospindle.thermal.mesh import element, section_mesh


def bare(spindle: Spindle, *regions: Region, **materials: Material) -> Spindle:
    """`regions` of `materials` (by keyword) alone: no bearings, no heat but what a test adds."""
    return replace(
        spindle,
        regions=regions,
        materials=materials,
        bearings=(),
        thermal=Thermal((), (), (), Friction(0.0, 0.0, Law((20.0,), (1e-5,)), 0.0)),
    )


def material(young=200e9, poisson=0.3, expansion=1e-5, density=8000.0, conductivity=40.0, capacity=500.0) -> Material:
    return Material("test", Law((20.0,), (young,)), poisson, Law((20.0,), (expansion,)), density, conductivity, capacity)


def nodes(model, part):
    mesh = model.sections[part].mesh
    return Basis(mesh, element(mesh)).doflocs


def two_rings(spindle, conductance=0.0, gaps=()):
    """An outer ring with a film and an inner ring with a heater, of nearly perfect conductors."""
    copper = material(conductivity=1e6)
    inner = Region("inner", "stationary", "copper", (2e-3, 4e-3), (0, 6e-3))
    outer = Region("outer", "rotating", "copper", (6e-3, 9e-3), (2e-3, 9e-3))
    own = bare(spindle, inner, outer, copper=copper)
    bearing = replace(spindle.bearings[0], inner_ring="inner", outer_ring="outer")
    thermal = replace(
        own.thermal,
        convections=(Convection(("outer",), 50.0),),
        sources=(HeatSource("heater", ("inner",), 2.0, 100.0, 1.0),),
        gaps=gaps,
        friction=Friction(0.0, 0.0, Law((20.0,), (1e-5,)), conductance),
    )
    own = replace(own, bearings=(bearing,), thermal=thermal)
    return conduction.model(own, {part: section_mesh(own, part, 0.7e-3) for part in PARTS})
