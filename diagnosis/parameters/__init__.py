"""What a fit may move: the sizes of effects, and build tolerances, measuring errors and the model's own errors beside them.

=========  =============================================================================================
mechanism  what an effect changes, and its law as a prior over conditions
nuisance   build tolerances, measuring errors, and the model's own constant discrepancy
masses     how bodies may have their mass otherwise than drawn
reference  modes of the reference condition, and what a constant error of the stiffness between them does
numbers    which nuisance parameters are what
sizes      of nuisances, where these are to be learned: grids, prior odds, and how the likeliest are sought
=========  =============================================================================================
"""
