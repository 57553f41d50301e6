"""What a campaign is to the diagnosis: FRF lines or mode tables, and the modes identified in every test.

==========  ============================================================================================================
blocks      neighbouring lines that hold fewer numbers than they are, compressed without loss
lines       FRFs as lines with their covariance, where a campaign has FRFs
mode_table  modes of every test with their covariances, where it has a mode table only
noise       what noise lines have: stated, measured, or told by their own scatter
observe     the modes of every test, identified or from tables, with covariances that are never zero
window      noise under an exponential window: how it is correlated over lines, and whether it is
==========  ============================================================================================================
"""
