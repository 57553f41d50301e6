"""The catalogue of effects: one file each, one line here; and the effects of a scene, found in it or among a user's own.

============  ====================================================================================================
effect        what a physical effect is: equation, parameters, pure functions of one step each
known         every effect there is, a user's own among them, and the spindle of a scene with its effects found
lag           a part that has not soaked: what effects of a lag share
own           a user's own effect: a Python file, or an entry point
roles         what a scene's parts are for, and the changes that several effects make to them
rules         the rules every effect keeps
trial         an effect tried on a spindle
temperature/  temperature and expansion
bearing/      bearings
structure/    joints, bodies, shaft
holder/       what holds a tool
running/      what excites a running spindle
measuring/    the measuring chain
============  ====================================================================================================
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from thermospindle.model.errors import BadInput, instead
from thermospindle.model.machine import Spindle
from thermospindle.sim.effects.bearing import (
    ball_inertia,
    ball_material,
    bearing_misalignment,
    bond_softening,
    clearance_opening,
    constant_force_preload,
    grease_damping,
    hertz_amplitude,
    lubricant_film,
    magnetic_pull,
    preload_loss,
    ring_growth,
    tandem_sharing,
)
from thermospindle.sim.effects.effect import Effect, Values, fitted_to, refusal
from thermospindle.sim.effects.holder import drawbar_force, taper_contact
from thermospindle.sim.effects.measuring import channel_delay, hammer_position, sensor_gain, thermometer_error, window_damping
from thermospindle.sim.effects.own import OwnEffect, effect_of, installed
from thermospindle.sim.effects.running import ball_size, ball_waviness, cage_unbalance, race_waviness, unbalance
from thermospindle.sim.effects.structure import (
    added_disk,
    flange_fit_loosening,
    housing_flexibility,
    hub_flexibility,
    modulus_softening,
    mount_compliance,
    plate_prestress,
    rotary_inertia,
    seat_clearance,
    sensor_mass,
    shaft_bending,
    shear,
    support_anisotropy,
)
from thermospindle.sim.effects.temperature import (
    cooling_imbalance,
    expansion_mismatch,
    fixture_lag,
    loose_inserts,
    seat_friction,
    soak_lag,
    thermal_gradient,
)

CATALOGUE: tuple[Effect, ...] = (
    # temperature and expansion
    thermal_gradient.EFFECT,
    soak_lag.EFFECT,
    fixture_lag.EFFECT,
    expansion_mismatch.EFFECT,
    loose_inserts.EFFECT,
    cooling_imbalance.EFFECT,
    seat_friction.EFFECT,
    # bearings
    preload_loss.EFFECT,
    constant_force_preload.EFFECT,
    clearance_opening.EFFECT,
    bond_softening.EFFECT,
    ball_material.EFFECT,
    lubricant_film.EFFECT,
    grease_damping.EFFECT,
    ball_inertia.EFFECT,
    ring_growth.EFFECT,
    magnetic_pull.EFFECT,
    bearing_misalignment.EFFECT,
    hertz_amplitude.EFFECT,
    tandem_sharing.EFFECT,
    # structure
    modulus_softening.EFFECT,
    flange_fit_loosening.EFFECT,
    mount_compliance.EFFECT,
    plate_prestress.EFFECT,
    support_anisotropy.EFFECT,
    shaft_bending.EFFECT,
    hub_flexibility.EFFECT,
    shear.EFFECT,
    rotary_inertia.EFFECT,
    housing_flexibility.EFFECT,
    seat_clearance.EFFECT,
    added_disk.EFFECT,
    sensor_mass.EFFECT,
    # what holds a tool
    taper_contact.EFFECT,
    drawbar_force.EFFECT,
    # what excites a running spindle
    unbalance.EFFECT,
    race_waviness.EFFECT,
    ball_size.EFFECT,
    ball_waviness.EFFECT,
    cage_unbalance.EFFECT,
    # the measuring chain
    sensor_gain.EFFECT,
    channel_delay.EFFECT,
    window_damping.EFFECT,
    hammer_position.EFFECT,
    thermometer_error.EFFECT,
)


def by_name(name: str, catalogue: Sequence[Effect] = CATALOGUE) -> Effect:
    """The effect called `name`; `BadInput` for an unknown one."""
    for effect in catalogue:
        if effect.name == name:
            return effect
    if name.endswith(".py"):
        raise BadInput(f"effect {name!r} is a file; --effect {name} reads it, and the effect is named by its name")
    raise BadInput(f"effect {name!r} is unknown; {instead(name, (e.name for e in catalogue))}")


def usable(spindle: Spindle, catalogue: Sequence[Effect] = CATALOGUE) -> tuple[Effect, ...]:
    """The effects of a catalogue that act on a spindle and are valid there (`effect.refusal`), in its scale (`effect.fitted_to`)."""
    return tuple(fitted_to(e, spindle) for e in catalogue if refusal(e, spindle) is None)


def checked(effect: Effect, values: Mapping[str, float]) -> dict[str, float]:
    """All parameter values of an effect, neutral where not given; `BadInput` for unknown names,
    values beyond the limits, and fractions of what is counted."""
    known = {p.name: p for p in effect.parameters}
    for name, value in values.items():
        if name not in known:
            raise BadInput(f"effect {effect.name}: {name}: unknown parameter; {instead(name, known)}")
        low, high = known[name].limits
        unit = "" if known[name].unit == "1" else f" {known[name].unit}"
        if not low <= value <= high:
            raise BadInput(f"effect {effect.name}: {name} = {value:.12g}{unit}: allowed is {low:g} to {high:g}")
        if known[name].choices and value != round(value):
            raise BadInput(f"effect {effect.name}: {name} = {value:g}: it counts or chooses; allowed are whole numbers from {low:g} to {high:g}")
    return effect.neutral() | dict(values)


def own_effects(files: Sequence[Path] = ()) -> tuple[OwnEffect, ...]:
    """A user's effects: the installed ones, then those of `files`; `BadInput` for a name that is taken."""
    found = [*installed(), *[effect_of(file) for file in files]]
    taken = {e.name: "the catalogue" for e in CATALOGUE}
    for effect in found:
        where = effect.where
        if effect.name in taken:
            raise BadInput(f"{where}: effect {effect.name!r}: the name is taken by {taken[effect.name]}; names of effects must differ")
        taken[effect.name] = where
    return tuple(found)


