"""Campaigns of tests, measured or virtual: a folder with `campaign.toml` and, a test, a UFF file of FRFs, rows of modes, or runout.

`read_campaign` refuses what cannot be used, `write_campaign` writes a folder whole or not at all, in the same form. Units are in
the keys of the file and SI in the dataclasses; temperatures are C, angular speeds rad/s, natural frequencies Hz.
"""

from __future__ import annotations

import dataclasses
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from thermospindle.model.drawing.measuring import Point
from thermospindle.model.errors import BadInput, listed
from thermospindle.model.files.formats import CAMPAIGN, CURRENT, KEY
from thermospindle.model.files.whole import whole
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.scene.fields import named, read_file
from thermospindle.model.units import MINUTE, MM, RPM
from thermospindle.sim.campaign.form import checked, in_unit, toml
from thermospindle.sim.campaign.modes import ModeRow, read_modes, with_shapes, write_modes, write_shapes
from thermospindle.sim.campaign.runout_record import RunoutRecord, read_runout, same, write_runout
from thermospindle.sim.campaign.uff import LARGEST, read_frf, write_frf
from thermospindle.sim.identification.frf import LIMITS, Frf, Limits, check_frf, record_length


@dataclass(frozen=True)
class Noise:
    """What the makers of a campaign state: standard deviation of an FRF line, relative to its value and to the largest value
    of its reference."""

    of_value: float
    of_largest: float


@dataclass(frozen=True)
class Test:
    """One test in one operating condition: of modes, of runout, or both."""

    __test__ = False  # not one of pytest's

    id: str
    temperature: float  # C
    speed: float  # rad/s, positive about +z
    level: float | None = None  # N, peak force of the hammer
    soak_time: float | None = None  # s
    repeat: int = 1  # which repetition of the same condition
    conditions: Mapping[str, Any] = field(default_factory=dict)  # anything else that was noted, as in the file
    frf: Frf | None = None
    modes: tuple[ModeRow, ...] = ()
    window_decay: float = 0.0  # 1/s, damping that an exponential window exp(-decay t) has left in the FRFs
    runout: RunoutRecord | None = field(default=None, compare=False)
    pretrigger: float | None = None  # s from the start of a record to the middle of the hit, where it is told

    @property
    def shape_nodes(self) -> tuple[int, ...]:
        """Where its table of modes tells shapes."""
        return tuple(at.node for at in self.modes[0].shape) if self.modes else ()

    @property
    def response_nodes(self) -> tuple[int, ...]:
        """Where its sensors stood: of its FRFs, or where its table of modes tells shapes."""
        return self.shape_nodes if self.frf is None else self.frf.response_nodes

    def __repr__(self) -> str:
        told = [f"{self.temperature:g} C", f"{self.speed / RPM:.6g} rpm"] + [repr(self.frf)] * (self.frf is not None) + [f"{len(self.modes)} modes"] * bool(self.modes)
        return f"<{type(self).__name__} {self.id}: {', '.join(told + ['runout'] * (self.runout is not None))}>"


@dataclass(frozen=True)
class Campaign:
    title: str
    spindle: str  # name of the scene
    quantity: str  # receptance, mobility or accelerance; displacement where there is runout alone
    points: tuple[Point, ...]
    tests: tuple[Test, ...]
    noise: Noise | None = None
    note: str = ""
    lumped_shafts: bool = False  # of this program's virtual tests, whose flexible shafts have their masses at nodes
    folder: Path | None = field(default=None, compare=False)

    @property
    def sensors(self) -> tuple[int, ...]:
        """Nodes of the responses of all tests, in the order in which tests first have them."""
        return tuple(dict.fromkeys(n for t in self.tests for n in t.response_nodes))

    @property
    def hammers(self) -> tuple[int, ...]:
        """Nodes of the hammer points of all tests, likewise."""
        return tuple(dict.fromkeys(n for t in self.tests if t.frf is not None for n in t.frf.reference_nodes))

    @property
    def name(self) -> str:
        """What its folder is called, or its title without one."""
        return self.folder.resolve().name if self.folder else self.title

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.title!r} of {self.spindle}: {len(self.tests)} tests, {len(self.points)} points, {self.quantity}>"


# ---------------------------------------------------------------- reading


