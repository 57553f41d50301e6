"""How the matrices of every test change with what tolerances, thermometers, the expansion of
materials and of rings, and bearings among themselves may be off by."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from thermospindle.diagnosis.forward.linear import Rates, change_between, products
from thermospindle.diagnosis.forward.model import FAILED, Applied, CampaignModel
from thermospindle.model.types import Array

STEP = 0.02  # of a prior standard deviation, for differences


def rates_of(model: CampaignModel, x: Array, effects_of: Sequence[Applied], old: Rates | None = None) -> Rates:
    """dM, dC, dK by build tolerances, expansion of materials and rings, bearings apart, stiffness and inertia of balls,
    uneven joints, temperature and how bodies have their mass, for every test; what structure alone moves is kept from `old`."""
    numbers, each, dofs, uneven = [], [], [], frozenset(model.numbers.uneven)
    for t, effects in enumerate(effects_of):
        base, speed = model.bare(t, x, effects), model.operating(t, x, effects).chain.speed
        at = base.matrices
        own = [*range(len(model.build)), *model.numbers.expansion, *model.numbers.coefficients, *model.numbers.apart, *model.numbers.balls[t], *model.numbers.flung, *model.numbers.uneven, model.numbers.temperature[t]]
        kept = old.each[t] if old is not None and old.dofs[t] == at.dofs else ()
        found = []
        for k, i in enumerate(own):
            if kept and (model.structural[k] if k < len(model.build) else i in uneven):
                found.append(kept[k])
                continue
            step = x.copy()
            step[i] += STEP
            try:
                moved = model.bare(t, step, effects)
                apart = STEP
            except FAILED:  # the end of a law or of contact: from the other side
                step[i] -= 2 * STEP
                moved = model.bare(t, step, effects)
                apart = -STEP
            if moved.matrices.dofs != at.dofs:
                moved = base
            found.append(change_between(base, moved, apart))
        masses = zip(*model.heavier(at.dofs), strict=True)
        found += kept[len(own) :] or [products(mass, speed * gyroscopic, np.zeros_like(mass)) for mass, gyroscopic in masses]
        numbers.append(np.array([*own, *model.numbers.masses]))
        each.append(tuple(found))
        dofs.append(at.dofs)
    return Rates(tuple(numbers), tuple(each), tuple(dofs))
