"""Which imperfection of a running spindle is larger than its scene lets expect.

===========  ===========================================================================================================
compare      measured runout beside the scene's: every line with its cause, and the repeatable and nonrepeatable parts
explanation  explanations of runout: an effect with every choice of what cannot be continuous (order, ring, bearing),
             alone or with another
fit          amplitudes of sources from the lines of runout tests, and the evidence for an effect among them
held_out     lines of runout predicted and met: squares of what is left of a line whose phase nothing predicts, and tests
             left out one after the other
lines        what a runout test shows: amplitude and phase of every known line at every probe with standard errors, and
             lines that theory does not know
moved        the lines that an explanation moves: measured, as the scene alone is likely to show them, and with the effect
next_test    which runout test would tell explanations apart that the tests so far do not, and what each predicts of its
             lines
sources      what every possible imperfection of a spindle would show at the probes of runout tests, and how large each
             is likely to be
verdict      which imperfection of a running spindle is larger than its scene lets expect: unbalance, a race and its
             order, a ball, a cage
===========  ===========================================================================================================
"""
