"""FRFs of the rotor in the forms that laboratories export, and a mapping for them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.made_campaign import rotor_frf
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import read_campaign

FRF = rotor_frf(noise=0.0005)
SPINDLE = 'spindle = "hdd_2003"\n'
HEAD = """
[[tests]]
id = "T20"
temperature_C = 20.0
speed_rpm = 0.0
[[points]]
node = 1
name = "hub_top0"
body = "hub"
position_mm = [12.0, 0.0, 20.0]
direction = "+Z"
[[points]]
node = 3
name = "hub_side0"
body = "hub"
position_mm = [12.5, 0.0, 15.0]
direction = "-X"
[[points]]
node = 6
name = "seat90"
body = "seat"
position_mm = [0.0, 20.0, 0.0]
direction = "+Z"
"""
PAIRS = [(r, q) for r in FRF.response_nodes for q in FRF.reference_nodes]


def imported(folder: Path, mapping: str, *files: Path):
    (folder / "mapping.toml").write_text(SPINDLE + mapping + HEAD)
    bring(files, mapping=folder / "mapping.toml", out=folder / "campaign")
    return read_campaign(folder / "campaign").tests[0].frf


def table(file: Path, heads: list[str], columns: list[np.ndarray], separator: str = ",", comma: bool = False, above: str = "") -> Path:
    rows = [separator.join(f"{v:.12g}".replace(".", ",") if comma else f"{v:.12g}" for v in row) for row in np.array(columns).T]
    file.write_text(above + separator.join(heads) + "\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return file


def columns(form: str, unit: str, value=FRF.value):
    heads, found = [], []
    for (r, q), h in zip(PAIRS, value.reshape(len(PAIRS), -1), strict=True):
        parts = {
            "real": lambda h: [("real", h.real), ("imag", h.imag)],
            "phase": lambda h: [("mag", np.abs(h)), ("phase [deg]", np.degrees(np.angle(h)))],
            "decibel": lambda h: [("dB", 20 * np.log10(np.abs(h))), ("phase [rad]", np.angle(h))],
        }[form](h)
        for name, v in parts:
            heads.append(f"H({r},{q}) {name}" + ("" if "[" in name else f" [{unit}]"))
            found.append(v)
    return heads, found


DIRECTIONS = {1: 3, 3: -1, 6: 3}
"""Of the points, in UFF's count."""


def set_58(x: np.ndarray, y: np.ndarray, response: tuple[int, int], reference: tuple[int, int], function: int = 4, kinds=(18, 11, 13), labels=("Hz", "m/s", "N"), names=("NONE", "NONE"), word="NONE") -> str:
    """An ASCII set 58 in even steps and double precision; ends as (node, direction), `kinds` and
    `labels` of abscissa, numerator and denominator."""
    head = "title\nNONE\n17-Oct-17 13:50:13\nNONE\nNONE\n" + f"{function:5d}{0:10d}{0:5d}{0:10d}"
    head += "".join(f" {name:10}{node:10d}{direction:4d}" for name, (node, direction) in zip(names, (response, reference), strict=True)) + "\n"
    head += f"{6 if np.iscomplexobj(y) else 4:10d}{len(x):10d}{1:10d}{x[0]:13.5E}{x[1] - x[0]:13.5E}{0:13.5E}\n"
    head += "".join(f"{k:10d}{0:5d}{0:5d}{0:5d} {w:20} {u:20}\n" for k, u, w in zip((*kinds, 0), (*labels, "NONE"), ("NONE", word, "NONE", "NONE"), strict=True))
    cells = np.column_stack([y.real, y.imag]).ravel() if np.iscomplexobj(y) else y
    body = "".join("".join(f"{v:20.12E}" for v in cells[k : k + 4]) + "\n" for k in range(0, len(cells), 4))
    return f"    -1\n    58\n{head}{body}    -1\n"


def set_164(length: float, force: float) -> str:
    """Units of a file: what is divided by for SI."""
    numbers = "".join(f"{v:25.17E}" for v in (length, force, 1.0)) + f"\n{273.15:25.17E}"
    return f"    -1\n   164\n{9:10d}{'own':<20}{2:10d}\n{numbers.replace('E', 'D')}\n    -1\n"
