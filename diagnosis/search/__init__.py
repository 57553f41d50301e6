"""Around the fits: where a fit of an effect should start, and what became of what was predicted.

=========  =============================================================================================================
predicted  what was predicted before a test was read, beside what it then showed: confirmed or refuted
screening  screening: what every effect would do to these data beside what tolerances can do, and where a fit of it
           should start
=========  =============================================================================================================
"""
