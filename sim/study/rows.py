"""What one case of a study gives: a row for each condition, with modes, bearings and contact, in columns that are known beforehand."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from thermospindle.model.built.tolerance import toleranced
from thermospindle.model.errors import BadInput, NoEquilibrium, NotConverged, OutsideRange
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.rotor.modes import Mode
from thermospindle.model.rotor.static import displacement
from thermospindle.model.units import RPM, TO_UM, in_rpm
from thermospindle.sim.effects.effect import Effect
from thermospindle.sim.identification.pairing import follow
from thermospindle.sim.operating import OperatingPoint, operating_point, unloads
from thermospindle.sim.running.probes import AXIAL, X, Y, hub_probes, probe_rows
from thermospindle.sim.running.steady import steady_runout
from thermospindle.sim.study.draws import count, draw, imperfection_columns, known_of
from thermospindle.sim.study.form import MONTE_CARLO, MOST, Study
from thermospindle.sim.study.variants import combination, variant

BEYOND = 1.5  # of the band, up to which partners of the scene's own modes are looked for
NAMED = (BadInput, OutsideRange, NoEquilibrium, NotConverged)
"""What is a result of a case rather than the end of the study: the sentence stands in its row."""
OF_ROW = {"preload_N": "preload", "contact_angle_deg": "contact_angle", "deformation_um": "deformation"}
OF_BEARING = {"radial_stiffness_N_per_m": "radial_stiffness", "axial_stiffness_N_per_m": "axial_stiffness"}
OF_RUNOUT = ("rro_um", "nrro_six_sigma_um")  # peak to valley, and six standard deviations
NONREPEATABLE = OF_RUNOUT[1]
STIFFNESS = "stiffness_N_per_um"
UNITS = {"contact_angle_deg": np.degrees(1.0), "deformation_um": 1e6}
MODES = {"frequency_Hz": pa.float64(), "damping_ratio": pa.float64(), "kind": pa.string(), "whirl": pa.string(), "mode": pa.int64()}

Row = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Cases:
    """The cases of a sweep or a Monte Carlo study: `rows(k)` of case k; `schema` of all rows.

    `own` holds the modes of the scene as it stands by condition: a mode of a case has the `mode` number of its partner by shape there, 0
    where it has none. With `stiffness` rows tell that of the hub too.
    """

    study: Study
    raw: Mapping[str, Any]
    file: Path
    spindle: Spindle
    catalogue: tuple[Effect, ...]
    own: Mapping[Condition, tuple[OperatingPoint, list[Mode]]]
    stiffness: bool = False

    @property
    def conditions(self) -> tuple[Condition, ...]:
        return tuple(self.own)

    @property
    def count(self) -> int:
        """Draws, or combinations of keys at a condition each."""
        return count(self.study, self.spindle) if self.study.kind == MONTE_CARLO else self.study.combinations() * len(self.own)

    @property
    def highest(self) -> float:
        """Hz up to which modes are told."""
        return self.study.highest or self.spindle.hammer.band[1]

    def rows(self, case: int) -> list[Row]:
        """The rows of a case, a condition each; what has no answer says why in `error`."""
        if self.study.kind == MONTE_CARLO:
            return self._drawn(case)
        index, at = divmod(case, len(self.own))
        chosen, condition = combination(self.study.vary, index), self.conditions[at]
        known: Row = {"case": case, **{f"vary.{key}": _cell(value) for key, value in chosen.items()}}
        try:
            spindle = _variant(self, index)
        except NAMED as error:
            return [self._empty(known, condition, error)]
        return [self.row(known, spindle, condition)[0]]

    def _drawn(self, case: int) -> list[Row]:
        parameters, own = toleranced(self.spindle), draw(self.study, self.spindle, case)
        known: Row = {"case": case, **known_of(self.spindle, own)} | ({"draw": own.k, "taken": own.taken} if self.study.sobol else {})
        spindle = self.spindle if own.imperfections is None else replace(self.spindle, imperfections=own.imperfections)
        try:
            for p, x in zip(parameters, own.deviations, strict=True):
                spindle = p.apply(spindle, float(x))
        except (ValueError, *NAMED) as error:
            return [self._empty(known, c, error) for c in self.conditions]
        found = [self.row(known, spindle, c) for c in self.conditions]
        points = {c: p for c, (_, p) in zip(self.conditions, found, strict=True) if p is not None}
        try:
            lost: Row = {f"unloads_C.{b.name}": _unloads(spindle, points, b.name) for b in self.spindle.bearings}
        except NAMED as error:
            lost = {"error": f"where it unloads: {' '.join(str(error).split())}"}
        return [row | lost for row, _ in found]

    def row(self, known: Row, spindle: Spindle, condition: Condition) -> tuple[Row, OperatingPoint | None]:
        """What is known of a spindle and what comes out at a condition, with the state there; the error where there is none."""
        try:
            point = operating_point(spindle, condition)
            modes = point.modes_below(BEYOND * self.highest)
            values = [
                *(value for mode in modes for value in (mode.frequency, mode.damping_ratio)),
                *(value for b in point.state.all_bearings for value in b.stiffness.ravel()),
            ]
            if not np.all(np.isfinite(values)):
                raise NotConverged("a frequency, damping ratio or stiffness is no finite number")
            seen = steady_runout(point) if self.study.runout and condition.speed else {}
        except NAMED as error:
            return self._empty(known, condition, error), None
        number = self._numbers(condition, point, modes)
        kept = [i for i, m in enumerate(modes) if m.frequency < self.highest or number[i]]
        row = known | _told(condition) | {"status": point.state.status if point.state.bearings else None, "error": None}
        names = {b.name for b in self.spindle.bearings}
        for bearing in point.state.all_bearings:
            told = {**OF_ROW, **OF_BEARING} if bearing.name in names else OF_BEARING
            row |= {f"{key}.{bearing.name}": float(getattr(bearing, name)) * UNITS.get(key, 1.0) for key, name in told.items()}
        row |= {f"rro_um.{_plain(probe)}": TO_UM * r.repeatable for probe, r in seen.items()}
        row |= {f"{NONREPEATABLE}.{_plain(probe)}": TO_UM * r.six_sigma for probe, r in seen.items() if NONREPEATABLE in of_runout(spindle)}
        row |= _stiffness(point) if self.stiffness else {}
        row |= {f"in_contact.{b.name}": bool(b.in_contact) for b in point.state.bearings}
        row |= {"frequency_Hz": [modes[i].frequency for i in kept], "damping_ratio": [modes[i].damping_ratio for i in kept]}
        row |= {"kind": [modes[i].kind for i in kept], "whirl": [modes[i].whirl for i in kept], "mode": [number[i] for i in kept]}
        return row, point

    def _numbers(self, condition: Condition, point: OperatingPoint, modes: Sequence[Mode]) -> list[int]:
        base, own = self.own[condition]
        found = [0] * len(modes)
        if base.linear.dofs == point.linear.dofs:
            for k, i in enumerate(follow(base.linear.mass, own, modes)):
                if i >= 0:
                    found[i] = k + 1
        return found

    def _empty(self, known: Row, condition: Condition, error: Exception) -> Row:
        return known | _told(condition) | {"error": " ".join(str(error).split())}

    def schema(self) -> pa.Schema:
        """Columns of the rows, in order."""
        fields: dict[str, pa.DataType] = {"case": pa.int64()}
        for key, values in self.study.vary:
            numbers = all(isinstance(_cell(v), float) for v in values)
            fields[f"vary.{key}"] = pa.float64() if numbers else pa.string()
        if self.study.kind == MONTE_CARLO:
            fields |= {f"deviation.{p.name}": pa.float64() for p in toleranced(self.spindle)}
            if self.study.sobol:
                fields |= {"draw": pa.int64(), "taken": pa.string()}
            if self.study.grade is not None:
                fields |= {name: pa.float64() for name in imperfection_columns(self.spindle)}
        fields |= {"temperature_C": pa.float64(), "speed_rpm": pa.float64(), "status": pa.string(), "error": pa.string()}
        for b in self.spindle.bearings:
            fields |= {f"{key}.{b.name}": pa.float64() for key in OF_ROW} | {f"in_contact.{b.name}": pa.bool_()}
            if self.study.kind == MONTE_CARLO:
                fields[f"unloads_C.{b.name}"] = pa.float64()
        for name in (b.name for b in self.spindle.all_bearings):
            fields |= {f"{key}.{name}": pa.float64() for key in OF_BEARING}
        if self.study.runout:
            fields |= {f"{key}.{_plain(probe)}": pa.float64() for key in of_runout(self.spindle) for probe in (X, Y, AXIAL)}
        return pa.schema(fields | {name: pa.list_(kind) for name, kind in MODES.items()})


def cases(study: Study, raw: Mapping[str, Any], file: Path, spindle: Spindle, catalogue: tuple[Effect, ...]) -> Cases:
    """The cases of a study of a scene; raises the named errors where the scene as it stands has no state at one of its conditions."""
    temperatures = study.temperatures or spindle.temperatures
    own = {}
    for t in temperatures:
        for rpm in study.speeds:
            point = operating_point(spindle, condition := Condition(t, rpm * RPM))
            own[condition] = point, point.modes_below(study.highest or spindle.hammer.band[1])
    found = Cases(study, raw, file, spindle, catalogue, own)
    if found.count > MOST:
        key = f"draws = {study.draws}{': with sobol = true that is' if study.sobol else ':'}" if study.kind == MONTE_CARLO else "vary:"
        raise BadInput(f"{study.file}: {key} {found.count} cases; at most {MOST} are allowed")
    return found


def of_runout(spindle: Spindle) -> tuple[str, ...]:
    """What of `OF_RUNOUT` is known: of bearings given by numbers, which roll no balls, what does not repeat is not 0 but unknown."""
    return OF_RUNOUT if spindle.rolling else tuple(key for key in OF_RUNOUT if key != NONREPEATABLE)


def _plain(probe: str) -> str:
    """A probe's name as part of a column's."""
    return probe.removeprefix("hub ")


def _stiffness(point: OperatingPoint) -> Row:
    """Static stiffness (N/um) by probe of the hub, of a force where and along which it looks; None
    where nothing holds it or it cannot move."""
    probes, found = hub_probes(point.spindle), {}
    for probe, row in zip(probes, probe_rows(point, probes), strict=True):
        moved = displacement(point.linear.stiffness, row)
        compliance = 0.0 if moved is None else TO_UM * float(row @ moved)
        found[f"{STIFFNESS}.{_plain(probe.name)}"] = 1 / compliance if compliance > 0 else None
    return found


def _told(condition: Condition) -> Row:
    return {"temperature_C": condition.temperature, "speed_rpm": in_rpm(condition.speed)}


def _cell(value: Any) -> float | str:
    """A varied value as it stands in its column: numbers as they are, all else as JSON."""
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else json.dumps(value, default=str)


@lru_cache(maxsize=2)
def _variant(of: Cases, index: int) -> Spindle:
    """The spindle of a combination, kept for its other conditions."""
    return variant(of.raw, of.file, of.catalogue, combination(of.study.vary, index))


def _unloads(spindle: Spindle, points: Mapping[Condition, OperatingPoint], bearing: str) -> float | None:
    """Temperature (C) between those of a draw at its lowest speed at which a bearing loses contact, None where it does not."""
    slowest = min((abs(c.speed) for c in points), default=0.0)
    colder = [points[c] for c in sorted(points, key=lambda c: c.temperature) if abs(c.speed) == slowest]
    return unloads(spindle, colder, bearing) if colder else None
