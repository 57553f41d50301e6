"""The rotor-base structure: masses of the section, the chain of bodies and elements, its modes, and the same as a MuJoCo model.

===========  ================================================================================================================
chain        the rotor-base chain: rigid bodies joined by compliant elements, and its matrices M, C, G, K
distributed  the mass of flexible shafts where it is: what lumps at their nodes leave out
elements     the bearing elements of the time simulation
loaded       bearings under an external radial load: the whole spindle in equilibrium
frf          exact FRFs of a linearised spindle: the sum of its modal terms, or line by line
look/        what a spindle looks like: cut-away bodies of its section, and the visual part of its MuJoCo model
mjcf         the rotor-base chain as a MuJoCo model
loss         constant loss factors as viscous damping, by the strain energy of each mode
modes        modes of a linearised spindle: their frequencies and damping, what moves, and where their energy is
poles        poles of a linearised spindle, of flexible shafts by a reduced model
section      the axisymmetric section: which region owns which rectangle, and the mass and inertia that follow
beam         beam elements of flexible shafts: nodes that are bodies, joined by elements that are joints
reduced      a reduced basis for the response of a flexible shaft within a band, with an error that is known
static       static answers: stiffness at points, bearing reactions, and which part gives how much
===========  ================================================================================================================
"""
