"""Figures, drawn with matplotlib's object-oriented interface as SVG and PNG.

===============  =======================================================================================================
common           what all figures share: style, colours, inline SVG, maps of residuals in standard errors
compare          pictures of a comparison: map of residuals, FRFs over each other, FDAC, correlation by band and by FRF.
                 Every function returns a figure
designs          designs side by side: every figure of each, with where 95 % of drawn ones lie
diagnosis        pictures of a diagnosis: how far every explanation leads, its law as the data have it, what would have
                 to drift, and the error left
ladder           pictures of the ladder: the error at every step, and the map of residuals (mode x test) at the first
                 step and at the top
report           figures of a run's report as inline SVG: bearing states over temperature, natural frequencies by
                 source, FRFs, the section
resonance        figures of a resonance map: Campbell diagram, the same over temperature, coincidences over both, and
                 runout along both
run              small figures of a run for its Rerun log: bearing states over temperature, first hits, key to the FRFs
runout           figures of runout: orbit and polar plots with the repeatable part in a heavy line, and the spectrum
                 with its lines named
runout_campaign  pictures of measured runout: its lines beside the scene's, the map of their residuals, and what a
                 diagnosis says of them
study            figures of a study: along a sweep, spread and sensitivities, a fleet and who stands apart
warmup           figures of a warm-up: temperatures, preload, friction heat and natural frequencies over time
===============  =======================================================================================================
"""
