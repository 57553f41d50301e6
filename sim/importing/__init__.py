"""A laboratory's own files as a campaign: UFF/UNV, text tables, `.npz`, `.mat`, time records, and tables of modes.

`assemble.read` reads every file as a mapping says and collects what is open; `assemble.campaign_of` makes the campaign, or raises
everything that is open at once; `template.template` writes the mapping as a form to fill in. SI inside, as in `sim.campaign`.

=========  =============================================================================================================
asked      what files and a mapping leave open, each asked once, as a sentence
assemble   from files and a mapping to a campaign, or to everything that is still open, at once
checks     what files hold that cannot be used, and what a mapping tells of them that they do not hold
files/     what is in a file of each kind
frfs/      from curves to the FRFs of a test, with coherence, checks, peaks of magnitudes, and a look at the scene's
mapping    the form of a mapping file
measured   what files hold before anything is decided about it: curves, time records, modes, places, questions
modes      the modes of one test as rows of a campaign, with errors and shapes
names      what names of files seem to tell: temperature, speed, hammer, and which files are one test
places     which point of the campaign each end of a curve is
records/   time records: hits found and judged, windows, FRFs with coherence and standard errors
template   the mapping as a form to fill in
units      units as laboratories write them
=========  =============================================================================================================
"""