def condition_of(test: Test) -> Condition:
    """A test's condition: of no stated level the light tap, of no stated time in the chamber long enough."""
    return Condition(test.temperature, test.speed, test.level or 0.0, np.inf if test.soak_time is None else test.soak_time)


def read_campaign(folder: Path, limits: Limits = LIMITS) -> Campaign:
    """The campaign of a folder, or of its campaign.toml. Raises `BadInput`, one sentence naming
    file, key or set, value and what is allowed."""
    folder = Path(folder)
    folder = folder.parent if folder.name == "campaign.toml" else folder
    file = folder / "campaign.toml"
    if not file.is_file():
        within = sorted(p.parent.name for p in folder.glob("*/campaign.toml")) if folder.is_dir() else []
        meant = f"; within it {'is' if len(within) == 1 else 'are'} {listed(within[:5])}" if within else ""
        raise BadInput(f"{folder}: no campaign there; expected a folder with campaign.toml{meant}")
    raw = read_file(CAMPAIGN, file)
    table = checked(file, raw)
    points = tuple(p.point() for p in table.points)

    def there(key: str, name: str) -> Path:
        return named(file, key, name, "file", "campaign")

    rows = read_modes(there("modes", table.modes), [t.id for t in table.tests]) if table.modes else []
    if table.shapes:
        rows = with_shapes(there("shapes", table.shapes), rows, [p.node for p in points])
    tests = []
    for t in table.tests:
        speed, soak = t.speed_rpm * RPM, None if t.soak_time_min is None else t.soak_time_min * MINUTE
        frf = read_frf(there(f"tests.{t.id}.frf", t.frf), table.quantity, points) if t.frf else None
        modes = tuple(row for row in rows if row.test == t.id)
        if frf is None and not modes and not t.runout:
            raise BadInput(f"{file}: tests.{t.id}: has neither frf nor rows in a table of modes nor runout; one of them is needed")
        runout = read_runout(there(f"tests.{t.id}.runout", t.runout), points, speed, t.spectrum_window) if t.runout else None
        if frf is not None:
            _check_size(folder / str(t.frf), frf)
            check_frf(folder / str(t.frf), frf, speed, limits)
            if t.pretrigger_s is not None and t.pretrigger_s >= (record := record_length(frf)):
                raise BadInput(f"{file}: tests.{t.id}.pretrigger_s = {t.pretrigger_s:g}: must be less than the record of lines {1 / record:g} Hz apart, {record:g} s")
        tests.append(
            Test(t.id, t.temperature_C, speed, t.hammer_level_N, soak, t.repeat, t.conditions, frf, modes, t.window_decay_1_per_s, runout, t.pretrigger_s)
        )
    noise = Noise(table.noise.of_value, table.noise.of_largest) if table.noise else None
    return Campaign(table.title, table.spindle, table.quantity, points, tuple(tests), noise, table.note, table.lumped_shafts, folder)


def _check_size(file: Path, frf: Frf) -> None:
    """Refuse values whose squares would overflow: a NaN passes every check of physics that asks whether a share is above its limit."""
    for array in (frf.value, frf.sd):
        if array is not None and not np.abs(array).max() <= LARGEST:
            raise BadInput(f"{file}: holds {np.abs(array).max():.3g}: no structure answers so; the file is damaged")


# ---------------------------------------------------------------- writing


def on_parts(spindle: Spindle, points: Sequence[Point]) -> tuple[Point, ...]:
    """The points as a campaign is written with them: on bodies and shafts by name, whatever nodes
    the mesh of a shaft has (`beside.on_nodes` finds them again)."""
    return tuple(dataclasses.replace(p, body=spindle.structure.carrier(p.body)) for p in points)


def write_campaign(campaign: Campaign, folder: Path, replace: bool = False) -> None:
    """Write the folder of a campaign, whole or not at all: beside its place first, then moved there.

    Each test's FRFs go to `<id>.uff`, its runout to `<id>_runout.csv`, all modes to `modes.csv`,
    their shapes to `shapes.csv`. Raises `BadInput` for what `read_campaign` would refuse, and for a
    folder that is not empty, unless `replace` is set and it holds a campaign, which is then lost.
    """
    folder = Path(folder).absolute()
    occupied = folder.exists() and (not folder.is_dir() or any(folder.iterdir()))
    if occupied and not (replace and (folder / "campaign.toml").is_file()):
        raise BadInput(f"{folder}: is not empty; a campaign is written to a new or empty folder, or may replace a campaign if told so")
    text = _toml_text(campaign)
    checked(folder / "campaign.toml", tomllib.loads(text))
    folder.parent.mkdir(parents=True, exist_ok=True)
    with whole(folder) as partial:
        _write_files(campaign, partial, text)


