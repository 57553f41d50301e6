"""One parameter of the rotor-base model fitted from one virtual impact test, twice: MuJoCo's system
identification toolbox, and this program.

A spindle whose parameter is `TRUE` above its drawing is hit once at each hammer node and measured with the scene's noise.
Both start from the drawing, know everything else, and get the same records, the same band and the same noise. The toolbox
simulates the records with trial values until the response agrees; this program estimates the FRFs and fits the parameter to
their lines (`diagnosis.line_fit`). The toolbox has every advantage that the comparison allows: records and trial simulations
come from one model with one step (no error of the model at all), its residuals are whitened with the noise that was put in,
a compiled model comes from our own chain within milliseconds, and it stops at `ENOUGH`, below its standard error.
"""

from __future__ import annotations

import io
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid

from thermospindle.diagnosis.line_fit import fit_lines
from thermospindle.model.built.tolerance import Toleranced, toleranced
from thermospindle.model.drawing.measuring import HammerTest
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.scene.reading import load
from thermospindle.model.types import Array
from thermospindle.sim.hammer.test import ImpactTest, estimate_of, impact_tests, loaded_state, sampling
from thermospindle.sim.operating import operating_point

PARAMETERS = ("plate tilt x stiffness", "preload")
TRUE = 0.02  # relative deviation of the parameter
LIMITS = (-0.2, 0.2)  # that both may search
ENOUGH = 1e-5  # step of the parameter at which the toolbox may stop: Gauss-Newton is then far nearer
DIFFERENCE = 1e-5  # of the parameter, for the toolbox's Jacobian: its own 1.5e-8 drowns in the tolerance of the bearing equilibrium
SEEDS = 3
COLD = Condition(20.0)
INSTALL = ".venv/bin/python -m pip install --editable '.[bench]'"


@dataclass(frozen=True)
class Estimated:
    """A relative deviation with its stated standard error, the seconds it took, and the simulations of the records on the way."""

    value: float
    sd: float
    seconds: float
    simulations: int


def available() -> bool:
    """Whether the packages that the toolbox asks for are installed; without them its module is there, but empty."""
    return hasattr(sysid, "optimize")


def parameter(spindle: Spindle, name: str) -> Toleranced:
    return next(p for p in toleranced(spindle) if p.name == name)


def measured(spindle: Spindle, name: str, seed: int) -> ImpactTest:
    """One hit at every hammer node of the spindle that deviates."""
    built = parameter(spindle, name).apply(spindle, TRUE)
    return impact_tests([operating_point(built, COLD)], seed=seed)[0]


def ours(spindle: Spindle, name: str, test: ImpactTest) -> Estimated:
    """FRFs of the records, then the parameter from their lines."""
    start = time.perf_counter()
    estimated = estimate_of(spindle.hammer, test.point, test.record)
    found = fit_lines(spindle, COLD, estimated.h1, [parameter(spindle, name)], estimated.window_decay)
    return Estimated(float(found.value[0]), float(found.sd[0]), time.perf_counter() - start, 0)


