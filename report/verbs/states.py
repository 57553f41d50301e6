"""The verbs `table` and `modes`: states of equilibrium, without a test in time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from thermospindle.model import sense
from thermospindle.model.bearing.stiffness_table import StiffnessTable, write_table
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.report.text import run as text
from thermospindle.report.verbs.answer import Answer, answered, temperature_or_reference, temperatures_or_range, with_effects
from thermospindle.sim.operating import operating_point, stiffness_table


def table(
    scene: Path,
    temperatures: Sequence[float] | None = None,
    speeds_rpm: Sequence[float] = (0.0,),
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """Bearing stiffness over temperature (C) and speed; a folder holds `table.csv`."""
    asked = dict(locals())
    spindle, _ = with_effects(scene, effect_files)
    steps = temperatures_or_range(temperatures, spindle)
    found = stiffness_table(spindle, steps, [s * RPM for s in speeds_rpm])
    conditions = [Condition(t, s * RPM) for t in steps for s in speeds_rpm]
    return answered(
        text.table_json(found),
        lambda console: text.show_table(console, found),
        out,
        {"verb": "table"} | asked,
        lambda folder, _: write_table(found, folder / "table.csv"),
        [*sense.of_conditions(spindle, conditions), *_depths(spindle, found), *_speed_left_out(spindle, found)],
    )


def _depths(spindle: Spindle, found: StiffnessTable) -> list[str]:
    deepest = {name: 1e-6 * float(np.max(values["deformation_um"])) for name, values in found.values.items()}
    return sense.of_depths(spindle, deepest)


def _speed_left_out(spindle: Spindle, found: StiffnessTable) -> list[str]:
    """Why rows at different speeds are the same, where they are."""

    def same(values: Array) -> bool:
        return bool(np.all(values == values[:, :1]))

    if len(found.speed) < 2 or not all(same(values) for own in found.values.values() for values in own.values()):
        return []
    if spindle.ball_inertia:
        return ["the bearings are the same at every speed"]
    return [
        "the bearings are the same at every speed, since the balls' centrifugal force and gyroscopic moment are left out; "
        "bearing_pair.ball_inertia = 1 takes them in, or the effect ball_inertia"
    ]


def modes(
    scene: Path,
    temperature: float | None = None,
    speed_rpm: float = 0.0,
    highest: float | None = None,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """Modes of the linearised rotor-base model up to `highest` (Hz, the scene's band by default); a folder holds `modes.csv` and `spindle.xml`."""
    asked = dict(locals())
    if highest is not None and highest <= 0:
        raise BadInput(f"--highest {highest:g}: must be positive")
    spindle, _ = with_effects(scene, effect_files)
    point = operating_point(spindle, Condition(temperature_or_reference(temperature, spindle), speed_rpm * RPM))
    values = text.modes_json(point, spindle.hammer.band[1] if highest is None else highest)
    doubts = sense.of_conditions(spindle, [point.condition]) + sense.of_states(spindle, [point.state.bearings])
    return answered(
        values,
        lambda console: text.show_modes(console, values, point),
        out,
        {"verb": "modes"} | asked,
        lambda folder, _: text.write_modes(point, folder),
        doubts,
    )
