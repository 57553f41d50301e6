"""The same numbers predicted by the model, and their derivatives.

===========  ===========================================================================================================
partners     which measured mode is which computed one: partners, numbers through all conditions, crossings, shapes of
             close modes
sensitivity  derivatives of the features by the nuisance parameters: the matrices by differences, poles and shapes from
             them exactly
theory       what the model predicts of a campaign: the same features as observed, for any tolerances and effects
===========  ===========================================================================================================
"""
