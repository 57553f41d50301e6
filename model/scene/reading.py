"""Reading a spindle from its scene file: units, checks, provenance.

The file's own form (units in the keys) is the pydantic models of `model.scene.form`; `load` turns it into SI definitions and
refuses what cannot be a spindle with one sentence that names file, key, value and what is allowed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from difflib import get_close_matches
from functools import lru_cache
from operator import methodcaller
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from pydantic import ValidationError

from thermospindle.model.bearing.catalogue import derived
from thermospindle.model.bearing.pair import solve
from thermospindle.model.bearing.row import reference_motion
from thermospindle.model.built.drawn import GRADES, drawn
from thermospindle.model.built.tolerance import deviated
from thermospindle.model.carrier import check_carriers
from thermospindle.model.errors import BadInput, NoEquilibrium, OutsideRange, instead
from thermospindle.model.files.formats import KEY, SCENE, migrated
from thermospindle.model.machine import Bearing, Condition, Provenance, Spindle
from thermospindle.model.rotor.beam import with_shafts
from thermospindle.model.rotor.chain import matrices, rotor_base
from thermospindle.model.rotor.poles import poles
from thermospindle.model.rotor.section import cells, mass_properties
from thermospindle.model.scene import form as scene_file
from thermospindle.model.scene.checks import check_bearings, check_raceways, check_rollers, check_section, check_structure, constant
from thermospindle.model.scene.fields import read_file
from thermospindle.model.shaft import SAME_HEIGHT

__tracebackhide__ = methodcaller("errisinstance", BadInput)  # pytest shows where it was asked
ROW_KINDS = ("ball_rows", "roller_rows")
SCENES = Path(__file__).parents[2] / "scenes"
"""The shipped scenes: beside the packages, in a checkout as installed."""


def load(path: str | Path) -> Spindle:
    """The spindle of a scene, given its folder, its `spindle.toml`, or the name of a shipped one.

    Raises `BadInput` for a missing or unreadable file, unknown or missing keys, wrong types, values out of range, and geometry
    that cannot be built.
    """
    file = scene_path(path)
    return build(read_file(SCENE, file), file)


def scene_path(path: str | Path) -> Path:
    """The scene file behind a folder or file name, or behind the bare name of a shipped scene where nothing of that name is here."""
    path = Path(path)
    if not path.exists() and path.parts == (path.name,) and path.name in shipped():
        path = SCENES / path
    file = path / "spindle.toml" if path.is_dir() else path
    if not file.is_file():
        if file.is_dir():
            raise BadInput(f"{file}: is a folder; a scene's file is expected there")
        names = ", ".join(shipped())
        meant = f"; did you mean {near}?" if (near := _nearest(path)) else f"; expected a folder with spindle.toml, that file, or the name of a shipped scene ({names})"
        raise BadInput(f"{path}: no scene there{meant}")
    return file


def _nearest(path: Path) -> str:
    """The scene in the folder asked for, or the shipped one, whose name is most like the last part of `path`; empty where none is like it."""
    beside = {f.parent.name: str(f.parent) for f in sorted(path.parent.glob("*/spindle.toml"))} if path.parent.is_dir() else {}
    known = {**({name: name for name in shipped()} if path.parts == (path.name,) else {}), **beside}
    return next((known[name] for name in get_close_matches(path.name, known, n=1)), "")


def shipped() -> tuple[str, ...]:
    """Names of the scenes that come with the program."""
    return tuple(sorted(file.parent.name for file in SCENES.glob("*/spindle.toml")))


def build(raw: dict[str, Any], file: Path) -> Spindle:
    """The spindle of the parsed TOML `raw`; `file` serves messages only."""
    raw, form = formed(raw, file)
    _check_catalogues(form, file)
    try:
        spindle = _at_reference(raw, form, file)
    except OutsideRange as error:
        raise BadInput(f"{file}: reference_temperature_C = {form.reference_temperature_C:g}: {error}; allowed is one that every law of the scene reaches") from None
    if form.hammer_test.step_us is None:
        try:
            spindle = replace(spindle, hammer=replace(spindle.hammer, step=chosen_step(spindle)))
        except NoEquilibrium as error:
            raise BadInput(f"{file}: {error} at the reference; allowed is what they bear") from None
    own = form.imperfections
    if own.seed is not None and own.grade is not None:
        spindle = replace(spindle, imperfections=drawn(spindle, own.seed, GRADES[own.grade]))
    return spindle


def _at_reference(raw: dict[str, Any], form: scene_file.Scene, file: Path) -> Spindle:
    """What is drawn and mounted; `OutsideRange` where a law does not reach the reference temperature."""
    spindle = form.spindle(name=file.parent.name, file=file, provenance=_provenance(file, raw))
    spindle = _with_shafts(file, spindle)
    check_section(file, spindle)
    spindle = _with_loaded_angles(form, spindle)
    check_bearings(file, spindle)
    check_rollers(file, spindle)
    check_raceways(file, spindle)
    check_structure(file, spindle)
    check_carriers(spindle)
    return _as_built(file, _with_section_inertia(spindle))


@lru_cache(maxsize=1)
def shipped_rows() -> dict[str, dict[str, Any]]:
    """The bearings that come with the program (`scenes/bearings.toml`): tables of `ball_rows` and `roller_rows` by name."""
    return read_file(SCENE, SCENES / "bearings.toml")


def formed(raw: Mapping[str, Any], file: Path) -> tuple[dict[str, Any], scene_file.Scene]:
    """Parsed TOML in today's format, with the shipped rows that it names, and as the form of a
    scene; `BadInput` where it does not fit that."""
    whole = with_shipped_rows(migrated(SCENE, dict(raw), file))
    _check_rows(whole, file)
    try:
        return whole, scene_file.Scene.model_validate(whole)
    except ValidationError as error:
        raise BadInput(scene_file.first_error(file, whole, scene_file.Scene, error)) from None


def _check_rows(whole: Mapping[str, Any], file: Path) -> None:
    """`BadInput` for a bearing of a row that is neither the scene's own nor shipped; what is wrong otherwise the form says."""
    own, bearings = [whole.get(kind, {}) for kind in ROW_KINDS], whole.get("bearings", {})
    if not all(isinstance(table, Mapping) for table in (*own, bearings)):
        return
    there = [name for rows in own for name in rows]
    shipped_ones = [name for rows in shipped_rows().values() for name in rows if name not in there]
    for name, b in bearings.items():
        row = b.get("row") if isinstance(b, Mapping) else None
        if isinstance(row, str) and row not in there:
            raise BadInput(f"{file}: bearings.{name}.row = {row!r}: no row of this scene, nor a shipped one; {instead(row, [*there, *shipped_ones])}")


