"""From curves to the FRFs of a test.

=========  ===========================================================================================
coherence  coherence beside the FRF that it is of, and what of it has no FRF
one_test   from placed curves to the FRFs of one test: SI, one quantity, common lines, checks
peaks      modes of FRFs that are magnitudes alone
=========  ===========================================================================================
"""
