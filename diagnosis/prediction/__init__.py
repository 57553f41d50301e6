"""What a model predicts: its modes and which of them the measured ones are, the next test, the smallest sizes that would have shown.

===========  ===========================================================================================================
modes        the modes that a model has at the condition of a test, as its measuring points show them
detectable   smallest sizes of effects that would have shown
forecast     what an explanation predicts of a test that has not been made, and the errors that all modes of it share
next_test    which test would decide between the explanations that survive
outcomes     what was predicted before a test was read, beside what it then showed: confirmed or refuted
partners     which measured mode is which computed one: partners, numbers through all conditions, crossings, shapes of
             close modes
temperature  what a test's temperature error does to its modes: one unknown for the whole test, so its errors are
             correlated
===========  ===========================================================================================================
"""
