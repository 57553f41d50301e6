"""Model forms and effects taken in one after the other, and the error at every step.

=======  ===============================================================================================================
fitting  fits of the ladder: a model beside all tests, and beside all but those of one temperature, which it predicts
forms    model forms: how much of a bearing's thermal motion a model takes in, from the earlier literature to the full
         axial equilibrium
ladder   the ladder: model forms and effects taken in one after the other, and the error at every step
step     one step of the ladder: a model beside all data of a campaign, and the errors it leaves
=======  ===============================================================================================================
"""
