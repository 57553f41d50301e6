"""The Rerun log of a run: one `.rrd` with what was computed, and a blueprint that shows it at a glance.

Rerun shows one timeline at a time, so everything that moves, moves on the timeline `frequency` (Hz, rounded to whole numbers): FRFs are
series on it, bodies swing while its cursor sweeps. Charts over other axes are drawings that every timeline shows; the same
numbers stand as series on `temperature` and `time`. `numbers/` holds the FRFs as computed, bit for bit (`sim.log_read`).
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from model.ball_row import Array
from model.scene import BadInput
from sim import log_content as content
from sim.campaign import Test
from sim.frf import Frf
from sim.log_content import CYCLE, MM, Curve, Peak, heat
from sim.log_read import APPLICATION, LogContents, describe, read_log
from sim.operating import provenance
from sim.run import Run
from thermal.expansion import expand, field

__all__ = ["LogContents", "describe", "read_log", "write_log"]

FRAMES = 900  # about, of the sweep through the band
SIDES = ((90, 200, 255), (255, 170, 80))  # lower and upper bearing
MEASURED = ((120, 255, 140), (30, 190, 90))
DARK = (13, 13, 15)
Pair = tuple[int, int]  # response node, hammer node


def write_log(run: Run, path: Path) -> None:
    """Write the log of a run, whole or not at all. BadInput if its folder does not exist."""
    path = Path(path)
    if not path.parent.is_dir():
        raise BadInput(f"{path}: its folder does not exist")
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with _strict():
            recording = rr.RecordingStream(APPLICATION, send_properties=False)
            log = Log(run, recording)
            recording.save(partial, default_blueprint=log.blueprint())
            log.write()
            recording.disconnect()
        partial.rename(path)
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def _strict() -> Iterator[None]:
    """Errors of Rerun's are raised here; it prints them and goes on otherwise, and the log would lack something."""
    before = rr.strict_mode()
    rr.set_strict_mode(True)
    try:
        yield
    finally:
        rr.set_strict_mode(before)


