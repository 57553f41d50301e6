"""The Rerun log of a study: every number of it as a series over the timeline `case`, its figures, and its summary.

`series/` holds natural frequencies by mode and what else each case gives, a line for each condition (of a fleet
the error of each campaign); `numbers/rows` holds the same bit for bit, and `report.log.read` reads them back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr
import rerun.blueprint as rrb
from matplotlib.figure import Figure

from thermospindle.model.machine import Spindle
from thermospindle.model.types import Array
from thermospindle.report.figures.common import colour
from thermospindle.report.log.columns import curve_look, log_curve, log_words, number_column, whole_log
from thermospindle.report.log.drawing import light
from thermospindle.report.log.pictures import log_figure, view
from thermospindle.report.log.study.series import series_of
from thermospindle.report.log.views import at, summary_view, window
from thermospindle.sim.operating import provenance

CASE = "case"

Told = dict[str, Any]


def write_study_log(spindles: Sequence[Spindle], told: Mapping[str, Any], table: pa.Table, drawn: Mapping[str, Figure], path: Path) -> None:
    """Write the log, whole or not at all; `told` is the study's summary, `drawn` its figures by
    name. BadInput if its folder does not exist."""
    series = series_of(table)
    about = {key: told[key] for key in ("title", "kind", "cases", "rows", "errors")} | provenance(spindles[0])
    about |= {key: ", ".join(provenance(s)[key] for s in spindles) for key in ("scene", "scene_hash")}
    with whole_log(path, "study", f"{told['title']}, {about['scene']}", about, blueprint(series, drawn)) as recording:
        _log_series(recording, series)
        _log_rows(recording, table)
        for name, figure in drawn.items():
            log_figure(recording, at("charts", name), figure)
        log_words(recording, "summary", _summary(told))


def _log_series(recording: rr.RecordingStream, series: Mapping[str, Mapping[str, tuple[Array, Array]]]) -> None:
    for name, by_condition in series.items():
        every = max(([*own] for own in series.values() if by_condition.keys() <= own.keys()), key=len)  # a mode that some conditions alone have is coloured as there
        for condition, (case, values) in by_condition.items():
            look = curve_look(light(colour(every.index(condition), range(max(2, len(every))))), condition, 1.5)
            log_curve(recording, at("series", name, condition), rr.TimeColumn(CASE, sequence=case), values, look)


def _log_rows(recording: rr.RecordingStream, table: pa.Table) -> None:
    """Columns of numbers as they stand in `results.parquet`, a row a row."""
    columns: list[Any] = []
    for field in table.schema:
        if field.type in (pa.float64(), pa.int64()):
            columns += number_column(field.name, np.array(table[field.name].to_pylist(), float))
    recording.send_columns("numbers/rows", [rr.TimeColumn("row", sequence=np.arange(len(table)))], columns)


def _summary(told: Mapping[str, Any]) -> str:
    """Markdown: what the study says, a table a condition, or campaigns with the largest error first."""
    lines = [f"# {told['title']}", "", f"{told['kind']}, {told['cases']} cases, {told['rows']} rows, {told['errors']} without a result", ""]
    for c in told.get("conditions", []):
        lines += [f"## {c['temperature_C']:g} °C, {c['speed_rpm']:g} rpm", ""]
        if "figures" in c:
            lines += [*_designs(c["figures"]), ""]
            continue
        lines += ["| | scene | from | to |", "|---|---|---|---|"]
        for m in c["modes"]:
            lines.append(_row(f"mode {m['mode']} {m['kind']}, Hz", m["nominal_Hz"], m))
        for name, p in c["preload_N"].items():
            lines.append(_row(f"preload {name}, N", p["nominal"], p))
        for key in ("rro_um", "nrro_six_sigma_um"):
            lines += [_row(f"{key.partition('_um')[0]} {probe}, um", own["nominal"], own) for probe, own in c.get(key, {}).items()]
        lines.append("")
    if "ranking" in told:
        lines += ["| campaign | rms residual |", "|---|---|"]
        lines += [f"| {_cell(r['campaign'])} | {'-' if r['rms_residual'] is None else format(r['rms_residual'], '.4g')} |" for r in told["ranking"]]
    return "\n".join(lines) + "\n"


def _designs(figures: Mapping[str, Any]) -> list[str]:
    names = list(next(iter(figures.values()))["designs"])
    lines = ["| | " + " | ".join(map(_cell, names)) + " |", "|---" * (1 + len(names)) + "|"]
    for figure, own in figures.items():
        values = [(d.get("spread") or {}).get("mean", d["nominal"]) for d in own["designs"].values()]
        lines.append(f"| {_cell(figure)} | " + " | ".join("-" if v is None else f"{v:.6g}" for v in values) + " |")
    return lines


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;")


def _row(label: str, nominal: float, own: Told) -> str:
    ends = (own["spread"] or {}).get("quantiles", (None, None)) if "spread" in own else (own["least"], own["most"])
    cells = [nominal, ends[0], ends[-1]]
    return f"| {_cell(label)} | " + " | ".join("-" if v is None else f"{v:.6g}" for v in cells) + " |"


def blueprint(series: Mapping[str, Any], drawn: Mapping[str, Figure]) -> rrb.Blueprint:
    """Series over the cases on the left, in a grid; the figures and the summary on the right."""
    views = [rrb.TimeSeriesView(origin=at("series", name), name=name, plot_legend=rrb.PlotLegend(visible=k == 0)) for k, name in enumerate(series)]
    pictures = [view(at("charts", name), name, tuple(figure.get_size_inches())) for name, figure in drawn.items()]
    right: list[Any] = [rrb.Tabs(*pictures)] if pictures else []
    return window(rrb.Horizontal(rrb.Grid(*views, grid_columns=2), rrb.Vertical(*right, summary_view()), column_shares=[1.2, 1]), CASE)
