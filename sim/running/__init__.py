"""The running spindle: what excites it, its run in MuJoCo, and runout with the lines it is made of.

============  ==========================================================================================================
excitation    what excites a running spindle: unbalance, waviness, ball sizes and the cage, as steady harmonic forces on
              the rotor-base chain
lines         lines of known frequency in a record: their phasors by least squares, which causes they have, and what no
              cause explains
moving_balls  ball by ball, with the balls moving: the second way to the running spindle, without small amplitudes
probes        probes fixed in space: what they look at, and how fast that turns
pulls         by what one rolling element pulls on its rings for what it meets, at every azimuth
revolutions   A running record cut into whole revolutions: what repeats in every one of them, and what does not
run           the running spindle in time: MuJoCo under the forces of its imperfections, at constant speed, in run-up
              and in coast-down
rows          what a bearing's waves and element sizes do: free displacements of its rings, for the excitation
runout        runout of a turning spindle: what probes at points in space see, what of it repeats, which lines it holds
              and why
steady        runout in the steady state from the lines alone, exactly and without a record
waterfall     line spectra over speed: what a run-up passes through, steady at every speed, with the natural frequencies
              it crosses
whirl         phasors of what whirls about the axis
============  ==========================================================================================================
"""
