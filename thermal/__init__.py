"""Temperature and thermal expansion of the spindle by axisymmetric finite elements (scikit-fem). Imports `model` only.

Modules, in the order of the calculation:

===========  =====================================================================================================
mesh         meshes of a part's section, made here or read from Gmsh; every element belongs to a named region
elastic      thermo-elasticity of one part; the influence of thermal strain on its ring motions by adjoint solutions
refine       refinement where the ring motions need it; how well they have converged
reduced      the influence of a part whose moduli follow the temperature, on a space of a few solutions
store        influence on disk
influence    the influence of a spindle, computed once for a geometry and elasticity
friction     bearing friction torque and heat
temperature  temperature fields, region means, free thermal strain
conduction   the discrete heat equation of both parts, coupled through bearings and air gaps
heat         steady and transient temperature, heat flows
readout      region means and ring motions of many temperature fields on one mesh, quickly
expansion    the front: `influence`, `expand` (ring motions), `field` (the deformed section)
===========  =====================================================================================================

A soak at 60 C:            `expand(spindle, 60.0)`
Running at 7200 rpm:       `heat_model = conduction.model(spindle, influence(spindle).sections)`,
                           `expand(spindle, heat.steady(heat_model, heat.running(spindle, 25.0, 754.0)))`

Axes: r outward, z up along the spindle; a displacement is (u_r, u_z). SI units, temperatures in degrees Celsius.
Stationary and rotating part are elastically separate, each free, with zero mean axial displacement over its volume: only
differences of u_z within a part mean anything, and the hub's rigid movement is decided by the bearings. Thermal strain is the
integral of the instantaneous expansion coefficient from the reference temperature. Nodes are those of second-order elements:
vertices first, then edge middles. Elastic integrals are per radian, heat flows per whole turn.
"""
