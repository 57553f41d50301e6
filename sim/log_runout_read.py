"""Reads the log of a turning spindle back: the record, what is quoted of it, its lines, and the waterfall."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from model.ball_row import Array
from model.scene import BadInput
from sim.log_read import APPLICATION, Columns, Opened, component_array, component_list, component_rows
from sim.waterfall import LineSpectrum

ABOUT = "/__properties/runout"
SIGNALS, QUOTED, LINES, WATERFALL = "/signals", "/numbers/quoted", "/numbers/lines", "/numbers/waterfall"


@dataclass(frozen=True, eq=False)
class RunoutContents:
    """What a log holds. `repeatable`, `nonrepeatable` (3, n) nm of the hub's probes x, y and axial; `quoted` (m) by probe and value;
    `lines` in the order of their strength; `spectra` over speed."""

    path: Path
    recording: str
    blueprint: bool
    scene: str
    title: str
    temperature: float  # C
    speed: float  # rad/s
    revolutions: int
    repeatable: Array
    nonrepeatable: Array
    quoted: Mapping[str, Mapping[str, float]]
    lines: tuple[Mapping[str, Any], ...]
    spectra: tuple[LineSpectrum, ...]
    entities: Mapping[str, int]
    timelines: tuple[str, ...]


def is_runout(log: Opened) -> bool:
    """Whether a log is that of a turning spindle."""
    return ABOUT in log.columns


def runout_contents(log: Opened) -> RunoutContents:
    """What is in the log of a turning spindle. BadInput, one sentence that names the file, where something is missing."""
    try:
        about = log.columns[ABOUT]
        [values] = [name for name in log.columns[SIGNALS] if name.endswith("scalars")]
        signals = component_array(log.columns[SIGNALS], values).to_numpy().reshape(-1, 6).T
        quoted = {name: component_list(log.columns[QUOTED], name) for name in log.columns[QUOTED] if not name.startswith("rerun")}
        return RunoutContents(
            path=log.path,
            recording=log.recording,
            blueprint=log.blueprint,
            scene=component_list(about, "scene")[0],
            title=component_list(about, "title")[0],
            temperature=component_list(about, "temperature_C")[0],
            speed=component_list(about, "speed_rad_per_s")[0],
            revolutions=component_list(about, "revolutions")[0],
            repeatable=signals[:3],
            nonrepeatable=signals[3:],
            quoted={
                probe: {name: column[i] for name, column in quoted.items() if name != "probe"} for i, probe in enumerate(quoted["probe"])
            },
            lines=component_rows(log.columns.get(LINES, {})),
            spectra=_spectra(log.columns.get(WATERFALL, {})),
            entities=log.rows,
            timelines=log.timelines,
        )
    except (KeyError, IndexError, ValueError) as error:
        raise BadInput(f"{log.path}: is not a whole log of {APPLICATION}: {error} is missing") from None


def _spectra(columns: Columns) -> tuple[LineSpectrum, ...]:
    """Every speed is a row of lists."""
    if not columns:
        return ()
    names = ("speed_rad_per_s", "frequency", "radial", "axial", "natural")
    rows = zip(*([np.array(row) for chunk in columns[name] for row in chunk.to_pylist()] for name in names), strict=True)
    return tuple(LineSpectrum(float(speed[0]), *others) for speed, *others in rows)


def runout_contents_json(contents: RunoutContents) -> dict[str, Any]:
    """What a log holds, the record as lists in nm."""
    return {
        "scene": contents.scene,
        "temperature_C": contents.temperature,
        "speed_rpm": contents.speed * 30 / np.pi,
        "revolutions": contents.revolutions,
        "entities": list(contents.entities),
        "quoted_m": contents.quoted,
        "lines": list(contents.lines),
        "repeatable_nm": contents.repeatable.tolist(),
        "nonrepeatable_nm": contents.nonrepeatable.tolist(),
        "waterfall": [
            {
                "speed_rpm": s.speed * 30 / np.pi,
                "frequency_Hz": s.frequency.tolist(),
                "radial_m": s.radial.tolist(),
                "axial_m": s.axial.tolist(),
            }
            for s in contents.spectra
        ],
    }


def describe_runout(contents: RunoutContents) -> str:
    """What a log holds, for the terminal."""
    lines = [
        f"{contents.path}: {contents.title}",
        f"  scene {contents.scene}, recording {contents.recording}, {'with' if contents.blueprint else 'without'} a blueprint",
        f"  turning at {contents.speed * 30 / np.pi:.6g} rpm, {contents.temperature:g} C, {contents.revolutions} revolutions, "
        f"{contents.repeatable.shape[1]} samples of 3 probes",
        f"  timelines: {', '.join(contents.timelines)}",
    ]
    for probe, own in contents.quoted.items():
        lines.append(f"  {probe}: RRO {1e9 * own['repeatable']:.1f} nm, NRRO {1e9 * own['nonrepeatable']:.1f} nm peak to valley")
    for g in contents.lines[:10]:
        cause = f"{g['name']} {g['bearing']} {g['cause']}".replace("  ", " ").strip()
        lines.append(f"  line {g['frequency']:.2f} Hz, {g['direction']}, {1e9 * g['amplitude']:.2f} nm: {cause}")
    if contents.spectra:
        rpm = [s.speed * 30 / np.pi for s in contents.spectra]
        lines.append(f"  waterfall of {len(rpm)} speeds from {rpm[0]:.0f} to {rpm[-1]:.0f} rpm")
    return "\n".join(lines)
