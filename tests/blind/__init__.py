"""The blind study: campaigns of a structurally different program with hidden physics, and what the diagnosis says of them (`make blind`).

==========  ============================================================================================================
module      what it is
==========  ============================================================================================================
`laws`      random laws over temperature and speed
`hidden`    a mechanism times such a law; `hidden_bearings`, `hidden_structure`, `hidden_measuring` and all of them in
            `mechanisms`, written without a look at the catalogue; right answers by name
`departures` masses and modes otherwise than drawn, alike in all tests
`world`     one condition by another program: another mesh, solver and structure
`campaigns` a campaign of it: drifting gains, noise in lines or time
`visible`   how visible what is hidden is
`study`     `python -m tests.blind.study --seeds A B [--out FILE]`: makes, diagnoses and keeps, a line of JSON a seed
`score`     `python -m tests.blind.score FILE ...`: rates with intervals, calibration, set sizes, failures; docs/blind.txt
==========  ============================================================================================================

Temperatures are C, speeds rad/s but in laws, where they are shares of the nominal one; sizes have the unit beside them.
"""
