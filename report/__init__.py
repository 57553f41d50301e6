"""Everything that shows results: words, figures, pages, Rerun logs. Imports all other packages; only `cli` imports it.

============  ==========================================================================================================
folder        output folders: replaced only where they hold nothing but what spindle wrote
progress      what is being done, on standard error: a bar in a terminal, plain lines now and then elsewhere
typeset       numbers as a page shows them: true minus signs, signs, standard errors to their own digit
check/        what the program understands of a scene: words, picture, page
figures/      figures, drawn with matplotlib's object-oriented interface as SVG and PNG
log/          Rerun logs, written and read back; the only place that imports rerun
page/         HTML pages that need no network
text/         results as JSON objects and in the terminal, a module a verb
workbench/    the page of `spindle workbench`; the only place that imports bokeh
verbs/        the work of each verb of the command line, as a function
============  ==========================================================================================================
"""
