"""The virtual impact-hammer test: MuJoCo in time, acquisition as a laboratory does it, FRFs with standard errors.

========  ==============================================================================================================
estimate  FRFs from force and response records: windows, H1, H2, coherence, and the standard error of every line
excited   which modes a hammer test shows: the peak of each, and which are the same shape in two planes
pulse     hammer pulses: force over time as controls known before the simulation starts
reduced   the linear spindle's records by its reduced model, stepped exactly, for long records and stiff beams
test      the virtual impact-hammer test: MuJoCo in time, acquisition as a laboratory does it, and FRFs with standard
          errors
========  ==============================================================================================================
"""
