"""Fitting nuisance parameters and effects to the data.

========  ==============================================================================================================
fit       fitting nuisance parameters and effects to the data: Gauss-Newton with priors, and its Laplace evidence
held_out  conditions left out one after the other, each predicted from all others by a fit
lines     toleranced parameters of a spindle fitted to the lines of one test's FRFs, all else taken as known
========  ==============================================================================================================
"""