def with_shipped_rows(raw: Mapping[str, Any]) -> dict[str, Any]:
    """The tables of a scene with the shipped rows that its bearings name and that it does not describe itself."""
    own = {kind: raw.get(kind, {}) for kind in ROW_KINDS}
    bearings = raw.get("bearings")
    if not isinstance(bearings, Mapping) or not all(isinstance(rows, Mapping) for rows in own.values()):
        return dict(raw)  # what is wrong with it the form says
    named = {b["row"] for b in bearings.values() if isinstance(b, Mapping) and isinstance(b.get("row"), str)}
    named -= {name for rows in own.values() for name in rows}
    found = {kind: {n: row for n, row in shipped_rows()[kind].items() if n in named} for kind in ROW_KINDS}
    return {**raw, **{kind: {**own[kind], **rows} for kind, rows in found.items() if rows}}


SAFE, SAFE_SHAFT = 1.35, 2.2
"""|pole| step of the stiffest mode at the reference, where Runge-Kutta 4 bears 2.78: half of it, for bearings stiffer
than at the reference; more where the stiffest mode is one of a shaft's short elements, which no condition stiffens."""


def chosen_step(spindle: Spindle) -> float:
    """The longest integration step (s) that divides the sampling interval and follows the stiffest
    mode at the reference state, or as near it as tables of bearing numbers reach."""
    still = {b.name: reference_motion(spindle.reference_temperature) for b in spindle.bearings}
    temperature, speed = spindle.reference_temperature, 0.0
    for b in spindle.linear_bearings:
        temperature, speed = (float(np.clip(at, told[0], told[-1])) if len(told) > 1 else at for at, told in ((temperature, b.temperature), (speed, b.speed)))
    chain = rotor_base(spindle, solve(spindle, Condition(temperature, speed), still))
    stiffest = float(np.abs(poles(matrices(chain)).value).max())
    interval = 1 / spindle.hammer.sample_rate
    return interval / max(1, int(np.ceil(interval * stiffest / (SAFE_SHAFT if spindle.structure.shafts else SAFE))))


