"""Designs side by side: every figure of each, a colour a condition; of drawn ones the mean and where 95 % of them lie."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from thermospindle.report.figures.common import PALE, STYLE, colour, least_span

COLUMNS, WIDTH = 4, 10.0  # panels beside each other; inches
SHOWN = 5  # conditions
WORDS = {"lowest_Hz": "Lowest {}mode, Hz", "lowest_damping_ratio": "Damping of the lowest mode, %", "stiffness_N_per_um": "Stiffness{}, N/µm", "rro_um": "RRO{}, µm", "nrro_six_sigma_um": "NRRO, six sigma,{}, µm"}
"""What a figure is, with its unit, and where its direction or the kind of its mode stands."""
PERCENT = "lowest_damping_ratio"


def worded(figure: str) -> str:
    """The name of a figure in words with its unit: of `nrro_six_sigma_um.x` 'NRRO, six sigma, along x, µm'."""
    name, _, of = figure.partition(".")
    if name not in WORDS:
        return figure
    return WORDS[name].format((f"{of} " if of else "") if name == "lowest_Hz" else " axial" if of == "axial" else f" along {of}")


def compared(told: Mapping[str, Any]) -> dict[str, Figure]:
    """The picture of what a comparison of designs says; 'unknown' stands where a design has no number, as for NRRO where no balls roll."""
    conditions = told["conditions"][:SHOWN]
    names = [d["design"] for d in told["designs"]]
    figures = list(dict.fromkeys(f for c in conditions for f in c["figures"]))
    rows = -(-len(figures) // COLUMNS)
    every = [c["temperature_C"] for c in conditions]
    with rc_context(STYLE):
        picture = Figure(figsize=(WIDTH, 1.9 * rows + 0.9))
        grid = list(picture.subplots(rows, COLUMNS, squeeze=False).flat)
        for axes in grid[len(figures) :]:
            axes.set_axis_off()
        for axes, figure in zip(grid, figures, strict=False):
            drawn, scale = [], 100.0 if figure == PERCENT else 1.0
            for k, c in enumerate(conditions):
                if figure not in c["figures"]:
                    continue
                place = np.arange(len(names)) + 0.12 * (k - (len(conditions) - 1) / 2)
                own = list(c["figures"][figure]["designs"].values())
                middle, low, high = scale * np.array([_ends(d) for d in own], float).T
                drawn += [middle, low, high]
                label = f"{c['temperature_C']:g} °C" + (f", {c['speed_rpm']:g} rpm" if c["speed_rpm"] else "")
                axes.errorbar(place, middle, yerr=np.abs([middle - low, high - middle]), fmt="s" if c["speed_rpm"] else "o", ms=3, lw=0.9, color=colour(c["temperature_C"], every), label=label)
            least_span(axes, np.array(drawn))
            axes.set_xlim(-0.5, len(names) - 0.5)
            for without in np.flatnonzero(~np.isfinite(drawn).any(axis=0)):
                axes.text(int(without), 0.5, "unknown", transform=axes.get_xaxis_transform(), ha="center", va="center", color=PALE, fontsize=7.5)
            axes.set_title(worded(figure), fontsize=7.5)
            axes.set_xticks(range(len(names)), names, rotation=20, ha="right", fontsize=7)
        seen = {label: handle for axes in grid for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
        if seen:
            picture.legend(list(seen.values()), list(seen), loc="outside lower center", ncols=min(6, len(seen)))
    return {"comparison": picture}


def _ends(own: Mapping[str, Any]) -> tuple[float | None, float | None, float | None]:
    """Mean, and the ends of the middle 95 %, of what was drawn; else the scene's own number thrice."""
    if s := own.get("spread"):
        return s["mean"], s["quantiles"][0], s["quantiles"][-1]
    return (own["nominal"],) * 3