class Log:
    """Writes a run to one recording, topic by topic."""

    def __init__(self, run: Run, recording: rr.RecordingStream) -> None:
        self.run, self.recording = run, recording
        self.spindle = run.spindle
        self.tests = content.tests_of(run)
        self.temperatures = [t.temperature for t in self.tests]
        self.peaks = content.peaks(run)
        self.modes = content.followed_modes(run)
        low, high = run.spindle.hammer.band
        self.band = (int(np.floor(low)), int(np.ceil(high)))
        self.step = max(round((high - low) / FRAMES), 1)
        self.floor, self.ceiling = self._level_range()

    def write(self) -> None:
        self.recording.send_recording_name(f"{self.spindle.name}, {min(self.temperatures):g} to {max(self.temperatures):g} C")
        self.recording.send_property("run", rr.AnyValues(title=self.spindle.title, **provenance(self.spindle)))
        self.numbers()
        self.frfs()
        self.peak_marks()
        self.animations()
        self.section()
        self.bearings()
        self.records()
        self._static("summary", rr.TextDocument(content.summary(self.run, self.peaks), media_type=rr.MediaType.MARKDOWN))

    # ------------------------------------------------------------ numbers

    def numbers(self) -> None:
        """Every FRF as computed: a row a line, with the values of all (response, reference) pairs in it."""
        for order, test in enumerate(self.tests):
            frf = _frf(test)
            pairs = frf.value.shape[0] * frf.value.shape[1]
            arrays = {"real": frf.value.real, "imaginary": frf.value.imag, "coherence": frf.coherence, "standard_error": frf.sd}
            columns = [*rr.AnyValues.columns(frequency_Hz=frf.frequency)]
            for name, array in arrays.items():
                if array is not None:
                    flat = np.ascontiguousarray(array.reshape(pairs, -1).T).ravel()
                    columns += rr.AnyValues.columns(**{name: flat}).partition(np.full(len(frf.frequency), pairs))
            self.recording.send_columns(at("numbers", test.id), [_over_frequency(frf.frequency)], columns)
            about = rr.AnyValues(
                id=test.id,
                order=order,
                temperature_C=test.temperature,
                speed_rad_per_s=test.speed,
                quantity=frf.quantity,
                response_nodes=frf.response_nodes,
                reference_nodes=frf.reference_nodes,
            )
            self._static(at("numbers", test.id, "about"), about)
        names = Peak.__dataclass_fields__
        self._static("numbers/peaks", rr.AnyValues(**{name: [getattr(p, name) for p in self.peaks] for name in names}))

    # ------------------------------------------------------------ frequency response

    def frfs(self) -> None:
        for test in self.tests:
            frf, colour = _frf(test), heat(test.temperature, self.temperatures)
            look = rr.SeriesLines(colors=[colour], names=f"{test.temperature:g} °C", widths=1.5)
            for i, j in np.ndindex(frf.value.shape[:2]):
                pair = (frf.response_nodes[i], frf.reference_nodes[j])
                series = {"level": _decibel(frf.value[i, j]), "phase": np.degrees(np.angle(frf.value[i, j]))}
                series |= {} if frf.coherence is None else {"coherence": frf.coherence[i, j]}
                for name, values in series.items():
                    self._series(at(*_pair(pair), name, test.id), _over_frequency(frf.frequency), values, look)

    def peak_marks(self) -> None:
        """Identified peaks on the curves, a series for each mode; measured frequencies in rows at the bottom."""
        level = {t.id: _frf(t) for t in self.tests}
        for pair in self._shown_pairs():
            for mode, kind in enumerate((m.kind for m in self.modes[0]), 1):
                own = [p for p in self.peaks if p.source == "identified" and p.mode == mode]
                if own:
                    values = [self._level_at(level[p.test], pair, p.frequency) for p in own]
                    look = rr.SeriesPoints(colors=[(255, 255, 255)], markers="diamond", marker_sizes=4, names=f"{mode} {kind}, identified")
                    times = _over_frequency(np.array([p.frequency for p in own]))
                    self._series(at(*_pair(pair), "level", "identified", f"mode {mode}"), times, np.array(values), look)
            measured = [p for p in self.peaks if p.source not in ("computed", "identified")]
            for k, (source, test) in enumerate(dict.fromkeys((p.source, p.test) for p in measured)):
                own = [p for p in measured if (p.source, p.test) == (source, test)]
                name = f"measured {own[0].temperature:g} °C ({source})"
                look = rr.SeriesPoints(colors=[MEASURED[k % 2]], markers="up", marker_sizes=5, names=name)
                height = np.full(len(own), self.floor + 2.0 + 4.0 * k)
                times = _over_frequency(np.array([p.frequency for p in own]))
                self._series(at(*_pair(pair), "level", "measured", f"{source} {test}"), times, height, look)

    def _level_at(self, frf: Frf, pair: Pair, frequency: float) -> float:
        value = frf.value[frf.response_nodes.index(pair[0]), frf.reference_nodes.index(pair[1])]
        return float(np.interp(frequency, frf.frequency, _decibel(value)))

    def _level_range(self) -> tuple[float, float]:
        """Limits of the level plots (dB) of the pairs that are shown."""
        shown = [_frf(t).value[_frf(t).response_nodes.index(r), _frf(t).reference_nodes.index(h)] for t in self.tests for r, h in self._shown_pairs()]
        level = _decibel(np.array(shown))
        return 10 * np.floor(np.percentile(level, 0.5) / 10) - 10, 10 * np.ceil(level.max() / 10)

    def _shown_pairs(self) -> list[Pair]:
        """Driving points first, then the response of every other hammer point to the first hammer, then one more cross point."""
        frf = _frf(self.tests[0])
        hammers, others = frf.reference_nodes, [n for n in frf.response_nodes if n not in frf.reference_nodes]
        first = hammers[0]
        return [(h, h) for h in hammers] + [(h, first) for h in hammers[1:2]] + [(n, first) for n in others[-2:-1] or others[:1]]

    # ------------------------------------------------------------ moving model

    def animations(self) -> None:
        """Mode shapes, and the answer to a force that sweeps the band, at the first temperature; on two timelines at once."""
        point = self.run.steps[0].point
        frequency = np.arange(self.band[0], self.band[1] + 1, self.step)
        motions = {_mode(i): content.mode_motion(point, m, len(frequency)) for i, m in enumerate(self.modes[0], 1)}
        motions["sweep"] = content.sweep_motion(point, self.spindle.hammer.hammer_nodes[0], frequency)
        times = [rr.TimeColumn("frequency", sequence=frequency), rr.TimeColumn("slow motion", duration=np.arange(len(frequency)) / CYCLE)]
        meshes = content.body_meshes(self.spindle)
        for name, motion in motions.items():
            for body, (place, turn) in content.poses(point, motion).items():
                if body in meshes:
                    entity = at("model", name, body)
                    self.recording.send_columns(entity, times, rr.Transform3D.columns(translation=place, quaternion=turn))
                    for mesh in meshes[body]:
                        vertices, triangles, normals = mesh.shaded()
                        local = MM * (vertices - [0.0, 0.0, point.chain.body(body).z])
                        colour = (255 * np.array(mesh.rgba)).astype(np.uint8)
                        shape = rr.Mesh3D(vertex_positions=local, triangle_indices=triangles, vertex_normals=normals, albedo_factor=colour)
                        self._static(at("model", name, body, mesh.region), shape)

    # ------------------------------------------------------------ section and bearings

    def section(self) -> None:
        """The deformed section: lowest against highest temperature in one picture, and every one on its timeline."""
        sections = [field(self.spindle, t) for t in self.temperatures]
        reach = max(g.r[1] for g in self.spindle.regions)
        factor = content.exaggeration(sections, reach)
        cold, hot = int(np.argmin(self.temperatures)), int(np.argmax(self.temperatures))
        for part in sections[0]:
            drawn = [
                content.section_mesh(
                    self.spindle,
                    s[part],
                    step.point.state.hub_movement if part == "rotating" else 0.0,
                    factor,
                    heat(t, self.temperatures),
                )
                for s, step, t in zip(sections, self.run.steps, self.temperatures, strict=True)
            ]
            for name, side, k in (("left", -1, cold), ("right", 1, hot)):
                vertices, triangles, colours = drawn[k]
                mesh = rr.Mesh3D(vertex_positions=vertices * [side, 1, 1], triangle_indices=triangles, vertex_colors=colours)
                self._static(at("section", "compared", name, part), mesh)
            self._section_over_temperature(part, drawn)
        for root in ("compared", "by temperature"):
            lines = [s * [side, 1, 1] for s in content.outlines(self.spindle) for side in (-1, 1)]
            self._static(at("section", root, "undeformed"), rr.LineStrips3D(lines, colors=[(255, 255, 255, 90)], radii=rr.Radius.ui_points(0.6)))
        top = MM * max(g.z[1] for g in self.spindle.regions)
        where = [(side * MM * reach * 0.8, 0, top) for side in (-1, 1)]
        texts = [f"{self.temperatures[k]:g} °C" for k in (cold, hot)]
        colours = [heat(self.temperatures[k], self.temperatures) for k in (cold, hot)]
        self._static("section/compared/temperature", rr.Points3D(where, labels=texts, colors=colours, radii=0.0))
        self._static("section/factor", rr.AnyValues(displacement_is_drawn_times=factor))
        self.factor = factor

    def _section_over_temperature(self, part: str, drawn: Sequence[Any]) -> None:
        entity = at("section", "by temperature", part)
        self._static(entity, rr.Mesh3D.from_fields(triangle_indices=drawn[0][1]))
        lengths = [len(vertices) for vertices, _, _ in drawn]
        columns = rr.Mesh3D.columns(
            vertex_positions=np.concatenate([d[0] for d in drawn]), vertex_colors=np.concatenate([d[2] for d in drawn])
        ).partition(lengths)
        self.recording.send_columns(entity, [self._over_temperature()], columns)

    def bearings(self) -> None:
        """The bearing states as series over temperature, and as charts."""
        temperature, panels = np.array(self.temperatures), {}
        for k, bearing in enumerate(self.spindle.bearings):
            for (name, unit), values in self._bearing_series(bearing.name).items():
                look = rr.SeriesLines(colors=[SIDES[k % 2]], names=f"{bearing.name}, {unit}")
                self._series(at("bearings", name, bearing.name), self._over_temperature(), values, look)
                curve = Curve(temperature, values, np.array(SIDES[k % 2]) if not name.startswith("outer") else np.array(SIDES[k % 2]) // 2)
                panels.setdefault((name, unit), []).append(curve)
        drawn = [(f"{name}, {unit}", "°C", curves) for (name, unit), curves in panels.items()]
        self._draw("charts/bearings", content.charts(drawn, 2, 195, 92))

    def _bearing_series(self, name: str) -> dict[tuple[str, str], Array]:
        states = [s.point.state.bearing(name) for s in self.run.steps]
        motions = [expand(self.spindle, t)[name] for t in self.temperatures]
        series = {
            ("contact angle", "deg"): [np.degrees(s.contact_angle) for s in states],
            ("deformation", "µm"): [1e6 * s.deformation for s in states],
            ("ball force", "N"): [s.contact_force for s in states],
            ("preload", "N"): [s.preload for s in states],
            ("radial stiffness", "N/µm"): [1e-6 * s.radial_stiffness for s in states],
            ("axial stiffness", "N/µm"): [1e-6 * s.axial_stiffness for s in states],
            ("outer - inner ring, r", "µm"): [1e6 * (m.outer_r - m.inner_r) for m in motions],
            ("outer - inner ring, z", "µm"): [1e6 * (m.outer_z - m.inner_z) for m in motions],
        }
        return {key: np.array(values) for key, values in series.items()}

    # ------------------------------------------------------------ records

    def records(self) -> None:
        """Hammer force and responses of the first hit of every hammer, as series over time and as charts."""
        panels: dict[tuple[str, str], list[Curve]] = {}
        hammers = self.spindle.hammer.hammer_nodes
        for step, test in zip(self.run.steps, self.tests, strict=True):
            record, colour = step.test.record, heat(test.temperature, self.temperatures)
            time = rr.TimeColumn("time", duration=record.time)
            look = rr.SeriesLines(colors=[colour], names=f"{test.temperature:g} °C")
            nodes = _frf(test).response_nodes
            for h, hammer in enumerate(hammers):
                self._series(at("records", f"hammer {hammer}", "force", test.id), time, record.force[h, 0], look)
                for node in dict.fromkeys((hammer, *(n for n in hammers if n != hammer))):
                    if node in nodes:
                        velocity = 1e3 * record.velocity[h, 0, nodes.index(node)]
                        self._series(at("records", f"hammer {hammer}", f"velocity {node}", test.id), time, velocity, look)
                start = slice(0, int(np.searchsorted(record.time, 0.005)))
                whole = slice(0, int(np.searchsorted(record.time, 0.1)))
                force = Curve(1e3 * record.time[start], record.force[h, 0, start], colour)
                answer = Curve(1e3 * record.time[whole], 1e3 * record.velocity[h, 0, nodes.index(hammer), whole], colour)
                panels.setdefault((f"force at {hammer}, N", "ms"), []).append(force)
                panels.setdefault((f"velocity at {hammer}, mm/s", "ms"), []).append(answer)
        self._draw("charts/records", content.charts([(t, u, c) for (t, u), c in panels.items()], 2, 195, 100))

    # ------------------------------------------------------------ helpers of the above

    def _series(self, entity: str, times: rr.TimeColumn, values: Array, look: rr.SeriesLines | rr.SeriesPoints) -> None:
        self._static(entity, look)
        self.recording.send_columns(entity, [times], rr.Scalars.columns(scalars=values))

    def _static(self, entity: str, what: rr.AsComponents) -> None:
        self.recording.log(entity, what, static=True)

    def _over_temperature(self) -> rr.TimeColumn:
        """Whole degrees where all are, else hundredths."""
        whole = all(float(t).is_integer() for t in self.temperatures)
        name, unit = ("temperature", 1.0) if whole else ("temperature, 0.01 C", 0.01)
        return rr.TimeColumn(name, sequence=np.round(np.array(self.temperatures) / unit).astype(int))

    def _draw(self, entity: str, drawing: content.Drawing) -> None:
        lines = rr.LineStrips2D(drawing.strips, colors=drawing.strip_colours, radii=rr.Radius.ui_points(0.8))
        self._static(f"{entity}/lines", lines)
        text = rr.Points2D(drawing.points, labels=drawing.labels, colors=drawing.label_colours, radii=0.0, show_labels=True)
        self._static(f"{entity}/labels", text)

    # ------------------------------------------------------------ blueprint

    def blueprint(self) -> rrb.Blueprint:
        hot = f"{max(self.temperatures):g}"
        cold = f"{min(self.temperatures):g}"
        left = rrb.Vertical(
            rrb.Grid(*self._model_views(), grid_columns=2, name="Model"),
            self._section_view("compared", f"Section, left {cold} °C, right {hot} °C; displacements enlarged"),
            row_shares=[2.3, 1],
        )
        middle = rrb.Tabs(*(self._frf_views(pair) for pair in self._shown_pairs()), name="Frequency response")
        right = rrb.Vertical(
            self._chart("bearings", "Bearings: lower blue, upper orange", 390, 368),
            self._chart("records", "First hits", 390, 200),
            rrb.TextDocumentView(origin="summary", name="Summary"),
            row_shares=[3.7, 2, 2.3],
        )
        return rrb.Blueprint(
            rrb.Tabs(
                rrb.Horizontal(left, middle, right, column_shares=[1.15, 1.45, 1], name="Overview"),
                self._time_tab(),
                self._temperature_tab(),
            ),
            rrb.BlueprintPanel(state="hidden"),
            rrb.SelectionPanel(state="hidden"),
            rrb.TimePanel(state="collapsed", timeline="frequency", fps=CYCLE * self.step, play_state="playing", loop_mode="all"),
            auto_views=False,
            auto_layout=False,
        )

    def _model_views(self) -> list[rrb.View]:
        shown = [(f"{i} {m.kind} {m.frequency:.0f} Hz", _mode(i)) for i, m in enumerate(self.modes[0][:5], 1)]
        shown.append((f"Force at {self.spindle.hammer.hammer_nodes[0]}, swept", "sweep"))
        reach = MM * max(g.r[1] for g in self.spindle.regions)
        eye = rrb.EyeControls3D(position=(1.9 * reach, -1.5 * reach, 1.5 * reach), look_target=(0, 0, 0.1 * reach), eye_up=(0, 0, 1))
        return [
            rrb.Spatial3DView(origin=at("model", entity), name=name, eye_controls=eye, line_grid=False, background=DARK) for name, entity in shown
        ]

    def _section_view(self, which: str, name: str) -> rrb.View:
        reach = MM * max(g.r[1] for g in self.spindle.regions)
        eye = rrb.EyeControls3D(position=(0, -2.1 * reach, 0.3 * reach), look_target=(0, 0, 0.3 * reach), eye_up=(0, 0, 1))
        return rrb.Spatial3DView(origin=at("section", which), name=name, eye_controls=eye, line_grid=False, background=DARK)

    def _frf_views(self, pair: Pair) -> rrb.Container:
        origin, label = at(*_pair(pair)), f"H({pair[0]},{pair[1]})"
        return rrb.Vertical(
            self._plot(f"{origin}/level", f"{label} level, dB re 1 (m/s)/N, over Hz", (self.floor, self.ceiling), self.band, True),
            self._plot(f"{origin}/phase", "phase, deg", (-180, 180), self.band),
            self._plot(f"{origin}/coherence", "coherence", (0, 1.02), self.band),
            row_shares=[2.6, 1, 1],
            name=label + (" driving point" if pair[0] == pair[1] else ""),
        )

    def _plot(
        self, origin: str, name: str, y: tuple[float, float] | None, x: tuple[int, int] | None, legend: bool = False
    ) -> rrb.TimeSeriesView:
        limits = None if x is None else rr.TimeRange(start=rr.TimeRangeBoundary.absolute(seq=x[0]), end=rr.TimeRangeBoundary.absolute(seq=x[1]))
        return rrb.TimeSeriesView(
            origin=origin,
            name=name,
            axis_x=rrb.TimeAxis(view_range=limits) if limits else None,
            axis_y=rrb.ScalarAxis(range=y) if y else None,
            plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=legend),
        )

    def _chart(self, entity: str, name: str, width: float, height: float) -> rrb.View:
        bounds = rrb.VisualBounds2D(x_range=(0, width), y_range=(0, height))
        return rrb.Spatial2DView(origin=f"charts/{entity}", name=name, visual_bounds=bounds, background=DARK)

    def _time_tab(self) -> rrb.Container:
        hammers = self.spindle.hammer.hammer_nodes
        views = []
        for hammer in hammers:
            views.append(rrb.TimeSeriesView(origin=at("records", f"hammer {hammer}", "force"), name=f"force of hammer {hammer}, N"))
            for node in hammers:
                origin = at("records", f"hammer {hammer}", f"velocity {node}")
                views.append(rrb.TimeSeriesView(origin=origin, name=f"velocity at {node}, mm/s, hammer {hammer}"))
        return rrb.Grid(*views, grid_columns=1 + len(hammers), name="Records (choose timeline: time)")

    def _temperature_tab(self) -> rrb.Container:
        names = [name for name, _ in self._bearing_series(self.spindle.bearings[0].name)]
        views: list[rrb.View] = [self._section_view("by temperature", "Deformed section")]
        views += [rrb.TimeSeriesView(origin=at("bearings", name), name=name) for name in names]
        return rrb.Grid(*views, grid_columns=3, name="Bearings and section (choose timeline: temperature)")


# ---------------------------------------------------------------- names and columns


def at(*parts: str) -> str:
    """The path of an entity from its parts, which may hold any characters."""
    return rr.new_entity_path(list(parts))


def _pair(pair: Pair) -> tuple[str, str, str]:
    return "frf", f"hammer_{pair[1]}", f"response_{pair[0]}"


def _mode(number: int) -> str:
    return f"mode_{number}"


def _frf(test: Test) -> Frf:
    assert test.frf is not None  # a virtual test has FRFs
    return test.frf


def _over_frequency(frequency: Array) -> rr.TimeColumn:
    return rr.TimeColumn("frequency", sequence=np.round(frequency).astype(int))


def _decibel(value: Array) -> Array:
    return 20 * np.log10(np.maximum(np.abs(value), 1e-15))
