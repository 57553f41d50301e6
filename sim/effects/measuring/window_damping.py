"""The exponential window's damping was not taken out of the FRFs."""

from __future__ import annotations

from dataclasses import replace

from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import RotorBase
from thermospindle.sim.effects.effect import Effect, Measurement, Parameter, Values


def measurement(spindle: Spindle, condition: Condition, values: Values, chain: RotorBase, measurement: Measurement) -> Measurement:
    turning = condition.speed != 0.0
    if values["decay"] == 0.0 or (values["tests"] == 1.0 and not turning) or (values["tests"] == 2.0 and turning):
        return measurement
    return replace(measurement, decay=measurement.decay + values["decay"])


EFFECT = Effect(
    name="window_damping",
    title="Damping added by an exponential window",
    equation=(
        "w(t) = exp(-decay t): every pole moves to lambda - decay, H(i omega) -> H(i omega + decay); damping ratio up by decay / omega_r, "
        "damped frequencies stay (Fladung & Rost, Application and correction of the exponential window for FRFs, 1997)"
    ),
    parameters=(
        Parameter(
            "decay",
            "1/s",
            neutral=0.0,
            typical=8.0,
            prior_sd=6.0,
            limits=(-20.0, 100.0),
            meaning="decay rate of a window that was applied and not corrected; negative: corrected though there was none",
            source="a window that ends at 10 % after the usual 0.3 s record: ln(10) / 0.3 s = 7.7 1/s",
        ),
        Parameter(
            "tests",
            "1",
            neutral=0.0,
            typical=0.0,
            prior_sd=1.0,
            limits=(0.0, 2.0),
            meaning="which tests it was left in: 0 all, 1 those with the spindle turning, 2 those at rest",
            source="all are evaluated alike, unless running tests, which hum, got a window of their own",
            choices=(0.0, 1.0, 2.0),
        ),
    ),
    sees="all modes more damped by the same rate, the low modes most in ratio; at every temperature, and at every speed or only when turning or at rest",
    resembles=("grease_damping", "channel_delay"),
    valid="window over the whole record, the same in all tests that have it; force unwindowed or short",
    measurement=measurement,
)
