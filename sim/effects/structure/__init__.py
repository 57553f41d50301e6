"""Effects in the structure.

====================  ==================================================================================================
added_disk            something turns with the hub that the drawing does not show: a disk, a clamp, a reflector ring
flange_fit_loosening  the flange grows away from the shaft when warm: interference goes, and with it contact stiffness
hub_flexibility       the hub's rim tilts on its web, or its rings in their seats: parts of the hub follow each other
                      only through compliant metal
modulus_softening     every material's elastic modulus falls as it warms: joints and Hertz contacts soften
mount_compliance      the base does not stand as stiffly as drawn: a gasket, a foot or a screw joint in series with the
                      mount, softening when warm
plate_prestress       A base plate that cannot expand freely carries in-plane stress, which stiffens or softens it
                      against bending
sensor_mass           what is stuck on to measure weighs: accelerometers on standing parts, reflective tape on the hub
shaft_bending         the shaft bends: a Timoshenko beam from its flange past one bearing to the other, instead of a
                      rigid body
support_anisotropy    what holds the spindle is stiffer in one direction across its axis than in the other: screws on
                      two sides, ribs, a slot
shear                 shear of the flexible shaft
rotary_inertia        rotary inertia of the flexible shaft
housing_flexibility   housing seats that give under the bearings
seat_clearance        a bearing loose in its seat
====================  ==================================================================================================
"""
