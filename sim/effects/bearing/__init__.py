"""Effects in the bearings.

======================  ================================================================================================
ball_inertia            the balls are heavy: centrifugal force and gyroscopic moment make inner and outer contact angles
                        differ at speed
ball_material           ceramic balls instead of steel ones: stiffer, lighter, and hardly growing with temperature
bearing_misalignment    one ring sits askew: its row carries more on one side than on the other, and its stiffness
                        differs between x and y
bond_softening          the adhesive between rings and their seats is a compliance in series with the bearing, and
                        softens through its glass transition
clearance_opening       the diametral clearance opens, by wear, by temperature, or by a fit looser than drawn
constant_force_preload  A spring or a ring that slides under its adhesive keeps the preload, where the drawing has fixed
                        positions
grease_damping          the bearings' damping comes from the grease, and falls with its viscosity
hertz_amplitude         A harder hammer meets a softer bearing: the describing function of the Hertz contact
lubricant_film          the lubricant's film lifts the balls off the races: each ball counts as thicker by the films on
                        its two sides, which also give a little
magnetic_pull           the motor's magnet pulls the hub: an axial bias on the bearings, and a negative stiffness across
                        the spindle
preload_loss            the pair was assembled with less preload than its drawing says, or loses preload when warm
ring_growth             the turning ring and what is round it grow by their own centrifugal force
tandem_sharing          unequal load of rows in tandem
======================  ================================================================================================
"""
