"""Studies: many computations of one scene, or of several beside each other, kept as they come, and gone on with after any interruption.

===========  =====================================================================================================
form         the study file: its keys, and what they ask for
variants     the scene with some of its keys and effect parameters changed
rows         what one case of a study gives: rows of modes, bearings, contact
draws        the spindles of a Monte Carlo study: deviations, imperfections, mixtures of two sets
comparison   designs side by side: cases of several scenes, and the probability that one is better than another
parts        the folder of results: part files written whole, what is there already, everything together
executors    where the work is done: this machine's cores, or a Dask cluster
summary      what a sweep or a Monte Carlo study says as a whole
sensitivity  which input moves what: standardised regression coefficients, cross-validated; spread; robust distances
indices      which input makes which share of the variance: Sobol's first order and total
===========  =====================================================================================================

The cases of a study are numbered, and a case depends on its number alone, so neither the order nor the place nor an interruption changes
a number.
"""
