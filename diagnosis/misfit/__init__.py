"""How the model fails, without any catalogue.

========  ==============================================================================================================
patterns  what a quantity goes with: the simplest of a few shapes over temperature, speed and hammer level that explains
          it
========  ==============================================================================================================
"""
