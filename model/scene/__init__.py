"""The scene file: what people write, read, checked and turned into `model.machine` definitions in SI units.

=============  =========================================================================================================
bearings       the form of a scene file: ball rows, bearings and how sets of them are preloaded
fields         tables of a file that people write: number types, units, laws over temperature, and what is said of the
               first thing wrong
form           the form of a scene file: every key with its unit, type and allowed range; `Scene.spindle` converts to SI
               definitions
imperfections  the form of a scene file: unbalance, waves of races and balls, ball sizes and cage unbalance of the
               running spindle
measuring      the form of a scene file: measuring points and the hammer test
reading        reading a spindle from its scene file: units, checks, provenance
section        the form of a scene file: materials and the regions of the section
structure      the form of a scene file: the bodies of the structure and the joints between them
thermal        the form of a scene file: convection, heat sources, air gaps and bearing friction
bearing_numbers  the form of a scene file: bearings given by numbers, as a matrix or a table
checks         what cannot be a spindle, refused with one sentence each
defaults       what a scene file leaves to the program: the assumed values
shafts         the form of a scene file: flexible shafts, as diameters and lengths of a drawing
=============  =========================================================================================================
"""
