"""What all files that are written or read back have in common.

=======  ==========================================================================
apart    files read by another process, which may break off or never end
cells    names and numbers as cells of a CSV file
formats  the format that a file is written in, and how an older one becomes today's
kept     results kept on disk between runs, the user's own alone
whole    files and folders that are written whole or not at all
=======  ==========================================================================
"""
