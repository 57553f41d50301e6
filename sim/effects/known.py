"""Every effect there is, those of a user's own files and of installed packages among them, and the
spindle of a scene with its effects found."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from thermospindle.model.machine import Spindle
from thermospindle.sim.effects import CATALOGUE, own_effects, resolved
from thermospindle.sim.effects.effect import Effect, fitted_to
from thermospindle.sim.effects.own import OwnEffect, effect_of


def catalogue(files: Sequence[Path] = ()) -> tuple[Effect, ...]:
    """Every effect there is: the catalogue, installed ones and those of a user's `files`, their words checked."""
    own = own_effects(files)
    known = (*CATALOGUE, *own)
    if own:
        from thermospindle.sim.effects.rules import check_words  # with all that tries an effect, which ours need not

        for effect in own:
            check_words(effect, known, effect.where)
    return known


def equipped(spindle: Spindle, files: Sequence[Path] = ()) -> tuple[Spindle, tuple[Effect, ...]]:
    """A spindle with the effects its scene names in it, and every effect there is; a user's own are tried on the spindle first."""
    known = catalogue(files)
    for effect in known:
        _tried(effect, spindle, known)
    known = tuple(fitted_to(e, spindle) for e in known)
    return resolved(spindle, known), known


def of_file(file: Path, spindle: Spindle) -> Effect:
    """The effect of a user's file, which keeps the rules and was tried on the spindle; `BadInput` where it breaks one."""
    known, effect = catalogue([file]), effect_of(file)
    _tried(effect, spindle, known)
    return effect


def _tried(effect: Effect, spindle: Spindle, known: Sequence[Effect]) -> None:
    if isinstance(effect, OwnEffect):
        from thermospindle.sim.effects.rules import check

        check(effect, spindle, known, effect.where)
