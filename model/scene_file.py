"""The form of a scene file: every key with its unit, type and allowed range; `Scene.spindle` converts to SI definitions."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError, model_validator

from model import imperfections as i
from model import machine as m

MM, RPM = 1e-3, 2 * np.pi / 60

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, lt=1, allow_inf_nan=False)]
Name = Annotated[str, Field(min_length=1)]


def _rising(span: tuple[float, float]) -> tuple[float, float]:
    if not span[0] < span[1]:
        raise ValueError("the first number must be smaller than the second")
    return span


def _along_axis(text: str) -> str:
    if len(text) != 2 or text[0] not in "+-" or text[1] not in "XYZ":
        raise ValueError("must be one of +X -X +Y -Y +Z -Z")
    return text


Span = Annotated[tuple[Finite, Finite], AfterValidator(_rising)]
Radii = Annotated[tuple[NotNegative, Finite], AfterValidator(_rising)]


class Table(BaseModel):
    """A table of the file: unknown keys are refused; `origin`, `source` and `origins` say where its numbers come from."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    origin: Literal["printed", "assumed", "calibrated"] | None = None
    source: str = ""
    origins: dict[str, Literal["printed", "assumed", "calibrated"]] = {}


class LawTable(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    temperature_C: list[Finite] = Field(min_length=1)
    value: list[Positive] = Field(min_length=1)

    @model_validator(mode="after")
    def _one_value_a_temperature(self) -> LawTable:
        if len(self.temperature_C) != len(self.value) or np.any(np.diff(self.temperature_C) <= 0):
            raise ValueError("temperature_C must rise and have as many entries as value")
        return self

    def law(self, unit: float) -> m.Law:
        return m.Law(tuple(self.temperature_C), tuple(unit * v for v in self.value))


def _constant(value: Any) -> Any:
    return value if isinstance(value, dict | LawTable) else {"temperature_C": [0.0], "value": [value]}


LawValue = Annotated[LawTable, BeforeValidator(_constant)]
"""A number, or a table of `temperature_C` and `value`."""


class Material(Table):
    youngs_modulus_GPa: LawValue
    poisson_ratio: Annotated[float, Field(gt=-1, lt=0.5)]
    thermal_expansion_um_per_m_K: LawValue
    density_kg_per_m3: Positive
    conductivity_W_per_m_K: Positive
    heat_capacity_J_per_kg_K: Positive

    def material(self, name: str) -> m.Material:
        return m.Material(
            name,
            self.youngs_modulus_GPa.law(1e9),
            self.poisson_ratio,
            self.thermal_expansion_um_per_m_K.law(1e-6),
            self.density_kg_per_m3,
            self.conductivity_W_per_m_K,
            self.heat_capacity_J_per_kg_K,
        )


class Region(Table):
    name: Name
    part: Literal["stationary", "rotating"]
    material: str
    r_mm: Radii
    z_mm: Span

    def region(self) -> m.Region:
        r, z = ((span[0] * MM, span[1] * MM) for span in (self.r_mm, self.z_mm))
        return m.Region(self.name, self.part, self.material, r, z)


class Section(Table):
    regions: list[Region] = Field(min_length=2)


class BallRow(Table):
    balls: Annotated[int, Field(ge=3)]
    ball_diameter_mm: Positive
    pitch_diameter_mm: Positive
    contact_angle_deg: Annotated[float, Field(gt=0, lt=90)]
    inner_conformity: Annotated[float, Field(gt=0.5, lt=1)]
    outer_conformity: Annotated[float, Field(gt=0.5, lt=1)]
    diametral_clearance_mm: Span
    ball_material: str
    ring_material: str
    damping_ratio: Share

    @model_validator(mode="after")
    def _balls_fit(self) -> BallRow:
        if self.balls * self.ball_diameter_mm > np.pi * self.pitch_diameter_mm:
            raise ValueError(
                "that many balls do not fit on the pitch circle; balls * ball_diameter_mm must be below pi * pitch_diameter_mm"
            )
        return self


class Bearing(Table):
    row: str
    z_mm: Finite
    inner_ring: str
    outer_ring: str

    def bearing(self, name: str, rows: dict[str, BallRow]) -> m.Bearing:
        row = rows[self.row]
        low, high = row.diametral_clearance_mm
        return m.Bearing(
            name,
            self.z_mm * MM,
            self.inner_ring,
            self.outer_ring,
            row.balls,
            row.ball_diameter_mm * MM,
            row.pitch_diameter_mm * MM,
            float(np.radians(row.contact_angle_deg)),
            row.inner_conformity,
            row.outer_conformity,
            (low * MM, high * MM),
            row.ball_material,
            row.ring_material,
            row.damping_ratio,
        )


Arrangement = Literal["back-to-back", "face-to-face", "tandem"]


class BearingPair(Table):
    arrangement: Arrangement
    preload_N: Positive
    preload_kind: Literal["rigid", "spring"]
    turning_ring: Literal["inner", "outer"]
    stiffness_arrangement: Arrangement | None = None
    ball_inertia: Annotated[float, Field(ge=0, le=1)] = 0.0

    @model_validator(mode="after")
    def _tandem_needs_a_spring(self) -> BearingPair:
        if self.arrangement == "tandem" and self.preload_kind == "rigid":
            raise ValueError("a tandem pair cannot preload itself; preload_kind must be spring")
        return self

    def pair(self) -> m.Pair:
        stiffness_arrangement = self.stiffness_arrangement or self.arrangement
        return m.Pair(self.arrangement, self.preload_N, self.preload_kind, stiffness_arrangement, self.turning_ring, self.ball_inertia)


class StructureBody(Table):
    name: Name
    mass_kg: Positive | None = None
    tilt_inertia_kg_m2: tuple[Positive, Positive] | None = None
    polar_inertia_kg_m2: Positive | None = None
    z_mm: Finite | None = None
    regions: list[str] = []
    moves: list[Literal["x", "y", "z", "tilt_x", "tilt_y"]] = Field(min_length=1)
    turns: bool = False

    @model_validator(mode="after")
    def _inertia_given_once(self) -> StructureBody:
        if bool(self.regions) == (self.mass_kg is not None):
            raise ValueError("a body takes its inertia either from regions or from mass_kg and z_mm")
        if not self.regions and self.z_mm is None:
            raise ValueError("a body given by mass_kg needs z_mm")
        if not self.regions and {"tilt_x", "tilt_y"} & set(self.moves) and self.tilt_inertia_kg_m2 is None:
            raise ValueError("a body that tilts needs tilt_inertia_kg_m2")
        if self.turns and set(self.moves) != set(m.MOVES):
            raise ValueError("a body that turns must move in x, y, z, tilt_x and tilt_y")
        return self

    def body(self) -> m.Body:
        ix, iy = self.tilt_inertia_kg_m2 or (0.0, 0.0)
        inertia = (ix, iy, self.polar_inertia_kg_m2 or ix + iy)
        moves = tuple(name for name in m.MOVES if name in self.moves)
        return m.Body(self.name, self.mass_kg or 0.0, inertia, (self.z_mm or 0.0) * MM, moves, self.turns, tuple(self.regions))


class StructureJoint(Table):
    name: Name
    group: Name
    between: tuple[str, str]
    z_mm: Finite
    axial_stiffness_N_per_m: NotNegative = 0.0
    lateral_stiffness_N_per_m: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    tilt_stiffness_N_m_per_rad: tuple[NotNegative, NotNegative] = (0.0, 0.0)
    damping_ratio: Share

    def joint(self) -> m.Joint:
        stiffness = (*self.lateral_stiffness_N_per_m, self.axial_stiffness_N_per_m, *self.tilt_stiffness_N_m_per_rad)
        return m.Joint(self.name, self.group, self.between, self.z_mm * MM, stiffness, self.damping_ratio)


class Structure(Table):
    inner_body: str
    outer_body: str
    damping_frequency_Hz: Positive
    bodies: list[StructureBody] = Field(min_length=2)
    joints: list[StructureJoint] = Field(min_length=1)

    def structure(self) -> m.Structure:
        bodies = tuple(b.body() for b in self.bodies)
        return m.Structure(bodies, tuple(j.joint() for j in self.joints), self.inner_body, self.outer_body, self.damping_frequency_Hz)


class Convection(Table):
    regions: list[str] = Field(min_length=1)
    coefficient_W_per_m2_K: Positive


class Source(Table):
    name: Name
    regions: list[str] = Field(min_length=1)
    power_W: NotNegative
    speed_rpm: Positive
    exponent: NotNegative


class Gap(Table):
    regions: tuple[str, str]
    coefficient_W_per_m2_K: NotNegative


class Friction(Table):
    f0: NotNegative
    f1: NotNegative
    kinematic_viscosity_mm2_per_s: LawValue
    conductance_W_per_K: NotNegative


class Thermal(Table):
    convection: list[Convection] = Field(min_length=1)
    sources: list[Source] = []
    gaps: list[Gap] = []
    friction: Friction

    def thermal(self) -> m.Thermal:
        f = self.friction
        return m.Thermal(
            tuple(m.Convection(tuple(c.regions), c.coefficient_W_per_m2_K) for c in self.convection),
            tuple(m.HeatSource(s.name, tuple(s.regions), s.power_W, s.speed_rpm * RPM, s.exponent) for s in self.sources),
            tuple(m.AirGap(g.regions, g.coefficient_W_per_m2_K) for g in self.gaps),
            m.Friction(f.f0, f.f1, f.kinematic_viscosity_mm2_per_s.law(1e-6), f.conductance_W_per_K),
        )


class Point(Table):
    node: Annotated[int, Field(ge=1)]
    name: Annotated[str, Field(min_length=1, max_length=10)]  # UFF 58 entity names hold ten characters
    body: str
    position_mm: tuple[Finite, Finite, Finite]
    direction: Annotated[str, AfterValidator(_along_axis)]

    def point(self) -> m.Point:
        x, y, z = (v * MM for v in self.position_mm)
        return m.Point(self.node, self.name, self.body, (x, y, z), axis_vector(self.direction))


def axis_vector(direction: str) -> tuple[float, float, float]:
    """Unit vector of a signed axis like '+Z'."""
    x, y, z = ((1.0 if direction[0] == "+" else -1.0) if axis == direction[1] else 0.0 for axis in "XYZ")
    return x, y, z


class Measuring(Table):
    points: list[Point] = Field(min_length=1)


class HammerTest(Table):
    hammer_nodes: list[int] = Field(min_length=1)
    tip_stiffness_N_per_m: Positive
    hammer_mass_g: Positive
    level_N: Positive
    level_scatter: Share
    hits: Annotated[int, Field(ge=1)]
    double_hit_probability: Annotated[float, Field(ge=0, le=1)]
    sample_rate_Hz: Positive
    record_length_s: Positive
    exponential_end: Annotated[float, Field(gt=0, le=1)]
    band_Hz: Radii
    noise_of_value: NotNegative
    noise_of_largest: NotNegative
    step_us: Positive

    @model_validator(mode="after")
    def _sampling_carries_the_band(self) -> HammerTest:
        if self.band_Hz[1] > 0.4 * self.sample_rate_Hz:
            raise ValueError("sample_rate_Hz must be at least 2.5 times the upper end of band_Hz, for the anti-alias filter")
        return self

    def test(self) -> m.HammerTest:
        return m.HammerTest(
            tuple(self.hammer_nodes),
            self.tip_stiffness_N_per_m,
            self.hammer_mass_g * 1e-3,
            self.level_N,
            self.level_scatter,
            self.hits,
            self.double_hit_probability,
            self.sample_rate_Hz,
            self.record_length_s,
            self.exponential_end,
            self.band_Hz,
            self.noise_of_value,
            self.noise_of_largest,
            self.step_us * 1e-6,
        )


class Tolerances(Table):
    structure: Positive
    hub: Positive
    preload: Positive
    damping: Positive
    temperature_K: Positive
    gain: Positive

    def tolerances(self) -> m.Tolerances:
        return m.Tolerances(self.structure, self.hub, self.preload, self.damping, self.temperature_K, self.gain)


class Effect(Table):
    name: Name
    values: dict[str, Finite] = {}


class Build(Table):
    deviations: dict[str, Annotated[float, Field(gt=-0.5, lt=1.0)]] = Field(min_length=1)
    tests: list[str] = []

    def build(self) -> m.Build:
        return m.Build(dict(self.deviations), tuple(self.tests))


class Waves(Table):
    """Waves of a race, column by column, or its measured profile at equal steps of azimuth."""

    order: list[Annotated[int, Field(ge=1)]] = []
    amplitude_nm: list[NotNegative] = []
    phase_deg: list[Finite] = []
    profile_nm: list[Finite] = []
    highest_order: Annotated[int, Field(ge=1)] | None = None

    @model_validator(mode="after")
    def _one_form(self) -> Waves:
        if bool(self.profile_nm) != (self.highest_order is not None) or (self.profile_nm and self.order):
            raise ValueError("a race has either order, amplitude_nm and phase_deg, or profile_nm and highest_order")
        if self.highest_order and 2 * self.highest_order >= len(self.profile_nm):
            raise ValueError(f"highest_order = {self.highest_order}: must be below half of the {len(self.profile_nm)} values of profile_nm")
        if not len(self.order) == len(self.amplitude_nm) == len(self.phase_deg) == len(set(self.order)):
            raise ValueError("order, amplitude_nm and phase_deg must have one entry each for every order, which stands once")
        return self

    def waves(self) -> tuple[i.Wave, ...]:
        if self.highest_order:
            return i.waves(1e-9 * np.array(self.profile_nm), self.highest_order)
        return tuple(map(_wave, self.order, self.amplitude_nm, self.phase_deg))


class BallWave(Table):
    """A wave of one order on every ball."""

    order: Annotated[int, Field(ge=1)]
    amplitude_nm: list[NotNegative]
    phase_deg: list[Finite]


def _wave(order: int, amplitude_nm: float, phase_deg: float) -> i.Wave:
    return i.Wave(order, amplitude_nm * 1e-9, float(np.radians(phase_deg)))


class RowImperfections(Table):
    inner_radial: Waves | None = None
    inner_axial: Waves | None = None
    outer_radial: Waves | None = None
    outer_axial: Waves | None = None
    ball_diameter_nm: list[Finite] = []
    ball_waves: list[BallWave] = []
    cage_unbalance_g_mm: NotNegative = 0.0
    cage_phase_deg: Finite = 0.0

    def check(self, balls: int) -> None:
        """Raises ValueError for a list that does not hold one value for every ball."""
        for key, values in (
            ("ball_diameter_nm", self.ball_diameter_nm),
            *((f"ball_waves.{n}.{key}", getattr(w, key)) for n, w in enumerate(self.ball_waves) for key in ("amplitude_nm", "phase_deg")),
        ):
            if len(values) != balls and (values or key != "ball_diameter_nm"):
                raise ValueError(f"{key}: has {len(values)} values; allowed is one for each of the {balls} balls")

    def row(self, balls: int) -> i.RowImperfections:
        races = [w.waves() if w else () for w in (self.inner_radial, self.inner_axial, self.outer_radial, self.outer_axial)]
        of_ball = [tuple(_wave(w.order, w.amplitude_nm[j], w.phase_deg[j]) for w in self.ball_waves) for j in range(balls)]
        return i.RowImperfections(
            races[0],
            races[1],
            races[2],
            races[3],
            tuple(d * 1e-9 for d in self.ball_diameter_nm),
            tuple(of_ball) if self.ball_waves else (),
            self.cage_unbalance_g_mm * 1e-6,
            float(np.radians(self.cage_phase_deg)),
        )


class Imperfections(Table):
    """Numbers, or `seed` and `grade` alone for a plausible draw."""

    seed: Annotated[int, Field(ge=0)] | None = None
    grade: Literal["high precision", "precision", "ordinary"] | None = None
    unbalance_g_mm: NotNegative = 0.0
    unbalance_z_mm: Finite = 0.0
    unbalance_phase_deg: Finite = 0.0
    couple_unbalance_g_mm2: NotNegative = 0.0
    couple_phase_deg: Finite = 0.0
    bearings: dict[str, RowImperfections] = {}

    @model_validator(mode="after")
    def _drawn_or_given(self) -> Imperfections:
        others = sorted(self.model_fields_set - {"seed", "grade", "origin", "source", "origins"})
        if (self.seed is None) != (self.grade is None) or (self.seed is not None and others):
            raise ValueError(f"seed and grade stand together and alone; beside them: {', '.join(others) or 'nothing, but one is missing'}")
        return self

    def imperfections(self, balls: Mapping[str, int]) -> i.Imperfections:
        return i.Imperfections(
            self.unbalance_g_mm * 1e-6,
            self.unbalance_z_mm * MM,
            float(np.radians(self.unbalance_phase_deg)),
            self.couple_unbalance_g_mm2 * 1e-9,
            float(np.radians(self.couple_phase_deg)),
            {name: row.row(balls[name]) for name, row in self.bearings.items()},
        )


class Scene(Table):
    title: Name
    reference_temperature_C: Finite
    materials: dict[str, Material] = Field(min_length=1)
    section: Section
    ball_rows: dict[str, BallRow] = Field(min_length=1)
    bearings: dict[str, Bearing] = Field(min_length=2, max_length=2)
    bearing_pair: BearingPair
    structure: Structure
    thermal: Thermal
    measuring: Measuring
    hammer_test: HammerTest
    tolerances: Tolerances
    effects: list[Effect] = []
    build: Build | None = None
    imperfections: Imperfections = Imperfections()

    @model_validator(mode="after")
    def _rows_exist(self) -> Scene:
        for name, bearing in self.bearings.items():
            if bearing.row not in self.ball_rows:
                raise ValueError(f"bearings.{name}.row = {bearing.row!r}: allowed are {', '.join(self.ball_rows)}")
        return self

    @model_validator(mode="after")
    def _imperfections_fit_the_bearings(self) -> Scene:
        for name, row in self.imperfections.bearings.items():
            if name not in self.bearings:
                raise ValueError(f"imperfections.bearings.{name}: names no bearing; allowed are {', '.join(self.bearings)}")
            try:
                row.check(self.ball_rows[self.bearings[name].row].balls)
            except ValueError as error:
                raise ValueError(f"imperfections.bearings.{name}.{error}") from None
        return self

    def spindle(self, name: str, file: Path, provenance: dict[str, m.Provenance]) -> m.Spindle:
        bearings = sorted((b.bearing(n, self.ball_rows) for n, b in self.bearings.items()), key=lambda b: b.z)
        return m.Spindle(
            name,
            self.title,
            self.reference_temperature_C,
            {n: t.material(n) for n, t in self.materials.items()},
            tuple(r.region() for r in self.section.regions),
            tuple(bearings),
            self.bearing_pair.pair(),
            self.structure.structure(),
            tuple(p.point() for p in self.measuring.points),
            self.hammer_test.test(),
            self.thermal.thermal(),
            self.tolerances.tolerances(),
            tuple(m.Addition(e.name, dict(e.values)) for e in self.effects),
            self.build.build() if self.build else None,
            self.imperfections.imperfections({b.name: b.balls for b in bearings}),
            provenance,
            file,
        )


def first_error(where: str | Path, raw: Any, form: type[BaseModel], error: ValidationError) -> str:
    """One sentence for the first thing pydantic found wrong in a file of `form`: a misspelt key before the one then missing.

    Entries of a list of tables go by their id, node or name.
    """
    problem = min(error.errors(), key=lambda e: e["type"] != "extra_forbidden")
    location = problem["loc"]
    words, value = [], raw
    for part in location:
        try:
            value = value[part]
        except (KeyError, IndexError, TypeError):
            value = None
        entry = value if isinstance(part, int) and isinstance(value, Mapping) else {}
        words.append(str(next((entry[key] for key in ("id", "node", "name") if key in entry), part)))
    key = ".".join(words)
    match problem["type"]:
        case "extra_forbidden":
            return f"{where}: {key}: unknown key; allowed here: {', '.join(_allowed_keys(form, location[:-1]))}"
        case "missing":
            return f"{where}: {key}: missing, and has no default"
        case _:
            message = problem["msg"].removeprefix("Value error, ")
            given = "" if isinstance(problem["input"], Mapping) else f" = {problem['input']!r}"
            told = f"{key}{given}: {message[0].lower()}{message[1:]}".removeprefix(": ")
            return f"{where}: {told}"


def _allowed_keys(form: Any, path: tuple[str | int, ...]) -> list[str]:
    """Keys of the table at `path`, read off the models."""
    table = form
    for part in path:
        if isinstance(part, int):
            continue
        fields = getattr(table, "model_fields", None)
        table = _table_in(fields[part].annotation if fields and part in fields else get_args(table)[1])
    return list(table.model_fields)


def _table_in(annotation: Any) -> Any:
    """The pydantic model inside an annotation (a list's or union's member), or the annotation itself."""
    if get_origin(annotation) is list:
        return _table_in(get_args(annotation)[0])
    if get_origin(annotation) in (Union, UnionType, Annotated):
        inner = [_table_in(a) for a in get_args(annotation)]
        return next((a for a in inner if isinstance(a, type) and issubclass(a, BaseModel)), annotation)
    return annotation
