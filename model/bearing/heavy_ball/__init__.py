"""One ball with inertia between its two races.

========  ====================================================================================================
balance   where its centre settles, the stiffness it shows the outer ring, and what its cage drives
inertia   how fast it orbits by rolling, its centrifugal force and its gyroscopic moment
together  the balls of many rows at once, each on a line of its own, at the speeds of their cages
========  ====================================================================================================
"""
