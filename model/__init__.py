"""Thermospindle's model: what a spindle is, and how its bearings and structure answer.

Imports none of the other packages:

=============  ====================================================================================================
machine        frozen definitions: spindle, section, structure, points, condition; bearings and materials from their modules
material       frozen definitions: laws over temperature, materials
span           the temperatures at which a spindle can be computed
tolerance      the toleranced build parameters of a spindle
imperfections  unbalance, waviness, ball sizes, cage unbalance
drawn          plausible imperfections from a seed
scene/         `spindle.toml`: its form, reading and checking
files/         what all files share: formats and their migrations, cells of CSV files
bearing/       contact, ball, row, sets; stiffness over temperature and speed; bearing frequencies
rotor/         the section's masses, the rotor-base chain, modes and FRFs, and the same as a MuJoCo model
sense          limits of sense of conditions and states: they warn
units          the units people write and read
errors         what goes wrong in one sentence
whole          files and folders that are written whole or not at all
types          array types
parallel       one function over many items, on all cores
shaft          flexible shafts as they are drawn, and the nodes a beam model gives them
=============  ====================================================================================================

Axes: z is the spindle axis, up; r is radial; the tilts are right-handed rotations about x and y.
Order of a body's five degrees of freedom, everywhere: x, y, z, tilt_x, tilt_y (`machine.MOVES`).
Units are SI; temperatures are degrees Celsius; angles are radians; speeds are rad/s, positive about +z.
Amplitudes are zero-to-peak; complex time dependence is exp(+i omega t).
"""
