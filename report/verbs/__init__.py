"""The work of each verb of the command line, as a function to be called from Python too.

A function takes what the options of its verb say, in the units people write (C, rpm, N), and returns an `Answer`: the JSON object
of `--json`, and how to print the same for a person. With `out` it writes a folder, whole or not at all. `cli` only parses and calls.

=========  =============================================================================================================
answer     what all verbs share: the answer, the scene with its effects, the output folder
catalogue  effects, add
chain      run, impact, simulate, report
compare    compare
diagnose   diagnose
importing  import
inspect    inspect
ladder     ladder
running    runout, warmup, map
starting   new, check
states     table, modes, static
study      study
workbench  workbench
=========  =============================================================================================================
"""