def content_hash(spindle: Spindle) -> str:
    """Twelve hex digits that change when any number of the spindle changes (name, file and provenance apart)."""
    content = _compared(spindle)
    for key in ("name", "title", "provenance"):
        content.pop(key)
    for key in ("radial_loads", "roller_bearings"):  # what came later counts where there is any
        if not content[key]:
            content.pop(key)
    if not any(content["gravity"]):
        content.pop("gravity")
    if not content["imperfections"]["unbalance_body"]:
        content["imperfections"].pop("unbalance_body")
    for film in content["thermal"]["convections"]:
        if film["coolant"] is None:
            film.pop("coolant")
    for damped in (*content["structure"]["joints"], *content["structure"]["shafts"]):
        if not damped["loss_factor"]:
            damped.pop("loss_factor")
    for segment in (s for shaft in content["structure"]["shafts"] for s in shaft["segments"]):
        if segment["sides"] is None:
            segment.pop("sides")
    for point in content["points"]:
        for key in ("mass", "channel", "hammer"):
            if not point[key]:
                point.pop(key)
        if point["listens"]:
            point.pop("listens")
    return hashlib.sha256(json.dumps(content, sort_keys=True, default=str).encode()).hexdigest()[:12]


def _compared(value: Any) -> Any:
    """Of dataclasses in mappings and sequences the fields that tell equal ones from others, by name."""
    if is_dataclass(value):
        return {f.name: _compared(getattr(value, f.name)) for f in fields(value) if f.compare}
    if isinstance(value, Mapping):
        return {key: _compared(v) for key, v in value.items()}
    return [_compared(v) for v in value] if isinstance(value, tuple | list) else value


def _provenance(file: Path, raw: Mapping[str, Any]) -> dict[str, Provenance]:
    """Origin and source of every number of the file; a number without one is refused."""
    found: dict[str, Provenance] = {}

    def walk(node: Any, key: str, origin: str | None, source: str) -> None:
        if isinstance(node, Mapping):
            own, text = node.get("origin", origin), node.get("source", source)
            exceptions = node.get("origins", {})
            for name in exceptions:
                if name not in node:
                    raise BadInput(f"{file}: {key}.origins.{name}: names no key of this table")
            for name, value in node.items():
                if name not in ("origin", "source", "origins"):
                    inherited = exceptions.get(name, own if key else None)
                    walk(value, f"{key}.{name}" if key else name, inherited, text if key else "")
        elif isinstance(node, list) and node and isinstance(node[0], Mapping):
            for index, value in enumerate(node):
                walk(value, f"{key}.{value.get('name', value.get('node', index))}", origin, source)
        elif isinstance(node, list) and node and isinstance(node[0], list):
            walk(node[0], key, origin, source)
        elif _is_number(node) or (isinstance(node, list) and node and all(map(_is_number, node))):
            if key in (KEY, "reference_temperature_C", "nominal_speed_rpm", "temperature_range_C", "ball_inertia", "axial_load_N", "radial_load_N", "radial_load_z_mm", "gravity_m_per_s2") or key.startswith("radial_loads.") or key.endswith(".node"):
                return
            if origin is None:
                raise BadInput(f"{file}: {key} = {node!r}: says no origin; its table needs origin = printed, assumed or calibrated")
            found[key] = Provenance(origin, source)

    walk(raw, "", None, "")
    return found


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


# ---------------------------------------------------------------- what follows from the file


def _check_catalogues(form: scene_file.Scene, file: Path) -> None:
    """`BadInput` with file and key for a catalogue that no ball bearing fits."""
    for name, row in form.ball_rows.items():
        if (told := row.catalogue_row()) is not None:
            try:
                derived(told)
            except BadInput as error:
                raise BadInput(f"{file}: ball_rows.{name}.{error}") from None


