"""Campaigns of tests, measured or virtual: their form, FRFs as UFF, runout records, and published frequencies.

=============  =========================================================================================================
beside         A test's measured FRFs and the model's on one axis: the same points, quantity, lines and window
campaign       campaigns of tests, measured or virtual: a folder with `campaign.toml` and, a test, a UFF file of FRFs,
               rows of modes, or runout
compared       A test's FRFs and the scene's at some of its lines: loud ones, resonances, phases
form           the form of a campaign's files: keys with their units, types and ranges, and `campaign.toml` as text
likeness       FRFs beside the scene's: units, signs and channels that seem mistaken
misread        FRFs of another quantity than is told, or with real and imaginary parts exchanged
modes          tables of modes and their shapes: rows, and the CSV files of a campaign that hold them
published      natural frequencies that somebody else published, in a table beside the scene
runout_record  runout of one test of a campaign: displacement records over time, or their amplitude spectra, as CSV or
               as dataset 58 of a UFF file
simulated      A virtual runout campaign: the spindle runs in MuJoCo at several temperatures and speeds, and noisy
               probes look at it
uff            UFF files: the FRFs of one modal test as dataset 58 in, and out as binary double precision (58b)
uff_frame      the frame of a UFF file, checked byte by byte
=============  =========================================================================================================
"""
