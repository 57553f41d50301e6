"""Thermospindle's model: what a spindle is, and how its bearings and structure answer.

Imports none of the other packages:

=============  ====================================================================================================
machine        frozen definitions: spindle and condition
drawing/       frozen definitions: section, measuring, heating
material       frozen definitions: laws over temperature, materials
structure      frozen definitions: bodies, and joints between them
shaft          flexible shafts as they are drawn, and the nodes a beam model gives them
changed        frozen definitions that are made anew at every operating point, quickly
carrier        which turning part an unbalance or a radial load acts on
sensors        bodies with the mass of what sits on measuring points
span           the temperatures at which a spindle can be computed
built/         how a built spindle differs from its drawing: toleranced parameters, imperfections
scene/         `spindle.toml`: its form, reading and checking
files/         what all files share: written whole, formats and their migrations, cells of CSV files
bearing/       contact, ball, row, sets; stiffness over temperature and speed; bearing frequencies
rotor/         the section's masses, the rotor-base chain, modes and FRFs, and the same as a MuJoCo model
sense          limits of sense of conditions and states: they warn
units          the units people write and read
errors         what goes wrong in one sentence
types          array types
parallel       one function over many items, on all cores
=============  ====================================================================================================

Axes: z is the spindle axis, up; r is radial; the tilts are right-handed rotations about x and y.
Order of a body's five degrees of freedom, everywhere: x, y, z, tilt_x, tilt_y (`structure.MOVES`).
Units are SI; temperatures are degrees Celsius; angles are radians; speeds are rad/s, positive about +z.
Amplitudes are zero-to-peak; complex time dependence is exp(+i omega t).
"""
