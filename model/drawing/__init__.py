"""What a drawing is made of: frozen definitions in SI units, which `model.machine.Spindle` holds.

=========  ==================================================================
section    regions of the section
measuring  measuring points, the virtual hammer test, tolerances
heating    convection, heat sources, air gaps, friction of bearings
=========  ==================================================================
"""
