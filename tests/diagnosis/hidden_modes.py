"""Mode tables drawn from the model with random tolerances, noise and a hidden effect, as the diagnosis observes them."""

from dataclasses import replace

import numpy as np

from thermospindle.diagnosis.data.observe import DAMPING_FLOOR, FREQUENCY_FLOOR, Observation
from thermospindle.diagnosis.prediction.modes import predict
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.machine import Condition
from thermospindle.sim.campaign.campaign import Test

CONDITIONS = [(20.0, 0.0), (40.0, 754.0), (60.0, 0.0)]


def hidden(spindle, effects, seed: int) -> list[Observation]:
    """Observations of a spindle drawn from its tolerances, with effects that the diagnosis is not told of."""
    random = np.random.default_rng(seed)
    built = spindle
    for parameter in toleranced(spindle):
        built = parameter.apply(built, parameter.sd * random.standard_normal())
    nodes = len(spindle.points)
    gain = 1 + spindle.tolerances.gain * random.standard_normal(nodes)
    observations = []
    for temperature, speed in CONDITIONS:
        test = Test(f"T{temperature:g}_n{speed:.0f}", temperature, speed)
        blank = Observation(test, Condition(temperature, speed), np.ones(1), np.ones(1), np.eye(2), None, None, None, None, None)
        p = predict(built, blank, effects, spindle.tolerances.temperature * random.standard_normal())
        inside = (p.frequency > 400) & (p.frequency < 6000)
        f, z, shape = p.frequency[inside], p.damping[inside], p.shape[inside] * gain
        sd = np.concatenate([np.full(len(f), 2e-5), np.full(len(f), 1e-3)])
        noise = sd * random.standard_normal(2 * len(f))
        floor = np.concatenate([np.full(len(f), FREQUENCY_FLOOR), np.full(len(f), DAMPING_FLOOR)])
        largest = shape[np.arange(len(f)), np.argmax(np.abs(shape), axis=1)][:, None]
        residue = largest * p.participation[inside]

        def grain(like):
            return 1e-3 * (random.standard_normal(like.shape) + 1j * random.standard_normal(like.shape))

        observations.append(
            replace(
                blank,
                frequency=f * np.exp(noise[: len(f)]),
                damping=z * np.exp(noise[len(f) :]),
                covariance=np.diag(sd**2 + floor**2),
                shape=shape / largest + grain(shape),
                shape_sd=np.full(shape.shape, 1.4e-3),
                residue=residue * (1 + grain(residue)),
                residue_sd=np.full(len(f), 3e-3),
            )
        )
    return observations
