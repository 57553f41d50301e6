"""What explains data that the drawing misses where no effect is missing: how far the drawing is off, and what of it had to move."""

from __future__ import annotations

import numpy as np

from thermospindle.diagnosis.forward.model import CampaignModel
from thermospindle.diagnosis.parameters import nuisance as kinds_of
from thermospindle.diagnosis.parameters.nuisance import Nuisance
from thermospindle.diagnosis.verdict import Diagnosis
from thermospindle.report.text.compare import ALMOST
from thermospindle.report.typeset import plain

MOVED, NAMED = 0.5, 3  # standard deviations from which something is said to have moved, and how many of these are named
PERCENT = (kinds_of.BUILD, kinds_of.EXPANSION, kinds_of.COEFFICIENT, kinds_of.GAIN, kinds_of.HAMMER, *kinds_of.APART, kinds_of.BALLS, kinds_of.CHANGE, kinds_of.UNEVEN, kinds_of.FLUNG, kinds_of.MASSES)
UNITS = {kinds_of.TEMPERATURE: (1.0, "K"), kinds_of.MISS: (1e3, "mm"), kinds_of.PLACE: (1e3, "mm"), kinds_of.ASKEW: (180 / np.pi, "degrees")} | dict.fromkeys(PERCENT, (100.0, "%"))


def granted_words(d: Diagnosis, drawn: float) -> str:
    """Where nothing is missing although the drawing is off by `drawn` standard errors, which
    `compare` calls no agreement: what took the error to what it is; else empty."""
    base = d.search.base
    if d.verdict.word != "none" or drawn < ALMOST:
        return ""
    left = float(np.sqrt(base.evidence.chi2 / base.fit.count))
    mean, parameters = base.evidence.mean, d.search.model.parameters
    rows = sorted(((float(x), p) for x, p in zip(mean, parameters, strict=False)), key=lambda row: -abs(row[0]))
    moved = [_moved(x, p) for x, p in rows if p.kind in UNITS and abs(x) >= MOVED][:NAMED]
    constant = _constant(d.search.model, rows) if base.evidence.learned.sizes.get(kinds_of.STIFFNESS, 0.0) > 0 else ""
    by = "; ".join(filter(None, [constant, f"{', '.join(moved)}" if moved else f"no tolerance moved by more than {MOVED:g} of its standard deviations"]))
    return f"As drawn the scene misses these data by {drawn:.1f} of their own standard errors (`compare`, which counts the thermometer's too, shows it mode by mode); what takes that to {left:.2f} is {by}."


def _moved(x: float, p: Nuisance) -> str:
    times, unit = UNITS[p.kind]
    return f"{p.name} {times * p.at(x):+.2g} {unit} ({x:+z.1f} s.d.)"


def _constant(model: CampaignModel, rows: list[tuple[float, Nuisance]]) -> str:
    """The constant error of frequencies that was granted: that of the mode of which most was needed."""
    x, p = next((x, p) for x, p in rows if p.kind == kinds_of.STIFFNESS and p.modes[0] == p.modes[1])
    frequency = model.reference.omega[p.modes[0]] / (2 * np.pi)
    return f"a constant error of computed frequencies, granted to every model, most to the mode near {plain(float(f'{frequency:.3g}'))} Hz, {-100 * x * p.sd:+.2g} %"
