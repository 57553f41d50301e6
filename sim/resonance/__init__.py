"""Resonance map: natural frequencies against every bearing and unbalance line, over temperature and speed.

========  ==============================================================================================================
map       where natural frequencies meet the lines of bearings and unbalance, over temperature and speed: a Campbell
          diagram with two axes
grid      the grid of a resonance map: conditions of one spindle with their modes followed from one to the next, and
          the crossings of lines and modes between its places, and just beyond them
found     what a map holds: modes and lines over the grid, and where they meet
between   crossings of a line and a mode between two neighbours of the grid, interpolated
critical  modes at the speed of what turns, which its unbalance drives, and how strongly
point     one condition of a resonance map: its modes and lines, how strongly a line excites a mode, and the runout of
          all lines
========  ==============================================================================================================
"""