def _write_files(campaign: Campaign, folder: Path, text: str) -> None:
    """Make the folder of a campaign, `text` its campaign.toml, and read it back: what would not come back the same is refused."""
    folder.mkdir()
    (folder / "campaign.toml").write_text(text, encoding="utf-8")
    rows = [row for test in campaign.tests for row in test.modes]
    if rows:
        write_modes(folder / "modes.csv", rows)
    if any(row.shape for row in rows):
        write_shapes(folder / "shapes.csv", rows)
    for test in campaign.tests:
        if test.frf is not None:
            if test.frf.quantity != campaign.quantity:
                raise BadInput(f"{folder}: tests.{test.id}: FRFs of {test.frf.quantity} in a campaign of {campaign.quantity}")
            write_frf(folder / f"{test.id}.uff", test.frf, campaign.points, campaign.title, test.id)
        if test.runout is not None:
            write_runout(folder / f"{test.id}_runout.csv", test.runout)
    again = read_campaign(folder)
    if not all(same(a.runout, b.runout) for a, b in zip(again.tests, campaign.tests, strict=True)):
        raise BadInput(f"{folder}: a runout record would not read back; it needs finite numbers at even steps")
    if _exact(again) != _exact(campaign):
        raise BadInput(
            f"{folder}: would not read back bit for bit; FRFs must be complex128 and float64, modes those of their test, "
            "directions along an axis"
        )


def _exact(campaign: Campaign) -> list[tuple[Any, ...]]:
    """What must read back bit for bit; speed, soak time and positions may have no exact number in the file's units."""
    points = [(p.node, p.name, p.body, p.direction) for p in campaign.points]
    return points + [(t.id, t.temperature, t.level, t.repeat, t.window_decay, t.pretrigger, t.conditions, t.frf, t.modes) for t in campaign.tests]


def _toml_text(campaign: Campaign) -> str:
    modes = "modes.csv" if any(t.modes for t in campaign.tests) else None
    head = {
        KEY: CURRENT[CAMPAIGN],
        "title": campaign.title,
        "spindle": campaign.spindle,
        "quantity": campaign.quantity,
        "note": campaign.note,
        "lumped_shafts": campaign.lumped_shafts or None,
        "modes": modes,
        "shapes": "shapes.csv" if any(t.shape_nodes for t in campaign.tests) else None,
    }
    noise = [] if campaign.noise is None else [("[noise]", asdict(campaign.noise))]
    points = [
        {
            "node": p.node,
            "name": p.name,
            "body": p.body,
            "position_mm": [in_unit(x, MM) for x in p.position],
            "direction": p.axis,
            **({"sensor_mass_g": in_unit(p.mass, 1e-3)} if p.mass else {}),
        }
        for p in campaign.points
    ]
    tests = [
        {
            "id": t.id,
            "temperature_C": t.temperature,
            "speed_rpm": in_unit(t.speed, RPM),
            "frf": None if t.frf is None else f"{t.id}.uff",
            "runout": None if t.runout is None else f"{t.id}_runout.csv",
            "spectrum_window": t.runout.window if t.runout is not None and t.runout.kind == "spectrum" else None,
            "hammer_level_N": t.level,
            "soak_time_min": None if t.soak_time is None else in_unit(t.soak_time, MINUTE),
            "repeat": t.repeat,
            "window_decay_1_per_s": t.window_decay or None,
            "pretrigger_s": t.pretrigger,
            "conditions": t.conditions or None,
        }
        for t in campaign.tests
    ]
    tables = [("", head), *noise, *(("[[points]]", p) for p in points), *(("[[tests]]", t) for t in tests)]
    lines = [[name, *(f"{k} = {toml(v)}" for k, v in table.items() if v not in (None, ""))] for name, table in tables]
    return "\n\n".join("\n".join(block).strip() for block in lines) + "\n"
