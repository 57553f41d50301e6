"""Measurement against model: compare, see where the model fails, learn which effect is missing.

=============  ===================================================================================================
observe        a campaign as mode tables with covariances: what the diagnosis takes as data
theory         the same numbers predicted: spindle, tolerances, effects -> frequencies, damping, shapes of every test
compare        modes paired through all conditions; errors in Hz, percent and standard errors; MAC, FRAC, COMAC
fit            Gauss-Newton with priors, tempered, and its Laplace evidence
add            a scene with one more effect; catalogue tells of the effects
explain        screening, refitting, pairs, held-out conditions: one of five verdicts
locate         which element would have to change, by how much, at which condition: no catalogue needed
next_test      the test that would separate surviving explanations
verdict        `spindle diagnose`: JSON and words
=============  ===================================================================================================

Pull: (computed - measured) / standard error, where the standard error holds repeat scatter, estimator error and the model's own
numerical floor. Features are logarithms: ln frequency, ln damping ratio, ln of shape ratios; errors in them are relative.
"""
