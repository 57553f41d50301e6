"""Model forms and effects taken in one after the other, and the error at every step.

========  ==============================================================================================================
fitting   fits of the ladder: a model beside all tests, and beside all but a part of them, which it predicts
forms     model forms: how much of a bearing's thermal motion a model takes in, from the earlier literature to the full
          axial equilibrium; of beams without bearings the one that is drawn
ladder    the ladder: model forms and effects taken in one after the other, and the error at every step
left_out  what is left out of a fit, which then has to predict it: tests of one condition, or modes of a table
step      one step of the ladder: a model beside all data of a campaign, and the errors it leaves
========  ==============================================================================================================
"""
