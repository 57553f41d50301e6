"""Resonance map: natural frequencies against every bearing and unbalance line, over temperature and speed.

=====  =================================================================================================================
map    where natural frequencies meet the lines of bearings and unbalance, over temperature and speed: a Campbell
       diagram with two axes
point  one condition of a resonance map: its modes and lines, how strongly a line excites a mode, and the runout of all
       lines
=====  =================================================================================================================
"""
