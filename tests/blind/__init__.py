"""The blind study: campaigns of a structurally different program with hidden physics, and what the diagnosis says of them (`make blind`).

==========  ============================================================================================================
module      what it is
==========  ============================================================================================================
`hidden`    mechanisms times random laws, written without a look at the catalogue; right answers by name
`world`     a campaign: another mesh, solver and structure, constant errors of modes, drifting gains, noise in lines or time
`study`     `python -m tests.blind.study --seeds A B [--out FILE]`: makes, diagnoses and keeps, a line of JSON a seed
`score`     `python -m tests.blind.score FILE ...`: rates with intervals, calibration, set sizes, failures; docs/blind.txt
==========  ============================================================================================================

Temperatures are C, speeds rad/s but in laws, where they are shares of the nominal one; sizes have the unit beside them.
"""
