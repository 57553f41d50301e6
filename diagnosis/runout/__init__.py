"""Which imperfection of a running spindle is larger than its scene lets expect.

=======  ===============================================================================================================
compare  measured runout beside the scene's: every line with its cause, and the repeatable and nonrepeatable parts
fit      amplitudes of sources from the lines of runout tests, and the evidence for an effect among them
lines    what a runout test shows: amplitude and phase of every known line at every probe with standard errors, and
         lines that theory does not know
sources  what every possible imperfection of a spindle would show at the probes of runout tests, and how large each is
         likely to be
verdict  which imperfection of a running spindle is larger than its scene lets expect: unbalance, a race and its order,
         a ball, a cage
=======  ===============================================================================================================
"""
