"""The Rerun logs of a spindle that turns, and of how it warms up.

=========  ======================================================================================================
blueprint  the blueprint stored in the log of a turning spindle: all of it in one window, playing
map        the Rerun log of a resonance map: a Campbell diagram that moves with temperature, and where its lines
           meet a mode
runout     the Rerun log of a turning spindle: the model spins and its orbit grows on the timeline `time`, RRO
           (repeatable runout) and NRRO (nonrepeatable) run beside them
warmup     the Rerun log of a warm-up: the section heats up on the timeline `time`, and temperatures, preload,
           friction and natural frequencies beside it
=========  ======================================================================================================
"""
