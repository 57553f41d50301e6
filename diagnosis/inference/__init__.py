"""Inference from the FRF lines (or mode tables) of a campaign: what the model lacks, by evidence.

==========  =======================================================================================================
prior       priors at reference widths, or at those learned
freeform    what would have to drift where nobody names a cause
problem     parameters, cost and derivatives of a campaign and the mechanisms that act in it
fit         tempered Levenberg-Marquardt with priors
gaussian    integrals of a quadratic over Gaussian priors, and what limits do to them
evidence    Laplace evidence with everything of unknown size learned
screening   what a mechanism promises beside a fitted model
remainder   what an explanation leaves: how far residuals say the same, and the light resonance that would make them
hypothesis  mechanisms that act together, fitted, with their evidence
resonance   the model with a light resonance more
base/       the model without effects, fitted from the drawing or from afar
singles     mechanisms one at a time: screened, and the promising ones fitted
pairs       mechanisms that act together
search      the evidence of every explanation
==========  =======================================================================================================
"""
