"""What a campaign is to the diagnosis: modes of every test with covariances, and one vector of features.

===========  ===========================================================================================================
features     what a campaign is to the diagnosis: one vector of features with its covariance
lines        FRFs as lines with their covariance, where a campaign has FRFs
mode_table   modes of every test with their covariances, where it has a mode table only
observe      a campaign as the diagnosis sees it: for every test its modes, with covariances that are never zero
thermometer  what a test's temperature error does to its modes: one unknown for the whole test, so its errors are
             correlated
===========  ===========================================================================================================
"""
