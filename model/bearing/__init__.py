"""Rolling bearings: point contact, one ball, one row, the pair in equilibrium, and what follows from them.

===============  =======================================================================================================
ball_row         one ball row: forces, contact loss and the exact 5x5 tangent stiffness under any load
centred          a ball row with centred rings, all of whose balls are alike
definitions      frozen definitions: a ball row, a bearing given by numbers, roller rows, sets that share a preload
heavy_ball/      one ball with inertia between its two races: where its centre settles, and the stiffness it shows the
                 outer ring
hertz            Hertz point contact with exact elliptic integrals
kinematics       how fast cage and balls turn, and at which frequencies a running spindle is excited
pair             the ball rows of all sets against each other: axial equilibrium at a temperature, and the bearing
                 states that follow
movement         how far rings move until their axial forces balance
pressure         Hertz pressure of a bearing's most loaded contact, and what ISO 76 allows at rest
roller           cylindrical roller rows: line contacts in slices, clearance that follows the temperature, stiffness
row              a ball row where its rings are at a temperature
springs          balls as springs between points of two bodies: what a ball-by-ball bearing element is made of
state            what a bearing is to the rotor: stiffness and damping, with names for their entries
catalogue        spindle bearings as their catalogues print them: preload, unloading force and rigidity of a pair
===============  =======================================================================================================
"""