def held_force(test: HammerTest, force: Array) -> Array:
    """The sampled force (n,) as a control held over each integration step, its middle at the middle of the step.

    Exact between the samples within the band; from there to half the sampling rate it fades out along a cosine, so that the pulse does not
    ring over the edges of the record.
    """
    every, n = sampling(test)[0], len(force)
    frequency = np.fft.rfftfreq(n, 1 / test.sample_rate)
    fade = np.cos(np.pi / 2 * np.clip((frequency - test.band[1]) / (test.sample_rate / 2 - test.band[1]), 0, 1)) ** 2
    hold = np.sinc(frequency * test.step) * np.exp(-1j * np.pi * frequency * test.step)
    spectrum = np.zeros(n * every // 2 + 1, complex)
    spectrum[: n // 2 + 1] = np.fft.rfft(force) * fade / hold
    return np.fft.irfft(spectrum, n * every) * every


def toolbox(spindle: Spindle, name: str, test: ImpactTest) -> Estimated:
    """MuJoCo's own: nonlinear least squares over simulations of the records, force in and vibrometers out."""
    deviating = parameter(spindle, name)
    settings = test.settings
    every, _ = sampling(settings)
    simulations = 0

    def build(parameters: Any, spec: mujoco.MjSpec) -> mujoco.MjModel:
        nonlocal simulations
        simulations += 1
        return operating_point(deviating.apply(spindle, float(parameters["x"].value[0])), COLD).model

    def whitened(parameters: Any, predicted: Any, record: Any, *_: Any, **__: Any) -> tuple[Array, Any, Any]:
        """Lines of the band, real and imaginary, each in its own standard deviations: those `sim.hammer.test` gives its noise."""
        seen = predicted.data[::every][: len(record.data)]
        frequency = np.fft.rfftfreq(len(record.data), 1 / settings.sample_rate)
        band = (frequency >= settings.band[0]) & (frequency <= settings.band[1])
        spectrum, wrong = np.fft.rfft(record.data, axis=0)[band], np.fft.rfft(record.data - seen, axis=0)[band]
        sd = np.hypot(settings.noise_of_value * np.abs(spectrum), settings.noise_of_largest * np.abs(spectrum).max())
        residual = np.sqrt(2) * wrong / sd
        return np.concatenate([residual.real, residual.imag]), sysid.TimeSeries(record.times, seen, record.signal_mapping), record

    start = time.perf_counter()
    nominal = operating_point(spindle, COLD)
    model, mapping = nominal.model, sysid.TimeSeries.compute_all_sensor_mapping(nominal.model)
    controls, records = [], []
    for r, node in enumerate(settings.hammer_nodes):
        for force, velocity in zip(test.record.force[r], test.record.velocity[r], strict=True):
            control = np.zeros((len(force) * every, model.nu))
            control[:, model.actuator(f"hammer{node}").id] = held_force(settings, force)
            controls.append(sysid.TimeSeries(np.arange(len(control)) * settings.step, control))
            records.append(sysid.TimeSeries(test.record.time, velocity.T.copy(), mapping))
    labels, states = [f"hit {i + 1}" for i in range(len(controls))], [loaded_state(model)] * len(controls)
    sequences = sysid.ModelSequences("spindle", nominal.spec(), labels, states, controls, records)
    residual = sysid.build_residual_fn(models_sequences=[sequences], build_model=build, modify_residual=whitened, resample_true=False)
    free = sysid.ParameterDict({"x": sysid.Parameter("x", 0.0, *LIMITS)})
    found, result = sysid.optimize(free, residual, verbose=False, xtol=ENOUGH, eps=DIFFERENCE, output=io.StringIO())
    took = time.perf_counter() - start
    return Estimated(float(found["x"].value[0]), float(1 / np.linalg.norm(result.jac)), took, simulations)


def beside(spindle: Spindle, name: str, seed: int) -> tuple[Estimated, Estimated]:
    """Ours, with the median time of three runs after one to warm up, and the toolbox's estimate from one test."""
    single = replace(spindle, hammer=replace(spindle.hammer, hits=1))
    test = measured(single, name, seed)
    runs = [ours(single, name, test) for _ in range(4)][1:]
    return sorted(runs, key=lambda run: run.seconds)[1], toolbox(single, name, test)


def rows(spindle: Spindle) -> list[tuple[str, str, str]]:
    """What, figures, what was asked: a line of seconds and a line of errors for every parameter."""
    if not available():
        return [("one parameter from one test, beside MuJoCo's sysid", f"left out, needs {INSTALL}", "20 times faster")]
    found = []
    for name in PARAMETERS:
        pairs = [beside(spindle, name, seed) for seed in range(SEEDS)]
        fast, slow = (median(e.seconds for e in who) for who in zip(*pairs, strict=True))
        ratio = median(other.seconds / own.seconds for own, other in pairs)
        what = f"{name} fitted: ours / MuJoCo's sysid"
        seconds = f"{fast:.3f} / {slow:.1f} s: {ratio:.0f} times"
        errors = " / ".join(f"{rms:.0f} ({sd:.0f}) ppm" for rms, sd in (errors_of(who) for who in zip(*pairs, strict=True)))
        found += [(what, seconds, "20 times"), (f"    rms error of {SEEDS} tests (stated)", errors, "equal")]
    return found


def errors_of(estimates: Sequence[Estimated]) -> tuple[float, float]:
    """Root mean square error, and median of the stated standard errors, in parts per million of the parameter."""
    rms = np.sqrt(np.mean([(e.value - TRUE) ** 2 for e in estimates]))
    return 1e6 * float(rms), 1e6 * median(e.sd for e in estimates)


def main() -> None:
    """Every single estimate; `make bench` prints the summary."""
    scene = load(Path(__file__).parents[1] / "scenes" / "hdd_2003")
    for name in PARAMETERS if available() else ():
        for seed in range(SEEDS):
            for who, e in zip(("ours", "toolbox"), beside(scene, name, seed), strict=True):
                error = f"error {1e6 * (e.value - TRUE):+.1f} +- {1e6 * e.sd:.1f} ppm"
                print(
                    f"{name}, test {seed + 1}, {who}: {error}, {e.seconds:.3f} s, {e.simulations} simulations",
                    flush=True,
                )
    if not available():
        print(*rows(scene)[0])


if __name__ == "__main__":
    main()