def _with_loaded_angles(form: scene_file.Scene, spindle: Spindle) -> Spindle:
    """The spindle with the loaded contact angle of the bearings that were told by their free one, and the constant of those of a catalogue."""
    bearings = []
    for b in spindle.bearings:
        row = form.ball_rows[str(form.bearings[b.name].row)]
        known = b.ball_material in spindle.materials and b.ring_material in spindle.materials
        if row.free_contact_angle_deg is not None and known:
            free = float(np.radians(row.free_contact_angle_deg))
            if (told := row.catalogue_row()) is not None:
                b = replace(b, contact_angle=free)
                b = replace(b, constant_factor=derived(told).constant / (b.balls * constant(spindle, b)))
            b = replace(b, contact_angle=loaded_angle(spindle, b, free))
        bearings.append(b)
    return replace(spindle, bearings=tuple(bearings))


def loaded_angle(spindle: Spindle, b: Bearing, free: float) -> float:
    """Contact angle (rad) under the preload of a bearing whose angle without load is `free`: Harris 1991, Eq. 6.33.

    A cos(free) = (A + deformation) cos(loaded), and balls K deformation^1.5 sin(loaded) = preload.
    """

    def excess(angle: float) -> float:
        deformation = max(np.cos(free) / np.cos(angle) - 1, 0.0) * b.unloaded_distance
        return float(
            b.balls * constant(spindle, replace(b, contact_angle=angle)) * deformation**1.5 * np.sin(angle) - b.preload
        )

    return float(scipy.optimize.brentq(excess, free, 0.99 * np.pi / 2, xtol=1e-14))


def _with_shafts(file: Path, spindle: Spindle) -> Spindle:
    """The spindle with nodes and elements of its shafts among its bodies and joints."""
    for shaft in spindle.structure.shafts:
        for segment in shaft.segments:
            if segment.material not in spindle.materials:
                key = "material" if len({s.material for s in shaft.segments}) == 1 else "materials"
                raise BadInput(f"{file}: shafts.{shaft.name}.{key} = {segment.material!r}: allowed are {', '.join(spindle.materials)}")
    names = [s.name for s in spindle.structure.shafts]
    for name in names:
        if names.count(name) > 1:
            raise BadInput(f"{file}: shafts: the name {name!r} stands twice; shaft names must differ")
    for key, z, body in [(f"measuring.points.{p.node}", p.position[2], p.body) for p in spindle.points] + [
        (f"{key}.{held.name}", held.z, body)
        for key, parts in (("bearings", [(b, (b.inner_body, b.outer_body)) for b in spindle.all_bearings]), ("structure.joints", [(j, j.bodies) for j in spindle.structure.joints]))
        for held, bodies in parts
        for body in bodies
    ]:
        for shaft in spindle.structure.shafts:
            if body in shaft.bodies and not shaft.nodes[0] - SAME_HEIGHT <= z <= shaft.nodes[-1] + SAME_HEIGHT:
                raise BadInput(
                    f"{file}: {key}: at z_mm = {z * 1e3:g} beyond the shaft {shaft.name!r}, which spans {shaft.nodes[0] * 1e3:g} to {shaft.nodes[-1] * 1e3:g}"
                )
    return replace(spindle, structure=with_shafts(spindle.structure, spindle.materials, spindle.reference_temperature))


def _with_section_inertia(spindle: Spindle) -> Spindle:
    """The spindle with mass, centre and inertia of bodies made of section regions filled in."""
    tiles = [c for part in ("stationary", "rotating") for c in cells([g for g in spindle.regions if g.part == part])]
    bodies = []
    for body in spindle.structure.bodies:
        if body.regions:
            own = [c for c in tiles if c.region in body.regions]
            if not own:
                raise BadInput(f"{spindle.file}: structure.bodies.{body.name}.regions = {list(body.regions)}: later regions of the section cover all of them, so that nothing is left for the body to be made of")
            m = mass_properties(own, spindle.regions, dict(spindle.materials))
            body = replace(body, mass=m.mass, inertia=(m.transverse, m.transverse, m.polar), z=m.z)
        bodies.append(body)
    structure = replace(spindle.structure, bodies=tuple(bodies))
    return replace(spindle, structure=structure)


def _as_built(file: Path, spindle: Spindle) -> Spindle:
    """The spindle with the deviations of its `build` table in its numbers."""
    if spindle.build is None:
        return spindle
    try:
        return deviated(spindle, spindle.build.deviations)
    except BadInput as error:
        raise BadInput(f"{file}: {error}") from None
