"""What is in a file of each kind that laboratories export, as `measured.Content`.

===========  ===========================================================================================================
arrays       named arrays: `.npz` of NumPy, `.mat` of MATLAB in version 5 and as HDF5
columns      from named columns or arrays to FRFs and time records
labels       what a column is, read off its heading or told by the mapping
mode_tables  tables of modes that somebody picked by hand
reading      which reader a file needs
text         tables of numbers in text files
uff_axes     axes and units of UFF functions: lines in Hz, steps in s, and sides of an ordinate, by label or set 164
uff_modes    modes of UFF files, with dampings as ratios
uff_sets     UFF/UNV files: FRFs, time records, geometry, modes, units
===========  ===========================================================================================================
"""
