"""Results as JSON objects and in the terminal, a module a verb.

================  ======================================================================================================
compare           a comparison as JSON and in terminal tables
effects           the catalogue of effects in words: the list, and one effect explained
designs           designs side by side, a table a condition
diagnosis/        the diagnosis of a campaign, as JSON and in sentences
grid              tables of the terminal, in as many pieces as its width asks for
ladder_table      a ladder as JSON, and as the table that grows in the terminal
ladder            what a ladder shows, in sentences with numbers
resonance         what `spindle map` says: JSON, sentences, terminal table, CSV and a section of the report
run               what `run` and `impact` say: the JSON objects, the terminal tables, and the files of a run's folder
runout            what `spindle runout` says and writes: the JSON object, the terminal table, CSV files, figures, and a
                  section for the report
runout_compare    measured runout beside the scene's, as JSON and in terminal tables
runout_diagnosis  the diagnosis of runout as JSON with the keys of `diagnosis.verdict`, and in the terminal
warmup            what `spindle warmup` says: JSON, terminal table, CSV, figures, and a section of the report
states            what `table`, `modes` and `static` say: states of equilibrium as JSON, in the terminal and as files
================  ======================================================================================================
"""
