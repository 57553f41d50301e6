"""Measurement against model: compare, see where the model fails, learn which effect is missing.

============  ====================================================================================================
data/         a campaign as mode tables with covariances: what the diagnosis takes as data
prediction/   the same numbers predicted: spindle, tolerances, effects -> frequencies, damping, shapes of every test
fit/          nuisance parameters and effects fitted, and the evidence
inference/    mechanisms and free forms fitted to FRFs or mode tables together, and the evidence for each
search/       where a fit of an effect starts, and what became of what was predicted
misfit/       what a drift goes with: temperature, speed or level
compare/      modes paired through all conditions; errors, MAC, FRAC, COMAC
ladder/       model forms, tolerances, effects one after the other, and the error at every step
runout/       the same for tests of the turning spindle
verdict       `spindle diagnose`
draft         an effect of one's own from what drifts, by the simplest law of physics that fits
add           a scene with more effects and the tolerances fitted beside them
============  ====================================================================================================

Pull: (computed - measured) / standard error, where the standard error holds repeat scatter, estimator error and the model's own
numerical floor; in `compare` also the error of the test's temperature. Features are logarithms: ln frequency, ln damping ratio, ln of
shape ratios; errors in them are relative.
"""