def resolved(spindle: Spindle, catalogue: Sequence[Effect]) -> Spindle:
    """The spindle with the effects its scene names, found in `catalogue`, in it; `BadInput` for one that is not there.

    What takes a spindle from here on needs no catalogue.
    """
    known = {e.name: e for e in catalogue}
    additions = []
    for addition in spindle.effects:
        effect = known.get(addition.effect)
        if effect is None:
            raise BadInput(_not_known(spindle, addition.effect, catalogue))
        effect = fitted_to(effect, spindle)
        checked(effect, addition.values)
        additions.append(replace(addition, definition=effect))
    return replace(spindle, effects=tuple(additions))


def of_scene(spindle: Spindle) -> list[tuple[Effect, Values]]:
    """The effects a scene adds, with all their values, in order; those that `resolved` did not put there are of the catalogue."""
    found: list[tuple[Effect, Values]] = []
    for addition in spindle.effects:
        effect = addition.definition or next((e for e in CATALOGUE if e.name == addition.effect), None)
        effect = effect or next((e for e in installed() if e.name == addition.effect), None)
        if effect is None:
            raise BadInput(_not_known(spindle, addition.effect, (*CATALOGUE, *installed())))
        found.append((effect, checked(fitted_to(effect, spindle), addition.values)))
    return found


def _not_known(spindle: Spindle, name: str, catalogue: Sequence[Effect]) -> str:
    return (
        f"{spindle.file or spindle.name}: effects.{name}: is not in the catalogue; an effect of your own needs its file "
        f"(--effect FILE.py) or to be installed; known are {', '.join(e.name for e in catalogue)}"
    )
