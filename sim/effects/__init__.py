"""The catalogue of effects: one file each, one line here; and the effects of a scene, found in it or among a user's own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from model.machine import Spindle
from model.scene import BadInput
from sim.effect import Effect, Values
from sim.effect_file import OwnEffect, effect_of, installed
from sim.effects import (
    added_disk,
    ball_inertia,
    ball_material,
    ball_size,
    ball_waviness,
    bearing_misalignment,
    bond_softening,
    cage_unbalance,
    channel_delay,
    clearance_opening,
    constant_force_preload,
    expansion_mismatch,
    flange_fit_loosening,
    grease_damping,
    hammer_position,
    hertz_amplitude,
    hub_flexibility,
    loose_inserts,
    lubricant_film,
    magnetic_pull,
    modulus_softening,
    mount_compliance,
    plate_prestress,
    preload_loss,
    race_waviness,
    ring_growth,
    sensor_gain,
    sensor_mass,
    shaft_bending,
    soak_lag,
    support_anisotropy,
    thermal_gradient,
    unbalance,
    window_damping,
)

CATALOGUE: tuple[Effect, ...] = (
    # temperature and expansion
    thermal_gradient.EFFECT,
    soak_lag.EFFECT,
    expansion_mismatch.EFFECT,
    loose_inserts.EFFECT,
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
    # structure
    modulus_softening.EFFECT,
    flange_fit_loosening.EFFECT,
    mount_compliance.EFFECT,
    plate_prestress.EFFECT,
    support_anisotropy.EFFECT,
    shaft_bending.EFFECT,
    hub_flexibility.EFFECT,
    added_disk.EFFECT,
    sensor_mass.EFFECT,
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
)


def by_name(name: str, catalogue: Sequence[Effect] = CATALOGUE) -> Effect:
    """The effect called `name`; `BadInput` for an unknown one."""
    for effect in catalogue:
        if effect.name == name:
            return effect
    raise BadInput(f"effect {name!r} is unknown; allowed are {', '.join(e.name for e in catalogue) or 'none'}")


def checked(effect: Effect, values: Mapping[str, float]) -> dict[str, float]:
    """All parameter values of an effect, neutral where not given; `BadInput` for unknown names and values beyond the limits."""
    known = {p.name: p for p in effect.parameters}
    for name, value in values.items():
        if name not in known:
            raise BadInput(f"effect {effect.name}: {name}: unknown parameter; allowed are {', '.join(known)}")
        low, high = known[name].limits
        if not low <= value <= high:
            raise BadInput(f"effect {effect.name}: {name} = {value:g} {known[name].unit}: allowed is {low:g} to {high:g}")
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
        found.append((effect, checked(effect, addition.values)))
    return found


def _not_known(spindle: Spindle, name: str, catalogue: Sequence[Effect]) -> str:
    return (
        f"{spindle.file or spindle.name}: effects.{name}: is not in the catalogue; an effect of your own needs its file "
        f"(--effect FILE.py) or to be installed; known are {', '.join(e.name for e in catalogue)}"
    )
