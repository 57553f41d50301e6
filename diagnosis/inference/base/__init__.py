"""The model without effects, fitted: all explanations start from it.

========  ============================================================================================================
afar      where a fit without effects starts that stalls from the drawing
drawn     the fit without effects, and hits that no test tells
========  ============================================================================================================
"""
