"""Measurement against model: compare, see where the model fails, learn which effect is missing.

============  ====================================================================================================
data/         a campaign as FRF lines, or mode tables with covariances: what the diagnosis takes as data
prediction/   what a model predicts: its modes, the next test, the smallest sizes that would have shown
parameters/   what a fit may move: sizes of effects, and tolerances and errors beside them
forward/      what the model makes of every number measured, with exact derivatives
inference/    mechanisms and free forms fitted to FRFs or mode tables together, and the evidence for each
decision/     posterior probabilities, and the answer with the least expected loss
misfit/       what a drift goes with: temperature, speed or level
compare/      modes paired through all conditions; errors, MAC, FRAC, COMAC
ladder/       model forms, tolerances, effects one after the other, and the error at every step
runout/       the same for tests of the turning spindle
verdict       `spindle diagnose`
fleet         many campaigns of one drawing, a row each, and which stand apart
line_fit      toleranced parameters fitted to the lines of one test, for scripts
draft/        an effect of one's own from what drifts, by the simplest law of physics that fits
answer        answers of `spindle diagnose --json` read again; what `add` and the workbench take of one
add           a scene with more effects and the tolerances fitted beside them
============  ====================================================================================================

Residual: (computed - measured) / standard error (JSON keys call it `pull`). In `compare` that error holds the scatter of repeats, the
identification's error, the model's own numerical floor and the error of the test's temperature; FRF lines and mode tables in
`inference` and `ladder` have their errors as stated or seen.
"""
