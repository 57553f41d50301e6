"""Hammer tests as time records: from files with a force and its responses to FRFs, and to what is open of them.

=========  =========================================================================================
exchanged  whether the force of a file is a response, and a response its force
grouped    which records one hammer point of one test made
hits       hits found in a record, taken out of it, and judged
spectra    from the hits of one hammer point to its FRFs
windows    the window that records need, the contact of the hammer, and the band that it excites
=========  =========================================================================================
"""
