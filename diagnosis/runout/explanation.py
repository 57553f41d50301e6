"""Explanations of runout: an effect with every choice of what cannot be continuous (order, ring, bearing), alone or with another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from thermospindle.diagnosis.runout.fit import Family
from thermospindle.diagnosis.runout.sources import SourceKey, Sources, of_effect
from thermospindle.model.types import Array
from thermospindle.sim.effects.effect import Effect

ONE = 1e-3  # of the typical size, at which an effect's sources are computed: they are linear in it


@dataclass(frozen=True, eq=False)
class Variant:
    """One choice of an effect's discrete parameters; `amplitudes` of its sources a unit of its
    first parameter; `parts` numbers of its families."""

    effect: Effect
    values: Mapping[str, float]
    amplitudes: Mapping[SourceKey, complex]
    parts: tuple[int, ...]

    @property
    def prior(self) -> float:
        return self.effect.parameters[0].prior_sd


@dataclass(frozen=True, eq=False)
class Explanation:
    """Variants fitted together: `size` and `size_sd` of each; evidence over the model without effects; chi2 of all lines with priors."""

    variants: tuple[Variant, ...]
    size: Array
    size_sd: Array
    delta_evidence: float
    chi2: float
    probability: float = 0.0
    held_out_ratio: float = 1.0

    @property
    def effects(self) -> tuple[str, ...]:
        return tuple(v.effect.name for v in self.variants)

    @property
    def believable(self) -> bool:
        limits = [v.effect.parameters[0].limits for v in self.variants]
        return all(low < s < high for s, (low, high) in zip(self.size, limits, strict=True))


def variants(effect: Effect, found: Sources, parts: Sequence[Family]) -> list[Variant]:
    """Every choice of the effect's discrete parameters that shows in some line, each once."""
    main = effect.parameters[0]
    small = main.neutral + ONE * (main.typical - main.neutral)
    distinct: dict[tuple[tuple[SourceKey, complex], ...], Variant] = {}
    for chosen in product(*[p.choices or (p.typical,) for p in effect.parameters[1:]]):
        values = {main.name: small, **{p.name: v for p, v in zip(effect.parameters[1:], chosen, strict=True)}}
        amplitudes = {s: a / (small - main.neutral) for s, a in of_effect(found, effect, values).items()}
        own = tuple(i for i, f in enumerate(parts) if any(source in amplitudes for source, _ in f.source))
        largest = max((abs(a) for a in amplitudes.values()), default=1.0)
        key = tuple((s, complex(np.round(amplitudes[s] / largest, 6))) for s in sorted(amplitudes))
        if own and key not in distinct:
            distinct[key] = Variant(effect, {k: v for k, v in values.items() if k != main.name}, amplitudes, own)
    return list(distinct.values())
