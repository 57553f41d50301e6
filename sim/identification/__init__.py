"""From FRFs to modes: physical checks, poles by maximum likelihood, modes with standard errors, and which mode is which.

=============  =========================================================================================================
close_poles    two poles nearly at one place: whether they have one shape, and how far they can be told apart
frf            FRFs of one modal test, and the physical checks that measured and virtual ones must pass before anything
               is built on them
modal          modes of a measured matrix of frequency response functions, with standard errors
numbering      the modes of a run numbered at its first step and followed, measured and identified modes set beside them
padding        records that were filled up with zeros, and the lines that are theirs
pairing        which mode of one set is which of another: one cost, one assignment, and a policy for each use
peak           a modal peak of a test, wherever it is from: what a log of a run keeps of it
poles          poles of a matrix of frequency response functions by maximum likelihood, and where to start looking for
               them
rank_one       modes from poles with free residues: residue matrices of rank one, poles at one place merged, faint modes that
               bend the others
remembered     modes of FRFs that were extracted before, kept on disk
running_lines  lines of the running speed in measured FRFs: on a turning spindle the motion of unbalance and races
               stands beside the answer to the hammer
shift          the shift of a natural frequency from one condition to another, with its standard error
=============  =========================================================================================================
"""
