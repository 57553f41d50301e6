"""The forward model of a campaign: what the spindle, its tolerances and effects make of every number measured, with exact derivatives.

===========  ========================================================================================================
linear       one test's linear model, and how its matrices change with parameters
response     FRFs at the lines of a test, with what their derivatives need
record       what records that end too early leave out of them
table        poles and shapes, and their derivatives, for a table of modes
shapes       a measured shape beside the nearest that a model has
rates        how the matrices change with tolerances, temperature and ring expansion
points       operating points that differ in how far the rings expand, or in how bearings and joints differ
measuring    the measuring chain: sensors and hammers off their places, and gains of both
latest       what of all these was worked out last
model        residuals of every test in standard errors
hit          where in records that end early a test was hit, where nobody tells
derivatives  of these, by nuisance parameters, by what lists of effects differ in, by light resonances
making       the model of a campaign made: scenes, tolerances, nuisance parameters
===========  ========================================================================================================
"""
