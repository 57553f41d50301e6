"""Response channels come later than the force channel: a demodulator's delay, or channels sampled one after the other."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import RotorBase
from thermospindle.sim.effects.effect import Effect, Measurement, Parameter, Values, channel_numbers, channel_parameter


def measurement(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase, measurement: Measurement) -> Measurement:
    first = values["delay"] * 1e-6
    if first == 0.0:
        return measurement
    number, only = channel_numbers(spindle), values["channel"]
    later = first * (number == only) if only else first * (1 + values["skew"] * (number - 1))
    return replace(measurement, delay=measurement.delay + later)


EFFECT = Effect(
    name="channel_delay",
    title="Delay of the response channels against the force",
    equation="Y_i(omega) -> exp(-i omega tau_i) Y_i(omega), tau_i = delay (1 + skew i), i = 0, 1, ... in the order of the points; of one channel alone where one is told",
    parameters=(
        Parameter(
            "delay",
            "us",
            neutral=0.0,
            typical=20.0,
            prior_sd=15.0,
            limits=(-500.0, 500.0),
            meaning="delay of the first response channel after the force channel",
            source="digital vibrometer decoders, 5 to 100 us by their makers' data sheets; a sample is 100 us at 10 kHz",
        ),
        Parameter(
            "skew",
            "1",
            neutral=0.0,
            typical=0.1,
            prior_sd=0.1,
            limits=(-1.0, 1.0),
            meaning="further delay from one channel to the next over the first's: a multiplexer",
            source="assumed: multiplexed converters take 1 to 10 us a channel; simultaneous ones have none",
        ),
        channel_parameter("which channel is late: 0 all of them, 1 the first in the order of the points, or in which a campaign's tests have them, and so on"),
    ),
    sees=(
        "phase falls in proportion to frequency: driving-point FRFs lose their positive real part, one-mode circles turn; "
        "with skew, shapes look complex; frequencies and damping are right"
    ),
    resembles=("window_damping", "sensor_gain"),
    valid="pure delay over the band; left uncorrected in the campaign's FRFs",
    measurement=measurement,
)
