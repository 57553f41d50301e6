"""Figures, drawn with matplotlib's object-oriented interface as SVG and PNG.

=========  =============================================================================================================
common     the report's figures as inline SVG, drawn with matplotlib's object-oriented interface
compare    pictures of a comparison: pull map, FRFs over each other, FDAC, likeness by band and by FRF. Every function
           returns a figure
diagnosis  pictures of a diagnosis: how far every explanation leads, and the pull map before and after; those of the
           misfit are in `misfit_plots`
ladder     pictures of the ladder: the error on every rung, and the pull map (mode x test) of the first rung and of the
           top
resonance  figures of a resonance map: Campbell diagram, the same over temperature, coincidences over both, and runout
           along both
run        small figures of a run for its Rerun log: bearing states over temperature, first hits, key to the FRFs
runout     figures of runout: orbit and polar plots with the repeatable part in a heavy line, and the spectrum with its
           lines named
warmup     figures of a warm-up: temperatures, preload, friction heat and natural frequencies over time
=========  =============================================================================================================
"""
