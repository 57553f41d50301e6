"""The verbs that compute a spindle as functions of `import thermospindle as ts`: what `spindle
table`, `static`, `check`, `runout`, `warmup` and `map` do.

Arguments carry the units people write in their names; what comes back is SI, with the units at its fields, and `ts.answer` makes of a table, a
warm-up or a map what the command line tells with `--json`. What has no answer raises `NoEquilibrium`, and a law that does not reach `OutsideRange`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from thermospindle.arguments import number, of_kind, several, whole
from thermospindle.front import drawing_of
from thermospindle.model.built.drawn import drawn
from thermospindle.model.errors import BadInput, instead
from thermospindle.model.files.stiffness_table import STEPS, StiffnessTable
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.elements import ELEMENTS, check_element
from thermospindle.model.rotor.static import Static
from thermospindle.model.rotor.static import static as at_point
from thermospindle.model.units import MINUTE, RPM
from thermospindle.options import FASTEST, HOTTEST, MINUTES, MULTIPLES, SECONDS
from thermospindle.sim.operating import OperatingPoint, operating_point, stiffness_table

if TYPE_CHECKING:
    from thermospindle.sim.resonance.found import ResonanceMap
    from thermospindle.sim.running.runout import Runout
    from thermospindle.sim.warmup import Warmup

PATHS = ("simulated", "linear")


def table(spindle: Spindle | str | Path, temperatures_C: Sequence[float] | None = None, *, speeds_rpm: Sequence[float] = (0.0,)) -> StiffnessTable:
    """Bearing stiffness over temperature, by default over the scene's range, and speed:
    `.values["front1"]["radial_stiffness_N_per_m"]` is (temperatures, speeds), each once and rising (`.temperature` C, `.speed` rad/s)."""
    drawing = drawing_of(spindle)
    return stiffness_table(drawing, _temperatures(drawing, temperatures_C, STEPS), _speeds("speeds_rpm", speeds_rpm))


def static(point: OperatingPoint) -> dict[str, Static]:
    """By measuring point the answer to a unit force along its direction: `.stiffness` N/m, `.reactions` N by
    bearing, `.shares` of the compliance. By the bearings that are computed, in the spindle's own housing."""
    of_kind("point", point, (OperatingPoint,), "an operating point (ts.point)")
    return {p.name: at_point(point.spindle, point.chain, p) for p in point.spindle.points}


def check(spindle: Spindle | str | Path, effect_files: Sequence[str | Path] = ()) -> dict[str, Any]:
    """What the program understands of a scene, assumes, and finds odd, as `spindle check --json`: numbers with units in their keys.

    `effect_files` hold effects of your own, which are told to act or not as those of the catalogue are.
    """
    from thermospindle.report.check.odd import told
    from thermospindle.sim.effects.known import catalogue

    drawing = drawing_of(spindle)
    reference = operating_point(drawing, Condition(drawing.reference_temperature))
    known = catalogue([Path(f) for f in several("effect_files", effect_files, "paths of files")])
    return told(drawing, reference, known)


def runout(
    point: OperatingPoint,
    *,
    seconds: float | None = None,
    path: Literal["simulated", "linear"] | None = None,
    element: Literal["linear", "ball-by-ball"] = "linear",
    seed: int | None = None,
) -> Runout:
    """Runout of the turning spindle: `.values()` by probe, `.lines` with their causes, `.signals` m over time.

    By the scene's imperfections, or those that `seed` draws. `path` "simulated" steps MuJoCo, "linear" is the exact harmonic answer
    in seconds; without one it is simulated where a record can hold the steps. `seconds` are half a second or twelve turns by default.
    """
    from thermospindle.model.built.imperfections import Imperfections
    from thermospindle.sim.running.runout import runout as of_point

    of_kind("point", point, (OperatingPoint,), "an operating point (ts.point)")
    if seconds is not None:
        number("seconds", seconds, 0.0, SECONDS)
    if path is not None and path not in PATHS:
        raise BadInput(f"path = {path!r}: {instead(str(path), PATHS)}")
    if element not in ELEMENTS:
        raise BadInput(f"element = {element!r}: {instead(str(element), ELEMENTS)}")
    check_element(point.spindle, element)
    if seed is not None:
        whole("seed", seed, 0, 10**18 - 1)
        point = replace(point, spindle=replace(point.spindle, imperfections=drawn(point.spindle, seed)))
    elif point.imperfections == Imperfections():
        raise BadInput(f"point: {point.spindle.file or point.spindle.name} names no imperfections, so nothing runs out; seed = 1 draws plausible ones")
    return of_point(point, seconds, element, path)


