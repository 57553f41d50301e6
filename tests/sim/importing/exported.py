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
