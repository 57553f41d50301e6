"""Thermospindle's model: what a spindle is, and how its bearings and structure answer.

Imports none of the other packages. Modules, in the order of the calculation:

=============  ===================================================================================================
machine        frozen definitions: spindle, materials, bearings, structure, points, condition
file_table     what tables of files that people write have in common: numbers, laws, the first thing wrong in words
scene_file     the form of `spindle.toml`: keys, units, ranges; its tables are scene_section, scene_bearings,
               scene_structure, scene_thermal, scene_measuring and scene_imperfections
scene          reads and checks a scene by that form
section        the axisymmetric section: who owns which rectangle, mass and inertia
hertz          point contact with exact elliptic integrals
heavy_ball     one ball with centrifugal force and gyroscopic moment between its races
ball_row       one ball row under any load: forces, contact loss, exact 5x5 tangent stiffness
pair           axial equilibrium of the two rows against the thermal motion of their rings
table          bearing stiffness over temperature and speed, as CSV
rotor_base     the rotor-base chain as bodies and compliant elements; M, C, G, K
ball_springs   balls as springs between points: what the ball-by-ball bearing element is made of
look           cut-away meshes of the section, colours, and the visual part of the MuJoCo model
mjcf           the same chain as a MuJoCo model: linear or ball-by-ball bearings, hammers, vibrometers
tolerance      the toleranced build parameters of a spindle
modes          modes and exact FRFs of M, C, K
imperfections  unbalance, waviness, ball sizes, cage unbalance: given, measured or drawn from a seed
kinematics     cage and ball speeds, and the lines at which a running spindle is excited
=============  ===================================================================================================

Axes: z is the spindle axis, up; r is radial; the tilts are right-handed rotations about x and y.
Order of a body's five degrees of freedom, everywhere: x, y, z, tilt_x, tilt_y (`machine.MOVES`).
Units are SI; temperatures are degrees Celsius; angles are radians; speeds are rad/s, positive about +z.
Amplitudes are zero-to-peak; complex time dependence is exp(+i omega t).
"""
