"""Virtual tests: from a spindle and a condition to hammer tests, FRFs, modal peaks, runout and warm-up, and their logs and reports.

Imports `model` and `thermal`; MuJoCo steps here, and Rerun is imported by the files log*.py alone. Modules, by what they are for:

================  =======================================================================================================
effect            what a physical effect is; `sim.effects` is the catalogue, a file each
effect_file       a user's own effect; effect_rules what every effect keeps to, effect_trial one tried on a spindle
operating         the operating point: temperatures, ring motions, bearing states, chain, MuJoCo model, measuring chain
shift             modes followed from one condition to another, and the shift of a frequency with its standard error
hammer            hammer pulses
impact            the virtual hammer test: MuJoCo in time, acquisition; estimate makes FRFs with standard errors of it
frf               FRFs of one test and the physical checks they must pass
poles             poles by maximum likelihood; modal extracts modes from FRFs by them
run               the whole chain at several temperatures; output its JSON, tables and files
mode_numbers      which mode is which in a run; comparison and published set measured ones beside them
beside            measured FRFs and the model's at the same points, in the same quantity, lines and window
folder            output folders that are written whole or not at all
campaign          campaigns of tests, measured or virtual; campaign_file their form, uff FRFs of a test as UFF 58
campaign_runout   runout of a campaign's test; campaign_simulated a virtual runout campaign
excitation        imperfections as steady harmonic forces on the chain
running           the running spindle in time under these forces; moving_balls the same with balls that move
revolutions       a record cut into whole revolutions; known_lines its lines of known frequency and their causes
runout            what probes see of a turning spindle; waterfall line spectra over speed
runout_output     what `spindle runout` says and writes; runout_plots its figures, runout_drawing those of its log
resonance         where modes meet lines over temperature and speed; resonance_point one condition of it
resonance_output  what `spindle map` says; resonance_plots its figures
warmup            from cold start to steady state; warmup_output what `spindle warmup` says, warmup_plots its figures
report            the HTML report; headlines its first sentences, plots its figures, typeset its numbers
log_columns       what all Rerun logs are written with: the whole file, series, numbers, drawings, bodies
log               the log of a run; log_content what it shows, log_drawing its pictures, log_blueprint its views
log_compare       the log of a comparison; log_ladder of a ladder
log_runout        the log of a turning spindle, log_runout_blueprint its views; log_map the log of a resonance map
log_read          logs read back: log_read of runs and comparisons, log_runout_read, log_map_read
================  =======================================================================================================

A condition flows  drawing -> region temperatures -> ring motions -> bearing pair -> rotor-base chain -> measurement; effects change any of
these (`sim.effect`). Units are SI, temperatures degrees Celsius, speeds rad/s; FRFs are (responses, references, lines); the time
dependence is exp(+i omega t). Where a user reads a number it carries its unit: rpm, nm, percent.
"""
