"""How a built spindle differs from its drawing.

=============  ===================================================================================
tolerance      the toleranced build parameters of a spindle, each with one standard deviation
imperfections  unbalance, waviness, ball sizes, cage unbalance
drawn          plausible imperfections from a seed
=============  ===================================================================================
"""
