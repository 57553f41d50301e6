"""From drift to an effect of one's own.

======  ============================================================================
draft   `spindle draft`: the text of the effect file, by the template effect.py.j2
laws    the simple laws of physics over temperature and speed, and their fits
answer  what drifts, read from an answer of `spindle diagnose --json`
======  ============================================================================
"""
