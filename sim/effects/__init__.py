"""The catalogue of effects: one file each, one line here."""

from __future__ import annotations

from collections.abc import Mapping

from model.machine import Spindle
from model.scene import BadInput
from sim.effect import Effect, Values

CATALOGUE: tuple[Effect, ...] = ()


def by_name(name: str, catalogue: tuple[Effect, ...] = CATALOGUE) -> Effect:
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


def of_scene(spindle: Spindle) -> list[tuple[Effect, Values]]:
    """The effects a scene adds, with all their values, in order."""
    found = []
    for addition in spindle.effects:
        effect = by_name(addition.effect)
        found.append((effect, checked(effect, addition.values)))
    return found
