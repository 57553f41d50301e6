"""Reads the log of a resonance map back: the grid, its natural frequencies, and the coincidences."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from model.ball_row import Array
from model.scene import BadInput
from sim.log_read import APPLICATION, Opened, component_array, component_list, component_rows

RPM = 2 * np.pi / 60
ABOUT = "/__properties/map"


@dataclass(frozen=True, eq=False)
class MapContents:
    """What a log of a map holds: grid, `modes` (T, modes, S) in Hz, coincidences as rows by name."""

    path: Path
    recording: str
    blueprint: bool
    scene: str
    title: str
    temperatures: Array  # C
    speeds: Array  # rad/s
    modes: Array
    coincidences: tuple[Mapping[str, Any], ...]
    entities: Mapping[str, int]
    timelines: tuple[str, ...]


def is_map(log: Opened) -> bool:
    """Whether a log is that of a resonance map."""
    return ABOUT in log.columns


def map_contents(log: Opened) -> MapContents:
    """What is in the log of a map. BadInput, one sentence that names the file, where something is missing."""
    try:
        about, numbers = log.columns[ABOUT], log.columns["/numbers/modes"]
        speeds = component_array(log.columns["/numbers/speeds"], "speed_rad_per_s").to_numpy()
        temperatures = component_array(numbers, "temperature_C").to_numpy()
        rising = np.argsort(temperatures)
        return MapContents(
            path=log.path,
            recording=log.recording,
            blueprint=log.blueprint,
            scene=component_list(about, "scene")[0],
            title=component_list(about, "title")[0],
            temperatures=temperatures[rising],
            speeds=speeds,
            modes=component_array(numbers, "frequency_Hz").to_numpy().reshape(len(temperatures), -1, len(speeds))[rising],
            coincidences=component_rows(log.columns.get("/numbers/coincidences", {})),
            entities=log.rows,
            timelines=log.timelines,
        )
    except (KeyError, IndexError, ValueError) as error:
        raise BadInput(f"{log.path}: is not a whole log of {APPLICATION}: {error} is missing") from None


def map_contents_json(contents: MapContents) -> dict[str, Any]:
    return {
        "scene": contents.scene,
        "entities": list(contents.entities),
        "grid": {"temperature_C": contents.temperatures.tolist(), "speed_rpm": (contents.speeds / RPM).tolist()},
        "modes_Hz": [[[float(f) if np.isfinite(f) else None for f in row] for row in modes] for modes in contents.modes],
        "coincidences": list(contents.coincidences),
    }


def describe_map(contents: MapContents) -> str:
    """What a log holds, for the terminal."""
    count, modes, speeds = contents.modes.shape
    lines = [
        f"{contents.path}: {contents.title}",
        f"  scene {contents.scene}, recording {contents.recording}, {'with' if contents.blueprint else 'without'} a blueprint",
        f"  resonance map: {modes} modes at {count} temperatures x {speeds} speeds, {len(contents.coincidences)} coincidences",
        f"  timelines: {', '.join(contents.timelines)}",
    ]
    for c in contents.coincidences[:10]:
        lines.append(
            f"  {c['line']} with mode {c['mode']} at {c['temperature_C']:.1f} C, {c['speed_rpm']:.0f} rpm, {c['frequency_Hz']:.1f} Hz"
        )
    return "\n".join(lines)
