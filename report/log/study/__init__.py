"""The Rerun log of a study.

======  ===========================================================================================
log     every number of it as a series over the timeline `case`, its figures, and its summary
series  what is shown of a study over its cases, as plain numbers
======  ===========================================================================================
"""
