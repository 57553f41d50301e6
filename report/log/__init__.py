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
impact            the Rerun log of an impact test: every hit in time, the FRFs with their coherence, and the modal peaks
ladder            the Rerun log of a ladder: on the timeline `step` everything moves as one model after the other takes
                  its place
ladder_content    what the Rerun log of a ladder shows, as plain numbers for `report.log.ladder`
pictures          figures of matplotlib as pictures in a log, turned dark like the viewer
read              reads any of our logs back: numbers bit for bit as computed
run               the Rerun log of a run: one `.rrd` with what was computed, and a blueprint that shows it at a glance
study/            the Rerun log of a study
told              what a log holds, as JSON and in words, and its FRFs as tables
views             what all blueprints are made of: paths of entities, views and their axes, and the window that holds
                  them
turning/          the Rerun logs of a spindle that turns, and of how it warms up
================  ======================================================================================================
"""
