"""Every effect there is, those of a user's own files and of installed packages among them, and the spindle of a scene with its effects found."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from thermospindle.model.machine import Spindle
from thermospindle.sim.effects import CATALOGUE, own_effects, resolved
from thermospindle.sim.effects.effect import Effect, fitted_to
from thermospindle.sim.effects.own import OwnEffect


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
    own = [e for e in known if isinstance(e, OwnEffect)]
    if own:
        from thermospindle.sim.effects.rules import check

        for effect in own:
            check(effect, spindle, known, effect.where)
    known = tuple(fitted_to(e, spindle) for e in known)
    return resolved(spindle, known), known
