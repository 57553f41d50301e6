"""What all Rerun logs are written with: the file, whole or not at all, and series, numbers and bodies in it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr
import rerun.blueprint as rrb
from scipy.spatial.transform import Rotation

from thermospindle.model.errors import BadInput
from thermospindle.model.files.whole import whole
from thermospindle.model.rotor.look.meshes import RegionMesh
from thermospindle.model.types import Array
from thermospindle.model.units import TO_MM
from thermospindle.report.log.drawing import light
from thermospindle.report.log.read import APPLICATION
from thermospindle.report.log.views import at
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.identification.peak import Peak

VIEWER_LIGHT, LIGHT = np.arctan2(2.0, 1.0), np.deg2rad(-60.0)
"""Azimuths from which Rerun's light comes, along (1, 2, 3) in its shaders, and from which bodies are lit."""


UNITS = {
    "run": {"/numbers/peaks:temperature": "C", "/numbers/peaks:frequency": "Hz", "/numbers/peaks:frequency_sd": "Hz", "/records:force": "N", "/records:velocity": "m/s"},
    "runout": {
        "/signals": "nm", "/numbers/quoted": "m", "/numbers/lines:frequency": "Hz", "/numbers/lines:amplitude": "m", "/numbers/lines:forward": "m", "/numbers/lines:backward": "m",
        "/numbers/waterfall:frequency": "Hz", "/numbers/waterfall:natural": "Hz", "/numbers/waterfall:radial": "m", "/numbers/waterfall:axial": "m",
    },
}  # fmt: skip
"""By kind of log the units of numbers whose names have none, by what an entity's path begins with, or that and its component or its last part;
of an FRF it is that of its `quantity`. A log holds its own at `numbers/units`; components of other kinds of logs have units in their names."""


@contextmanager
def whole_log(path: Path, kind: str, name: str, about: Mapping[str, Any], blueprint: rrb.Blueprint) -> Iterator[rr.RecordingStream]:
    """A recording into the file `path`, whole or not at all; its property `kind` says what it is `about` (`report.log.read.KINDS`).

    Rerun's errors are raised here; else it prints them and goes on, and the log would lack something. BadInput if the folder of `path`
    does not exist.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise BadInput(f"{path}: its folder does not exist")
    before = rr.strict_mode()
    rr.set_strict_mode(True)
    try:
        with whole(path) as file:
            recording = rr.RecordingStream(APPLICATION, send_properties=False)
            try:
                recording.save(file, default_blueprint=blueprint)
                recording.send_recording_name(name)
                recording.send_property(kind, rr.AnyValues(**about))
                if units := UNITS.get(kind):
                    log_values(recording, "numbers/units", {"of": list(units), "unit": list(units.values())})
                yield recording
            finally:
                recording.disconnect()
    finally:
        rr.set_strict_mode(before)


# ---------------------------------------------------------------- numbers


def log_values(recording: rr.RecordingStream, entity: str, named: dict[str, Any]) -> None:
    """Lists of numbers or words of one length, by plain names."""
    recording.log(entity, rr.AnyValues(**named), static=True)


def number_column(name: str, numbers: Array) -> rr.ComponentColumnList:
    columns: dict[str, Any] = {name: numbers}
    return rr.AnyValues.columns(**columns)


def over_frequency(frequency: Array) -> rr.TimeColumn:
    """The timeline `frequency`, in whole Hz."""
    return rr.TimeColumn("frequency", sequence=np.round(frequency).astype(int))


def log_frf_numbers(recording: rr.RecordingStream, id: str, order: int, temperature: float, speed: float, frf: Frf) -> None:
    """The FRFs of one test (C, rad/s) as computed, a row a line with the values of all (response, reference) pairs in it."""
    pairs = frf.value.shape[0] * frf.value.shape[1]
    arrays = {"real": frf.value.real, "imaginary": frf.value.imag, "coherence": frf.coherence, "standard_error": frf.sd}
    columns = [*rr.AnyValues.columns(frequency_Hz=frf.frequency)]
    for name, array in arrays.items():
        if array is not None:
            flat = np.ascontiguousarray(array.reshape(pairs, -1).T).ravel()
            columns += number_column(name, flat).partition(np.full(len(frf.frequency), pairs))
    recording.send_columns(at("numbers", id), [over_frequency(frf.frequency)], columns)
    about = {"id": id, "order": order, "temperature_C": temperature, "speed_rad_per_s": speed, "quantity": frf.quantity}
    about |= {"response_nodes": frf.response_nodes, "reference_nodes": frf.reference_nodes}
    about |= {"named_nodes": list(frf.names), "node_names": list(frf.names.values())} if frf.names else {}
    log_values(recording, at("numbers", id, "about"), about)


def log_peak_numbers(recording: rr.RecordingStream, peaks: Sequence[Peak]) -> None:
    """Their types are told, without which Rerun takes no list of none."""
    types = {"str": pa.string(), "int": pa.int64(), "float": pa.float64()}
    log_values(recording, "numbers/peaks", {f.name: pa.array([getattr(p, f.name) for p in peaks], types[str(f.type)]) for f in fields(Peak)})


# ---------------------------------------------------------------- for the eye


def log_words(recording: rr.RecordingStream, entity: str, text: str, static: bool = True) -> None:
    """Markdown."""
    recording.log(entity, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=static)


def log_curve(
    recording: rr.RecordingStream, entity: str, times: rr.TimeColumn, numbers: Array, look: rr.SeriesLines | rr.SeriesPoints
) -> None:
    recording.log(entity, look, static=True)
    recording.send_columns(entity, [times], rr.Scalars.columns(scalars=numbers))


def curve_look(colour: Any, name: str, width: float = 1.0) -> rr.SeriesLines:
    """Without Rerun's aggregation, which averages neighbouring points and so lowers peaks."""
    return rr.SeriesLines(colors=[colour], names=name, widths=width, aggregation_policy=rr.components.AggregationPolicy.Off)


def log_mesh(recording: rr.RecordingStream, entity: str, mesh: RegionMesh, tint: tuple[float, float, float] | None = None) -> None:
    """A part of a body, in mm, lit from where `views.scene` looks from; half of its material's colour may be a `tint`.

    The viewer has one light, fixed behind the bodies. Normals turned about z, about which bodies may spin, bring it before them.
    """
    vertices, triangles, normals = mesh.shaded()
    red, green, blue = mesh.rgba[:3] if tint is None else np.mean([mesh.rgba[:3], tint], axis=0)
    shape = rr.Mesh3D(
        vertex_positions=TO_MM * vertices,
        triangle_indices=triangles,
        vertex_normals=Rotation.from_euler("z", VIEWER_LIGHT - LIGHT).apply(normals),
        albedo_factor=light((red, green, blue)),
    )
    recording.log(entity, shape, static=True)
