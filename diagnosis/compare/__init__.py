"""Measurement beside model, as the scene stands.

============  ==========================================================================================================
before_after  whether an addition to the model paid: the error before and after it, over the tests it was fitted to and
              those it never saw
compare       measurement beside model, as the scene stands: modes, dampings, shapes and FRFs of every test, and one
              number for the whole
constant      what of the errors is the same at all conditions
correlation   how alike measured and computed FRFs are: by FRF, by band, line by line, and after a shift in frequency
fit           chosen parameters fitted to the errors that `compare` shows
============  ==========================================================================================================
"""
