"""Rerun logs, written and read back; the only place that imports rerun.

================  ======================================================================================================
blueprint         the blueprint stored in the log of a run: an overview that needs no click, and tabs for other timelines
columns           what all Rerun logs are written with: the file, whole or not at all, and series, numbers and bodies in
                  it
compare           the Rerun log of a comparison: measured and computed FRFs of every test as two series on one axis,
                  over the timeline `frequency`
content           what the log of a run shows, as plain numbers: modal peaks side by side, a summary, which FRFs in
                  which range
drawing           the deformed section as plain arrays, and colours of temperatures
ladder            the Rerun log of a ladder: on the timeline `step` everything moves as one model after the other takes
                  its place
ladder_content    what the Rerun log of a ladder shows, as plain numbers for `report.log.ladder`
map               the Rerun log of a resonance map: a Campbell diagram that moves with temperature, and where its lines
                  meet a mode
pictures          figures of matplotlib as pictures in a log, turned dark like the viewer
read              reads any of our logs back: numbers bit for bit as computed, as JSON and in words
run               the Rerun log of a run: one `.rrd` with what was computed, and a blueprint that shows it at a glance
runout            the Rerun log of a turning spindle: the model spins and its orbit grows on the timeline `time`, RRO
                  (repeatable runout) and NRRO (nonrepeatable) run beside them
study/            the Rerun log of a study
runout_blueprint  the blueprint stored in the log of a turning spindle: all of it in one window, playing
================  ======================================================================================================
"""
