"""Effects in the measuring chain.

=================  =====================================================================================================
channel_delay      response channels come later than the force channel: a demodulator's delay, or channels sampled one
                   after the other
hammer_position    the hammer does not hit where the geometry file says
sensor_gain        channels read too much or too little: one gain error for those on the turning part or for one channel,
                   another for the others
thermometer_error  thermometers read wrong: the spindle is warmer than a test says
window_damping     the exponential window's damping was not taken out of the FRFs
=================  =====================================================================================================
"""
