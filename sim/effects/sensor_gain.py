"""Channels read too much or too little: one gain error for those on the turning part, another for those on the standing parts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from model.machine import Condition, Spindle
from model.rotor_base import RotorBase
from sim.effect import Effect, Measurement, Parameter, Values


def measurement(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase, measurement: Measurement) -> Measurement:
    hub, base = values["hub_gain"], values["base_gain"]
    if hub == 0.0 and base == 0.0:
        return measurement
    factor = np.array([1 + hub if spindle.structure.body(p.body).turns else 1 + base for p in spindle.points])
    return replace(measurement, gain=measurement.gain * factor)


EFFECT = Effect(
    name="sensor_gain",
    title="Gain of the response channels off by more than their tolerance",
    equation="Y_i(omega) -> (1 + g_i) Y_i(omega), g = hub_gain on points of the turning body, base_gain on all others",
    parameters=(
        Parameter(
            "hub_gain",
            "1",
            neutral=0.0,
            typical=0.05,
            prior_sd=0.04,
            limits=(-0.5, 1.0),
            meaning="relative gain error of the channels on the turning part",
            source="a laser 18 deg off its direction reads 5 % low (cosine); vibrometer and accelerometer ranges agree to some percent",
        ),
        Parameter(
            "base_gain",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=0.04,
            limits=(-0.5, 1.0),
            meaning="relative gain error of the channels on standing parts",
            source="calibration of the other sensor type, same size",
        ),
    ),
    sees=(
        "shapes of all modes show too much or too little at one group of points, by the same factor in every test; frequencies and "
        "damping are right"
    ),
    resembles=("sensor_mass", "hammer_position"),
    valid="gain without frequency dependence, the same throughout a campaign; a common factor of all channels is seen in FRFs alone",
    measurement=measurement,
)
