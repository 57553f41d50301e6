"""The model of a campaign made: its scenes, tolerances, nuisance parameters and the basis of its discrepancy."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from thermospindle.diagnosis.data.lines import LineData
from thermospindle.diagnosis.data.mode_table import ModeData, TestData
from thermospindle.diagnosis.forward.model import FAILED, Applied, CampaignModel
from thermospindle.diagnosis.forward.table import Table
from thermospindle.diagnosis.parameters.nuisance import RANGE_K, Nuisance, changes_of, nuisances
from thermospindle.diagnosis.parameters.reference import reference_modes
from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.chain import matrices
from thermospindle.model.types import Array
from thermospindle.sim.campaign.beside import measured_at
from thermospindle.sim.campaign.campaign import Campaign, Noise
from thermospindle.sim.effects import of_scene
from thermospindle.sim.operating import operating_point

MOST_MODES = 24  # of the discrepancy's basis
IN_BAND, BEYOND = 1.15, 2.2  # of the highest line: modes that are seen, and modes beyond that still lend them some of their shape


def campaign_model(spindle: Spindle, campaign: Campaign, tests: Sequence[TestData]) -> CampaignModel:
    """The model of a campaign whose tests are `tests`."""
    scenes = tuple(measured_at(spindle, campaign, d.test) for d in tests)
    present = tuple(of_scene(spindle))
    reference = matrices(operating_point(spindle, Condition(spindle.reference_temperature), present).chain)
    highest = max(float(d.frequency.max()) for d in tests)
    modes = reference_modes(reference, 2 * np.pi * IN_BAND * highest, 2 * np.pi * BEYOND * highest, MOST_MODES)
    build = tuple(toleranced(spindle))
    lines = [d for d in tests if isinstance(d, LineData)]
    channels = len({node for d in lines for node in d.sensors})
    hammers = len({node for d in lines for node in d.hammers})
    names = [d.test.id for d in tests]
    parameters = nuisances(spindle, build, names, bool(lines), channels, hammers, modes, changes(spindle, present, names, [d.condition for d in tests]))
    return CampaignModel(spindle, tuple(tests), scenes, build, parameters, modes, present, lumped=campaign.lumped_shafts)


def check_tables(model: CampaignModel, where: str) -> None:
    """`BadInput` for a table with more modes than the spindle as drawn has where they may be; `where` names the campaign."""
    for t, data in enumerate(model.tests):
        if not isinstance(data, ModeData):
            continue
        try:
            linear = model.linear(t, np.zeros(len(model.parameters)), [])
        except FAILED:
            continue
        if few := Table(linear, data).too_few():
            raise BadInput(f"{where}: tests.{data.test.id}: {few}")


def changes(spindle: Spindle, present: Applied, names: Sequence[str], conditions: Sequence[Condition]) -> list[Nuisance]:
    """By what the change of the balls' stiffness with temperature and speed may be off, from how
    speed changes the drawing's across the axis; nothing of a speed at which no spindle can be built."""

    @cache
    def across(at: Condition) -> Array:
        return np.array([b.stiffness[0, 0] for b in operating_point(spindle, at, present).state.bearings])

    def faster(c: Condition) -> Array:
        try:
            return across(Condition(c.temperature, c.speed)) / across(Condition(c.temperature)) - 1.0
        except FAILED:
            return np.zeros(len(spindle.bearings))

    if not spindle.bearings:
        return []
    of_rows = [b.name for b in spindle.bearings]
    return changes_of(names, [(c.temperature - spindle.reference_temperature) / RANGE_K for c in conditions], of_rows, [faster(c) for c in conditions])


def expected_noise(spindle: Spindle) -> Noise:
    """The scene's own measuring accuracy."""
    return Noise(spindle.hammer.noise_of_value, spindle.hammer.noise_of_largest)
