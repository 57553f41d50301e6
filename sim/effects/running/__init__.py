"""Effects that excite a running spindle.

==============  ========================================================================================================
ball_size       one ball of a row is larger than the others
ball_waviness   one ball of a row is not round
cage_unbalance  the cage of a row is out of balance
race_waviness   one race of one bearing carries a wave of an order that the balls feel
unbalance       the turning part is out of balance by more than its drawing allows
==============  ========================================================================================================
"""
