"""Channels read too much or too little: one gain error for those on the turning part or for one channel, another for the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import RotorBase
from thermospindle.sim.effects.effect import Effect, Measurement, Parameter, Values, channel_numbers, channel_parameter


def measurement(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase, measurement: Measurement) -> Measurement:
    gain, rest, channel = values["gain"], values["rest_gain"], values["channel"]
    if gain == 0.0 and rest == 0.0:
        return measurement
    if channel:
        meant = channel_numbers(spindle) == channel
    else:
        turning = np.array([spindle.structure.body(p.body).turns for p in spindle.points])
        meant = turning if turning.any() else np.ones(len(turning), bool)
    return replace(measurement, gain=measurement.gain * np.where(meant, 1 + gain, 1 + rest))


EFFECT = Effect(
    name="sensor_gain",
    title="Gain of the response channels off by more than their tolerance",
    equation="Y_i(omega) -> (1 + g_i) Y_i(omega), g = gain on points of the turning body (on all, where no point is on one), or on one channel, rest_gain on all others",
    parameters=(
        Parameter(
            "gain",
            "1",
            neutral=0.0,
            typical=0.05,
            prior_sd=0.04,
            limits=(-0.5, 1.0),
            meaning="relative gain error of the channels on the turning part, or of one channel",
            source="a laser 18 deg off its direction reads 5 % low (cosine); vibrometer and accelerometer ranges agree to some percent",
        ),
        Parameter(
            "rest_gain",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=0.04,
            limits=(-0.5, 1.0),
            meaning="relative gain error of all other channels",
            source="calibration of the other sensor type, same size",
        ),
        channel_parameter("which channel reads gain: 0 all on the turning part (all, where none is there), 1 the first in the order of the points, or in which a campaign's tests have them, and so on"),
    ),
    sees=(
        "shapes of all modes show too much or too little at one group of points, by the same factor in every test; frequencies and "
        "damping are right"
    ),
    resembles=("sensor_mass", "hammer_position"),
    valid="gain without frequency dependence, the same throughout a campaign; a common factor of all channels is seen in FRFs alone",
    measurement=measurement,
)
