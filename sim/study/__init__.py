"""Studies: many computations of one scene, kept as they come, and gone on with after any interruption.

===========  =====================================================================================================
form         the study file: its keys, and what they ask for
variants     the scene with some of its keys and effect parameters changed
rows         what one case of a study gives: rows of modes, bearings, contact
parts        the folder of results: part files written whole, what is there already, everything together
executors    where the work is done: this machine's cores, or a Dask cluster
summary      what a sweep or a Monte Carlo study says as a whole
sensitivity  which tolerance moves what: standardised regression coefficients; spread; robust distances
===========  =====================================================================================================

The cases of a study are numbered, and a case depends on its number alone, so neither the order nor the place nor an interruption changes
a number.
"""
