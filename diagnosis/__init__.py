"""Measurement against model: compare, see where the model fails, learn which effect is missing.

================  =======================================================================================================
observe           a campaign as mode tables with covariances: what the diagnosis takes as data
data              the same as one vector of features with its covariance
theory            the same numbers predicted: spindle, tolerances, effects -> frequencies, damping, shapes of every test
sensitivity       their derivatives by tolerances
partners          which measured mode is which computed one, through all conditions
thermometer       the error of a test's temperature among the errors of its modes
lines             toleranced parameters fitted to the lines of one test, all else known: for scripts
fit               Gauss-Newton with priors, tempered, and its Laplace evidence; many_fits several of them side by side
compare           modes paired through all conditions; errors in Hz, percent and standard errors; MAC, FRAC, COMAC
correlation       likeness of FRFs by FRF, band and line: FRAC, CSAC, CSF, and FDAC with the shift it tells
compare_words     a comparison as JSON and in the terminal; compare_plots its pictures; compare_report its report, folder, log
locate            which element would have to change, by how much, at which condition: no catalogue needed
misfit            shares of the misfit, what it grows with, what would have to drift, elements that change together
shares            the misfit shared out over modes, points, bands, conditions; patterns: the simplest shape over conditions
misfit_words      the misfit as JSON and in sentences; misfit_plots its pictures
screening         what every effect would do to these data beside what tolerances can do
explain           the whole search: screening, refitting, look-alikes, pairs; decide the verdict, by evidence and held-out conditions
next_test         the test that would separate surviving explanations; prediction what was predicted beside what a test showed
verdict           `spindle diagnose`: JSON and words
diagnosis_report  the diagnosis as a page and a folder; diagnosis_plots its pictures
runout            which imperfection of a running spindle is larger than expected: verdict as in explain
runout_lines      what a runout test shows, line by line; runout_sources what every imperfection would show
runout_fit        sources fitted to lines, and the evidence; runout_compare lines beside the scene's; runout_words both told
add               a scene with more effects and the tolerances fitted beside them; catalogue tells of the effects
before_after      the error of two scenes side by side, over fitted and held-out tests
forms             model forms of the literature: fixed stiffness, radial expansion only, axial equilibrium
ladder            `spindle ladder`: forms, tolerances, effects one after the other; rung is one of them, with its errors
ladder_words      a ladder in sentences; ladder_plots its pictures, ladder_report its table, JSON and folder, ladder_log its log
whole_report      what `spindle report` adds to the report of a run
================  =======================================================================================================

Pull: (computed - measured) / standard error, where the standard error holds repeat scatter, estimator error and the model's own
numerical floor; in `compare` also the error of the test's temperature. Features are logarithms: ln frequency, ln damping ratio, ln of
shape ratios; errors in them are relative.
"""
