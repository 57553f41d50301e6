"""What all files that are written or read back have in common, and the stiffness table.

===============  ====================================================================================================
apart            files read by another process, which may break off or never end
cells            names and numbers as cells of a CSV file
formats          the format that a file is written in, and how an older one becomes today's
kept             results kept on disk between runs, the user's own alone
stiffness_table  the stiffness table: bearing properties over temperature and speed, as a CSV with units in its header
                 and its provenance above
unfinished       what long work that was stopped had computed, kept for the next time it is asked for
whole            files and folders that are written whole or not at all
===============  ====================================================================================================
"""
