"""From the evidence of every explanation to an answer.

============  ====================================================================================================
explanations  posterior probabilities, laws of one effect and free forms that are its change taken together
loss          the answer with the least expected loss
verdict       the verdict: what is no answer whatever its probability, and that answer
reason        why, in sentences
conditions    which tests were made at one condition
errors        what is left of every test: as drawn, fitted to all tests, predicted from all other conditions
============  ====================================================================================================
"""