def warmup(
    spindle: Spindle | str | Path,
    *,
    speed_rpm: float | None = None,
    temperature_C: float | None = None,
    air_C: float | None = None,
    minutes: float | None = None,
    progress: Callable[[str], None] = lambda done: None,
) -> Warmup:
    """From a uniform temperature (the reference by default) at a speed (the nominal one) in air of the same or another
    temperature to the steady state: `.times` s, `.moments`, `.frequencies` Hz, `.steady`. Preload and friction that
    drive each other up without end raise `NotSettled`; with `minutes` what happens until then is computed all the same."""
    from thermospindle.sim.warmup import warm_up

    drawing = drawing_of(spindle)
    speed = drawing.nominal_speed if speed_rpm is None else number("speed_rpm", speed_rpm, -FASTEST, FASTEST) * RPM
    start = drawing.reference_temperature if temperature_C is None else number("temperature_C", temperature_C, -273.15, HOTTEST)
    air = None if air_C is None else number("air_C", air_C, -273.15, HOTTEST)
    duration = None if minutes is None else MINUTE * number("minutes", minutes, 0.0, MINUTES)
    return warm_up(drawing, speed, start, air, duration, progress=progress)


def resonances(
    spindle: Spindle | str | Path,
    *,
    temperature_C: float | None = None,
    speed_rpm: float | None = None,
    temperatures_C: Sequence[float] | None = None,
    speeds_rpm: Sequence[float] | None = None,
    multiples: int = 3,
    progress: Callable[[str], None] = lambda done: None,
) -> ResonanceMap:
    """Natural frequencies against every bearing and unbalance line over temperature and speed,
    about a nominal condition: `.coincidences`, `.tracks`, `.lines`.

    By default the scene's range, and speeds up to twice the nominal one; lines up to so many `multiples` of the number of balls.
    """
    from thermospindle.sim.resonance.map import SPEEDS, TEMPERATURES, resonance_map, speeds_about

    drawing = drawing_of(spindle)
    whole("multiples", multiples, 1, MULTIPLES)
    speed = drawing.nominal_speed if speed_rpm is None else number("speed_rpm", speed_rpm, 0.0, FASTEST) * RPM
    temperature = drawing.reference_temperature if temperature_C is None else number("temperature_C", temperature_C, -273.15, HOTTEST)
    speeds = speeds_about(drawing, speed, SPEEDS) if speeds_rpm is None else _speeds("speeds_rpm", speeds_rpm)
    grid = _temperatures(drawing, temperatures_C, TEMPERATURES)
    return resonance_map(drawing, grid, speeds, Condition(temperature, speed), multiples, progress=progress, nearby=speeds_rpm is not None)


def _temperatures(spindle: Spindle, asked: Sequence[float] | None, steps: int) -> list[float]:
    if asked is None:
        return np.linspace(*spindle.temperatures, steps).tolist()
    return [number("temperatures_C", t, -273.15, HOTTEST) for t in _some("temperatures_C", asked)]


def _speeds(name: str, asked: Sequence[float]) -> list[float]:
    return [number(name, speed, -FASTEST, FASTEST) * RPM for speed in _some(name, asked)]


def _some(name: str, asked: Sequence[float]) -> Sequence[float]:
    if not len(found := several(name, asked.tolist() if isinstance(asked, np.ndarray) else asked, "numbers")):
        raise BadInput(f"{name} = []: must hold one number or more")
    return found
