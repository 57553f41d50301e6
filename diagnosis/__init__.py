"""Measurement against model: compare, see where the model fails, learn which effect is missing.

=============  ===================================================================================================
observe        a campaign as mode tables with covariances: what the diagnosis takes as data
theory         the same numbers predicted: spindle, tolerances, effects -> frequencies, damping, shapes of every test
fit            Gauss-Newton with priors, Laplace evidence, held-out conditions
=============  ===================================================================================================

Pull: (measured - computed) / standard error, where the standard error holds repeat scatter, estimator error and the model's own
numerical floor. Features are logarithms: ln frequency, ln damping ratio, ln of shape ratios; errors in them are relative.
"""
