"""The verbs `table`, `modes` and `static`: states of equilibrium, without a test in time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from thermospindle.model import sense
from thermospindle.model.errors import BadInput
from thermospindle.model.files.stiffness_table import StiffnessTable, write_table
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor import static as statics
from thermospindle.model.rotor.beam import with_theory
from thermospindle.model.shaft import THEORIES
from thermospindle.model.types import Array
from thermospindle.model.units import RPM
from thermospindle.report.text import states as text
from thermospindle.report.verbs.answer import (
    Answer,
    answered,
    temperature_or_reference,
    temperatures_or_range,
    with_effects,
    write_json,
)
from thermospindle.sim.operating import doubts, doubts_of_modes, operating_point, stiffness_table


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
        lambda console: text.show_told_table(console, found, spindle.loaded_across),
        out,
        {"verb": "table"} | asked,
        lambda folder, _: write_table(found, folder / "table.csv"),
        [*sense.of_conditions(spindle, conditions), *_loads(spindle, found), *_speed_left_out(spindle, found)],
    )


def _loads(spindle: Spindle, found: StiffnessTable) -> list[str]:
    rows = {b.name: found.values[b.name] for b in spindle.bearings}
    deepest = {name: 1e-6 * float(np.max(values["deformation_um"])) for name, values in rows.items()}
    least = {name: float(np.nanmin(values["preload_N"], initial=0.0)) for name, values in rows.items()}
    return [*sense.of_depths(spindle, deepest), *sense.of_loads(spindle, least)]


def _speed_left_out(spindle: Spindle, found: StiffnessTable) -> list[str]:
    """Why rows at different speeds are the same, where they are."""

    def same(values: Array) -> bool:
        return bool(np.all((values == values[:, :1]) | np.isnan(values)))

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
    beam: str | None = None,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """Modes of the linearised rotor-base model up to `highest` (Hz, the scene's band by default); a
    folder holds `modes.csv` and `spindle.xml`."""
    asked = dict(locals())
    if highest is not None and highest <= 0:
        raise BadInput(f"--highest {highest:g}: must be positive")
    spindle = _with_beam(with_effects(scene, effect_files)[0], beam)
    point = operating_point(spindle, Condition(temperature_or_reference(temperature, spindle), speed_rpm * RPM))
    end = spindle.hammer.band[1] if highest is None else highest
    values = text.modes_json(point, end)
    return answered(
        values,
        lambda console: text.show_modes(console, values, point, end),
        out,
        {"verb": "modes"} | asked,
        lambda folder, _: text.write_modes(point, folder),
        doubts_of_modes(spindle, [point]),
    )


RATED, COMPUTED = "rated", "computed"
BEARINGS = (RATED, COMPUTED)


def static(
    scene: Path,
    temperature: float | None = None,
    speed_rpm: float = 0.0,
    beam: str | None = None,
    bearings: str | None = None,
    effect_files: Sequence[Path] = (),
    out: Path | None = None,
) -> Answer:
    """Stiffness, bearing reactions and shares of the compliance for a unit force at every measuring
    point, along its direction, along the axis and the other way across it.

    `bearings` rated: springs of the stiffness that the scene's bearings are rated at, to rigid ground, the default where all
    have one and any is a ball row; computed: what the program computes, in the spindle's own housing, the default of others.
    """
    asked = dict(locals())
    spindle = _with_beam(with_effects(scene, effect_files)[0], beam)
    if bearings == RATED and not statics.rated(spindle):
        without = [b.name for b in spindle.bearings if b.rated_stiffness is None]
        raise BadInput(f"{spindle.file}: bearings.{without[0] if without else ''}: has no rated_radial_stiffness_N_per_um, which --bearings rated asks for")
    chosen = bearings or (RATED if spindle.bearings and statics.rated(spindle) else COMPUTED)
    point = operating_point(spindle, Condition(temperature_or_reference(temperature, spindle), speed_rpm * RPM))
    chain = statics.rated_chain(spindle, point.chain) if chosen == RATED else point.chain
    answers = [statics.around(spindle, chain, p) for p in spindle.points]
    values = text.static_json(answers, chosen, _beam_of(spindle))
    return answered(values, lambda console: text.show_static(console, values, answers), out, {"verb": "static"} | asked, write_json("static.json"), doubts(spindle, [point]))


def _with_beam(spindle: Spindle, beam: str | None) -> Spindle:
    """The spindle with its flexible shafts by another beam theory; `BadInput` where it has none."""
    if beam is None:
        return spindle
    if not spindle.structure.shafts:
        raise BadInput(f"{spindle.file}: shafts: there are none, so --beam {beam} has nothing to act on")
    structure = with_theory(spindle.structure, spindle.materials, spindle.reference_temperature, THEORIES[beam])
    return replace(spindle, structure=structure)


def _beam_of(spindle: Spindle) -> str:
    """The beam theory of the shafts, in one word."""
    own = {(s.shear, s.rotary) for s in spindle.structure.shafts}
    return next((name for name, shares in THEORIES.items() if own == {shares}), "none" if not own else "of its own")
