"""HTML pages that need no network.

================  ======================================================================================================
compare           the comparison as sections of the HTML report, and its own folder: report, pictures as SVG and PNG,
                  Rerun log
comparison        measured, published, computed and identified natural frequencies side by side: the table of the report
diagnosis         the diagnosis as sections of an HTML page, and the files of its folder: page, pictures as SVG and PNG
headlines         what a reader of a report should see at once: headlines, and where the model does not meet the
                  measurement, in sentences
ladder            the ladder as a section of the report, and the files of its output folder
report            the report of a run: one HTML file that needs no network, measured beside computed; what all pages
                  share
runout_compare    measured runout beside the scene's as sections of an HTML page
runout_diagnosis  the diagnosis of runout as sections of an HTML page
whole_report      what `spindle report` adds to the report of a run: the turning spindle's runout, warm-up and resonance
                  map, and a ladder for every measured campaign
================  ======================================================================================================
"""
