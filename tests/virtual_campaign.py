"""Campaigns drawn from the model itself: exact FRFs of the linear model with noise as stated, and what was drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from thermospindle.diagnosis.data.lines import line_data
from thermospindle.diagnosis.data.mode_table import mode_data
from thermospindle.diagnosis.forward.making import campaign_model, expected_noise
from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.diagnosis.parameters import nuisance
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array, ComplexArray
from thermospindle.sim.campaign.campaign import Campaign, Noise, Test, condition_of
from thermospindle.sim.campaign.modes import ModeRow, ShapeAt
from thermospindle.sim.effects import CATALOGUE, of_scene
from thermospindle.sim.effects.effect import Effect, Values
from thermospindle.sim.identification.frf import POWER, Frf
from thermospindle.sim.identification.modal import noise_model
from thermospindle.sim.operating import operating_point

NOISE = Noise(0.004, 0.0002)
FREQUENCY = np.arange(400.0, 6000.1, 4.0)


def effect(name: str) -> Effect:
    return next(e for e in CATALOGUE if e.name == name)


def neutral_but(*named: tuple[str, Values]) -> list[tuple[Effect, Values]]:
    """Effects of the catalogue with these values, and neutral in all else."""
    return [(effect(name), {q.name: q.neutral for q in effect(name).parameters} | values) for name, values in named]


def noisy(exact: ComplexArray, random: np.random.Generator, noise: Noise = NOISE) -> ComplexArray:
    """`exact` with independent complex errors of the standard deviation that `noise` states of it."""
    sd = noise_model(exact, noise.of_value, noise.of_largest)
    return exact + sd / np.sqrt(2) * (random.standard_normal(exact.shape) + 1j * random.standard_normal(exact.shape))


@dataclass(frozen=True)
class Drawn:
    """What a virtual campaign was made with: build tolerances (relative), temperature errors (K) and gains (ln) of the channels."""

    build: Array
    warmer: Array
    gain: Array


def drawn(spindle: Spindle, tests: int, seed: int) -> Drawn:
    """Errors from the priors that the fit has."""
    random = np.random.default_rng(seed)
    t = spindle.tolerances
    build = np.array([p.sd * random.standard_normal() for p in toleranced(spindle)])
    return Drawn(build, t.temperature * random.standard_normal(tests), t.gain * random.standard_normal(len(spindle.points)))


def virtual_campaign(
    spindle: Spindle,
    conditions: Sequence[Condition],
    seed: int,
    effects: Sequence[tuple[Effect, Values]] = (),
    errors: Drawn | None = None,
    responses: Sequence[int] | None = None,
    references: Sequence[int] | None = None,
    quantity: str = "mobility",
    window_decay: float = 0.0,
    noise: Noise = NOISE,
    frequency: Array = FREQUENCY,
) -> Campaign:
    """A test a condition between the nodes `responses` and `references` (all and the scene's hammers by default)."""
    random = np.random.default_rng(1000 + seed)
    nodes = tuple(p.node for p in spindle.points)
    responses, references = tuple(responses or nodes), tuple(references or spindle.hammer.hammer_nodes)
    built = replace(spindle, hammer=replace(spindle.hammer, hammer_nodes=references))
    for p, x in zip(toleranced(spindle), errors.build if errors else (), strict=False):
        built = p.apply(built, x)
    tests = []
    for t, condition in enumerate(conditions):
        warmer = errors.warmer[t] if errors else 0.0
        point = operating_point(built, replace(condition, temperature=condition.temperature + warmer), [*of_scene(spindle), *effects])
        exact = point.frf(frequency, window_decay)[[nodes.index(n) for n in responses]]
        exact = exact * (2j * np.pi * frequency + window_decay) ** POWER[quantity]
        if errors:
            exact = exact * np.exp(errors.gain[: len(responses)])[:, None, None]
        frf = Frf(frequency, noisy(exact, random, noise), responses, references, quantity)
        tests.append(Test(f"test_{t}", condition.temperature, condition.speed, frf=frf, window_decay=window_decay))
    return Campaign("virtual", spindle.name, quantity, spindle.points, tuple(tests), noise, lumped_shafts=bool(spindle.structure.shafts))


def mode_campaign(
    spindle: Spindle, conditions: Sequence[Condition], seed: int, effects: Sequence[tuple[Effect, Values]] = (), damping: bool = True,
    errors: Drawn | None = None, shapes: Sequence[int] = (), real: bool = False,
) -> Campaign:
    """Tables of the modes in the hammer's band, frequencies to 1e-4 and damping ratios to 1 %, and shapes at the
    nodes `shapes` to 1 % of their largest in either part, or the `real` one alone of which they show the most."""
    random = np.random.default_rng(2000 + seed)
    built = spindle
    for p, x in zip(toleranced(spindle), errors.build if errors else (), strict=False):
        built = p.apply(built, x)
    tests = []
    for t, condition in enumerate(conditions):
        warmer = errors.warmer[t] if errors else 0.0
        point = operating_point(built, replace(condition, temperature=condition.temperature + warmer), [*of_scene(spindle), *effects])
        rows = []
        for k, mode in enumerate(m for m in point.modes if spindle.hammer.band[0] < m.frequency < spindle.hammer.band[1]):
            sd, ratio_sd = 1e-4 * mode.frequency, 0.01 * mode.damping_ratio
            frequency = mode.frequency + sd * random.standard_normal()
            ratio = mode.damping_ratio + ratio_sd * random.standard_normal()
            told: tuple[ShapeAt, ...] = ()
            if shapes:
                seen = point.measurement.response_rows[[[p.node for p in spindle.points].index(n) for n in shapes]] @ mode.shape
                seen = seen * np.exp(-0.5j * np.angle(np.sum(seen**2))) / np.abs(seen).max()
                seen = seen + 0.01 * (random.standard_normal(len(seen)) + 1j * random.standard_normal(len(seen)))
                told = tuple(ShapeAt(n, complex(v.real) if real else complex(v), 0.01) for n, v in zip(shapes, seen, strict=True))
            rows.append(ModeRow(f"test_{t}", k + 1, mode.kind, frequency, sd, ratio if damping else None, ratio_sd if damping else None, told))
        tests.append(Test(f"test_{t}", condition.temperature, condition.speed, modes=tuple(rows)))
    return Campaign("virtual modes", spindle.name, "mobility", spindle.points if shapes else (), tuple(tests), lumped_shafts=bool(spindle.structure.shafts))


def model_of(spindle: Spindle, campaign: Campaign) -> CampaignModel:
    """The model that the diagnosis makes of a campaign."""
    expected = expected_noise(spindle)
    data = [line_data(t, condition_of(t), campaign.noise, expected) if t.frf else mode_data(t, condition_of(t), spindle.tolerances.gain) for t in campaign.tests]
    return campaign_model(spindle, campaign, data)


def truth(model: CampaignModel, errors: Drawn) -> Array:
    """What was drawn as nuisance values (P,) in prior standard deviations; discrepancies, drifts and thermal motions are none."""
    x = np.zeros(len(model.parameters))
    for i, p in enumerate(model.parameters):
        if p.kind == nuisance.BUILD:
            x[i] = errors.build[p.index] / p.sd
        elif p.kind == nuisance.TEMPERATURE and p.test is not None:
            x[i] = errors.warmer[p.test] / p.sd
        elif p.kind == nuisance.GAIN:
            x[i] = errors.gain[p.index] / p.sd
    return x


def fitted(scene: Spindle, conditions, seed: int, responses=(1, 3, 6), **changes):
    """Model, its fit, and what it was made with, for a campaign of three channels."""
    errors = drawn(scene, len(conditions), seed)
    model = model_of(scene, virtual_campaign(scene, conditions, seed, errors=errors, responses=responses, **changes))
    return model, fit(model), errors
