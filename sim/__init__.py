"""Virtual tests: from a spindle and a condition to hammer tests, FRFs, modal peaks, runout and warm-up.

Imports `model` and `thermal`; MuJoCo steps here.

===============  =================================================================================================
effects/         what a physical effect is, the catalogue by what an effect acts on, and effects of one's own
operating        the operating point: temperatures, ring motions, bearing states, chain, MuJoCo model, measuring chain
hammer/          hammer pulses, the virtual hammer test, FRFs with standard errors
identification/  FRFs and their checks, poles by maximum likelihood, modes, which mode is which
posing           how the bodies of the MuJoCo model stand when modes swing or the spindle turns, for pictures of motion
run              the whole chain at several temperatures
campaign/        campaigns of tests, measured or virtual
importing/       a laboratory's own files as a campaign
running/         the running spindle: excitation, its run, runout and its lines
resonance/       natural frequencies against bearing and unbalance lines
side_by_side     MuJoCo models stepped side by side on all cores
study/           sweeps, Monte Carlo, and whatever is many computations of one scene
warmup           from cold start to steady state
===============  =================================================================================================

A condition flows  drawing -> region temperatures -> ring motions -> bearing pair -> rotor-base chain -> measurement; effects change any of
these (`sim.effects.effect`). Units are SI, temperatures degrees Celsius, speeds rad/s; FRFs are (responses, references, lines); the time
dependence is exp(+i omega t). Where a user reads a number it carries its unit: rpm, nm, percent.
"""
