"""The form of a study file, and the study it describes."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationError, model_validator

from thermospindle.model.errors import BadInput
from thermospindle.model.files.formats import CURRENT, STUDY
from thermospindle.model.scene.fields import Name, Temperature, Title, first_error, format_of, read_file
from thermospindle.model.scene.reading import scene_path
from thermospindle.sim.campaign.form import Table

SWEEP, MONTE_CARLO, FLEET, COMPARISON = "sweep", "monte-carlo", "fleet", "comparison"
MOST = 10_000_000
"""Cases of a study: more would fill a disk before they could be looked at."""

Rpm = Annotated[float, Field(ge=-1e8, le=1e8, allow_inf_nan=False)]


class Steps(Table):
    """So many values from one to another, both included, evenly or in equal ratios."""

    start: Annotated[float, Field(alias="from", allow_inf_nan=False)]
    to: Annotated[float, Field(allow_inf_nan=False)]
    steps: Annotated[int, Field(ge=2, le=100_000)]
    spacing: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _logarithms_exist(self) -> Steps:
        if self.spacing == "log" and not (self.start > 0 and self.to > 0):
            raise ValueError('spacing = "log" needs from and to above 0')
        return self

    def values(self) -> tuple[float, ...]:
        made = np.linspace if self.spacing == "linear" else np.geomspace
        return tuple(made(self.start, self.to, self.steps).tolist())


class StudyForm(Table):
    format: format_of(STUDY) = CURRENT[STUDY]  # type: ignore[valid-type]
    title: Title
    kind: Literal["sweep", "monte-carlo", "fleet", "comparison"]
    scene: Name | None = None
    scenes: list[Name] = Field(default_factory=list, max_length=100)
    temperatures_C: list[Temperature] | None = Field(None, min_length=1, max_length=100_000)
    speeds_rpm: list[Rpm] | None = Field(None, min_length=1, max_length=100_000)
    highest_Hz: Annotated[float, Field(gt=0, le=1e9)] | None = None
    chunk: Annotated[int, Field(ge=1, le=10_000)] | None = None
    runout: bool = False
    grade: Literal["high precision", "precision", "ordinary"] | None = None
    vary: dict[Name, Steps | Annotated[list[Any], Field(min_length=1, max_length=100_000)]] = Field(default_factory=dict)
    draws: Annotated[int, Field(ge=2, le=MOST)] | None = None
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    sobol: bool = False
    campaigns: list[Name] = Field(default_factory=list)
    work: Literal["compare", "diagnose"] = "compare"

    @model_validator(mode="after")
    def _keys_of_its_kind(self) -> StudyForm:
        for key in sorted(self.model_fields_set):
            kinds = ONLY.get(key, (self.kind,))
            if self.kind not in kinds:
                raise ValueError(f"{key}: is for kind = {' or '.join(map(repr, kinds))}, and this study is a {self.kind}")
        needed = [("scene", SWEEP), ("scene", MONTE_CARLO), ("scene", FLEET), ("draws", MONTE_CARLO), ("campaigns", FLEET), ("scenes", COMPARISON), ("temperatures_C", COMPARISON)]
        for key, kind in needed:
            if self.kind == kind and not getattr(self, key):
                raise ValueError(f"{key}: missing, and a {kind} study has no default for it")
        if self.runout and not any(self.speeds_rpm or ()):
            raise ValueError("runout = true: at rest there is none; speeds_rpm needs a speed")
        if self.grade and not self.runout:
            raise ValueError(f"grade = {self.grade!r}: imperfections show in the runout alone; it needs runout = true")
        if self.kind == COMPARISON and len(self.scenes) < 2:
            raise ValueError(f"scenes = {self.scenes!r}: a comparison needs at least two")
        if self.grade and not self.draws:
            raise ValueError(f"grade = {self.grade!r}: imperfections are drawn with spindles; it needs draws")
        for key in ("temperatures_C", "speeds_rpm", "campaigns", "scenes"):
            values = getattr(self, key) or []
            if len(set(values)) < len(values):
                raise ValueError(f"{key}: a value stands twice")
        for key, values in self.vary.items():
            if isinstance(values, list) and any(v in values[:i] for i, v in enumerate(values)):
                raise ValueError(f"vary: {key}: a value stands twice")
        return self


ONLY = {
    "scene": (SWEEP, MONTE_CARLO, FLEET),
    "scenes": (COMPARISON,),
    "vary": (SWEEP,),
    "draws": (MONTE_CARLO, COMPARISON),
    "seed": (MONTE_CARLO, COMPARISON),
    "sobol": (MONTE_CARLO,),
    "campaigns": (FLEET,),
    "work": (FLEET,),
    "temperatures_C": (SWEEP, MONTE_CARLO, COMPARISON),
    "speeds_rpm": (SWEEP, MONTE_CARLO, COMPARISON),
    "highest_Hz": (SWEEP, MONTE_CARLO, COMPARISON),
    "runout": (SWEEP, MONTE_CARLO, COMPARISON),
    "grade": (MONTE_CARLO, COMPARISON),
}
"""Keys that only some kinds of study have."""
CHUNK = {SWEEP: 64, MONTE_CARLO: 64, FLEET: 1, COMPARISON: 64}
"""Cases a part file, where the study does not say: some seconds of work, which is what a kill can cost."""


@dataclass(frozen=True)
class Study:
    """A study file, read: `scene` a path or the name of a shipped one (of a comparison the first of
    `scenes`, called as in `designs`), `vary` values by key, `campaigns` folders, `digest` that of the file."""

    file: Path
    title: str
    kind: str
    scene: Path
    temperatures: tuple[float, ...] | None  # C
    speeds: tuple[float, ...]  # rpm
    highest: float | None  # Hz
    chunk: int
    vary: tuple[tuple[str, tuple[Any, ...]], ...]
    draws: int
    seed: int
    campaigns: tuple[Path, ...]
    work: str
    digest: str
    runout: bool = False
    sobol: bool = False  # variance-based sensitivities, at (2 + inputs) times the cases
    scenes: tuple[Path, ...] = ()
    designs: tuple[str, ...] = ()
    grade: str | None = None  # of the imperfections that are drawn with each spindle; None: those of the scene

    def combinations(self) -> int:
        """Of the varied keys."""
        return prod(len(values) for _, values in self.vary)


def read_study(file: Path) -> Study:
    """The study of a file; paths in it are from its folder. Raises `BadInput` for what cannot be one."""
    if not file.is_file():
        raise BadInput(f"{file}: no study file there; expected a TOML file with title, kind and scene")
    raw = read_file(STUDY, file)
    try:
        form = StudyForm.model_validate(raw)
    except ValidationError as error:
        raise BadInput(first_error(file, raw, StudyForm, error)) from None
    study = Study(
        file=file,
        title=form.title,
        kind=form.kind,
        scene=_beside(file, "scene", form.scene) if form.scene else _beside(file, "scenes", form.scenes[0]),
        scenes=tuple(_beside(file, "scenes", name) for name in form.scenes),
        designs=tuple(form.scenes),
        temperatures=None if form.temperatures_C is None else tuple(form.temperatures_C),
        speeds=tuple(form.speeds_rpm or (0.0,)),
        highest=form.highest_Hz,
        chunk=form.chunk or CHUNK[form.kind],
        vary=tuple((key, v.values() if isinstance(v, Steps) else tuple(v)) for key, v in form.vary.items()),
        draws=form.draws or 0,
        seed=form.seed,
        campaigns=_campaigns(file, form.campaigns),
        work=form.work,
        runout=form.runout,
        grade=form.grade,
        sobol=form.sobol,
        digest=hashlib.sha256(file.read_bytes()).hexdigest()[:16],
    )
    if (count := study.combinations() * max(len(study.temperatures or ()), 1) * len(study.speeds)) > MOST:
        raise BadInput(f"{file}: vary: {count} cases; at most {MOST} are allowed")
    return study


def _beside(file: Path, key: str, name: str) -> Path:
    """A scene told in a file: from the file's folder where something is there, else as it is, as
    the name of a shipped one. Raises `BadInput` where there is none."""
    there = file.parent / name
    scene = there if there.exists() else Path(name)
    try:
        scene_path(scene)
    except BadInput as error:
        raise BadInput(f"{file}: {key} = {name!r}: {error}") from None
    return scene


def _campaigns(file: Path, patterns: list[str]) -> tuple[Path, ...]:
    """Folders with a campaign.toml that names or patterns like "fleet/*" stand for, each once, in order of their names."""
    found: dict[Path, None] = {}
    for pattern in patterns:
        try:
            folders = sorted(p for p in file.parent.glob(pattern) if (p / "campaign.toml").is_file())
        except (ValueError, NotImplementedError) as error:
            raise BadInput(f"{file}: campaigns = {pattern!r}: {error}; names of folders from the study's own are allowed, as in 'fleet/*'") from None
        if not folders:
            raise BadInput(f"{file}: campaigns = {pattern!r}: no folder with campaign.toml is called so in {file.parent}")
        found |= dict.fromkeys(folders)
    return tuple(found)
