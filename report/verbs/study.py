"""The verb `study`: many computations of one scene or several, kept as they come and gone on with after any interruption."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from matplotlib.figure import Figure
from rich.console import Console

from thermospindle.diagnosis.fleet import Fleet, apart
from thermospindle.model import sense
from thermospindle.model.errors import listed
from thermospindle.model.files.formats import SCENE
from thermospindle.model.machine import Condition, Spindle
from thermospindle.model.scene.fields import read_file
from thermospindle.model.scene.reading import content_hash, scene_path
from thermospindle.model.units import RPM
from thermospindle.report.figures import study as figures
from thermospindle.report.figures.common import save_all
from thermospindle.report.figures.designs import compared
from thermospindle.report.folder import digest
from thermospindle.report.log.study.log import write_study_log
from thermospindle.report.progress import progress_bar
from thermospindle.report.text.designs import show_designs
from thermospindle.report.text.grid import show_grid
from thermospindle.report.verbs.answer import Answer, with_effects
from thermospindle.sim.study.comparison import Designs, comparison, designs
from thermospindle.sim.study.executors import Executor, on_cluster, on_this_machine
from thermospindle.sim.study.form import COMPARISON, FLEET, MONTE_CARLO, Study, read_study
from thermospindle.sim.study.parts import RESULTS, fill, opened, versions, write, write_table
from thermospindle.sim.study.rows import Cases, cases
from thermospindle.sim.study.sensitivity import APART
from thermospindle.sim.study.summary import summary
from thermospindle.sim.study.variants import check

SUMMARY, LOG = "summary.json", "study.rrd"
OUTLIERS, CONDITIONS = 20, 6  # shown


def study(file: Path, cluster: str | None = None, effect_files: Sequence[Path] = (), out: Path | None = None) -> Answer:
    """Do a study, or go on with it: results stand in `out` (out/NAME by default) as they come, figures and summary when all are there."""
    asked = read_study(Path(file))
    spindle, catalogue = with_effects(asked.scene, effect_files)
    scene = scene_path(asked.scene)
    spindles = [spindle, *(with_effects(other, effect_files)[0] for other in asked.scenes[1:])]
    of: Cases | Fleet | Designs
    if asked.kind == FLEET:
        of = Fleet(spindle, asked.campaigns, catalogue, asked.work == "diagnose")
    elif asked.kind == COMPARISON:
        of = designs(asked, spindles, catalogue)
    else:
        raw = read_file(SCENE, scene)
        check(asked, raw, scene, spindle, catalogue)
        of = cases(asked, raw, scene, spindle, catalogue)
    doubts = [] if asked.kind == FLEET else _doubts(asked, spindles)
    scenes = ", ".join(s.name for s in spindles)
    place = Path("out") / asked.file.stem if out is None else Path(out)
    key: dict[str, Any] = {"study": asked.digest, "scene": content_hash(spindle), "effects": [digest(Path(f)) for f in effect_files]}
    if asked.kind == FLEET:
        key["campaigns"] = {str(k): _content(folder) for k, folder in enumerate(asked.campaigns)}
    if asked.kind == COMPARISON:
        key["scenes"] = {name: content_hash(s) for name, s in zip(asked.designs, spindles, strict=True)}
    with opened(place, key, of.count, asked.chunk, of.schema()) as folder, _executor(cluster) as run:
        there = folder.count - len(folder.missing())
        with progress_bar(folder.count - there) as progress:
            fill(folder, of.rows, run, progress)
        table = folder.table()
        told, drawn = _told(of, table)
        values = {"title": asked.title, "kind": asked.kind, "scene": scenes, "cases": of.count, **told}
        write_table(table, folder.path / RESULTS)
        write(folder.path / SUMMARY, json.dumps(values, indent=1))
        save_all(figures.headed(drawn, asked.title, [s.name for s in spindles]), folder.path, 140)
        write_study_log(spindles, values, table, drawn, folder.path / LOG)
    values |= {"out": str(place), "parts": folder.count, "parts_found": there, "warnings": [*doubts, *_warnings(values)]}

    def show(console: Console) -> None:
        console.print(f"{asked.title}: {of.count} cases of {scenes}" + (f", {there} of {folder.count} parts found there" if there else ""))
        {FLEET: _show_fleet, COMPARISON: show_designs}.get(asked.kind, _show)(console, values)
        console.print(f"\n{place}: {RESULTS}, {SUMMARY}, {LOG}, {', '.join(f'{name}.png' for name in drawn)}", soft_wrap=True)

    return Answer(values, show)


def _doubts(asked: Study, spindles: Sequence[Spindle]) -> list[str]:
    """What is doubtful about the conditions of a study: a sentence that every design would say is
    said once, any other with the name of its design."""
    said: dict[str, list[str]] = {}
    for name, spindle in zip(asked.designs or (spindles[0].name,), spindles, strict=True):
        conditions = [Condition(t, n * RPM) for t in asked.temperatures or spindle.temperatures for n in (min(asked.speeds), max(asked.speeds))]
        for sentence in sense.of_conditions(spindle, conditions):
            said.setdefault(sentence, []).append(name)
    return [sentence if len(names) == len(spindles) else f"{listed(names)}: {sentence}" for sentence, names in said.items()]


@contextmanager
def _executor(cluster: str | None) -> Iterator[Executor]:
    if cluster is None:
        yield on_this_machine
    else:
        with on_cluster(cluster, versions) as run:
            yield run


def _content(campaign: Path) -> str:
    """A name for what a campaign folder holds."""
    parts = [(p.relative_to(campaign).as_posix(), digest(p)) for p in sorted(campaign.rglob("*")) if not p.is_dir()]
    return hashlib.sha256(json.dumps([campaign.name, parts]).encode()).hexdigest()[:16]


def _told(of: Cases | Fleet | Designs, table: pa.Table) -> tuple[dict[str, Any], dict[str, Figure]]:
    if isinstance(of, Fleet):
        return _fleet_told(table)
    if isinstance(of, Designs):
        told = comparison(of, table)
        return told, compared(told)
    told = summary(of, table)
    return told, figures.monte_carlo(of, table, told) if of.study.kind == MONTE_CARLO else figures.sweep(of, table)


def _fleet_told(table: pa.Table) -> tuple[dict[str, Any], dict[str, Figure]]:
    """Campaigns with the largest error first, those without one last, and what of them lies beyond `APART` robust standard deviations."""
    rows = table.to_pylist()
    distance = apart(rows)
    order = sorted(range(len(rows)), key=lambda k: np.inf if rows[k]["rms_residual"] is None else -rows[k]["rms_residual"])
    found = [
        {"campaign": rows[k]["campaign"], "of": name, "z": float(z[k])}
        for name, z in distance.items()
        for k in range(len(rows))
        if np.isfinite(z[k]) and abs(z[k]) > APART
    ]
    found.sort(key=lambda o: -abs(o["z"]))
    errors = [r["error"] for r in rows if r["error"]]
    ranked = [{key: value for key, value in rows[k].items() if key != "case"} for k in order]
    told = {"rows": len(rows), "errors": len(errors), "first_error": errors[0] if errors else None, "ranking": ranked, "outliers": found}
    return told, figures.fleet(rows, distance)


def _warnings(values: dict[str, Any]) -> list[str]:
    if not values["errors"]:
        return []
    return [f"{values['errors']} of {values['rows']} rows have no result, and say why in their column error; the first: {values['first_error']}"]


# ---------------------------------------------------------------- for people


def _show(console: Console, values: dict[str, Any]) -> None:
    sobol = any("indices" in m for c in values["conditions"] for m in c["modes"])
    for c in values["conditions"][:CONDITIONS]:
        rows = [_line(f"{m['mode']} {m['kind']}, Hz", m["nominal_Hz"], m) for m in c["modes"]]
        rows += [_line(f"preload {name}, N", p["nominal"], p) for name, p in c["preload_N"].items()]
        for key, label in (("rro_um", "RRO"), ("nrro_six_sigma_um", "NRRO, 6 s.d.")):
            rows += [_line(f"{label} {probe}, um", own["nominal"], own) for probe, own in c.get(key, {}).items()]
        lost = {name: share for name, share in c["in_contact"].items() if share is not None and share < 1}
        head = ["", "scene", *(["mean", "s.d.", "2.5 %", "97.5 %", "most by", "first orders" if sobol else "r2"] if values["kind"] == MONTE_CARLO else ["least", "most"])]
        show_grid(console, f"{c['temperature_C']:g} C, {c['speed_rpm']:g} rpm", head, rows, ("", "most by"))
        for name, share in lost.items():
            console.print(f"{name} has contact in {100 * share:.1f} % of them")
    if (more := len(values["conditions"]) - CONDITIONS) > 0:
        console.print(f"{more} more conditions stand in {SUMMARY}")
    for name, u in values.get("unloads_C", {}).items():
        if u["share"]:
            s = u["spread"]
            at = f", first lost or had at {s['mean']:.1f} +- {s['sd']:.1f} C" if s else ""
            console.print(f"{name} has no contact at some temperature of the study in {100 * u['share']:.1f} % of the draws{at}")


def _line(label: str, nominal: float, own: dict[str, Any]) -> list[str]:
    if "least" in own:
        return [label, *_alike(nominal, own["least"], own["most"])]
    s = own["spread"]
    cells = [label, *(_alike(nominal, *[None] * 4) if s is None else _alike(nominal, s["mean"], s["sd"], s["quantiles"][0], s["quantiles"][-1]))]
    if shares := own.get("indices"):
        named = [f"{name} {c['total']:.2f}" for name, c in shares["of"].items() if c["clear"]][:2]
        return [*cells, ", ".join(named) or "-", f"{sum(c['first'] for c in shares['of'].values()):.2f}"]
    if (sensitive := own.get("sensitivity")) is None:
        return [*cells, "-", "-"]
    most = [f"{name} {c['value']:+z.2f}" for name, c in sensitive["coefficients"].items() if c["clear"] and abs(c["value"]) >= 0.005][:2]
    return [*cells, ", ".join(most) or "-", f"{sensitive['r2']:.3f}"]


def _show_fleet(console: Console, values: dict[str, Any]) -> None:
    diagnosed = any("verdict" in r for r in values["ranking"])
    head = ["campaign", "rms residual", "worst", "modes", "missing", "extra"] + (["verdict", "effects"] if diagnosed else [])
    rows = []
    for r in values["ranking"]:
        cells = [r["campaign"], *(_short(r[k]) for k in ("rms_residual", "worst_residual", "modes", "missing", "extra"))]
        rows.append(cells + ([r["verdict"] or "-", ", ".join(r["effects"] or [])] if diagnosed else []))
    show_grid(console, "The largest error first, in standard errors", head, rows, ("campaign", "verdict", "effects"))
    for o in values["outliers"][:OUTLIERS]:
        console.print(f"{o['campaign']} stands apart: {o['of']} {o['z']:+z.1f} robust standard deviations from the fleet's middle")
    if not values["outliers"]:
        console.print(f"None stands more than {APART:g} robust standard deviations from the fleet's middle.")


def _alike(*values: float | None) -> list[str]:
    """Numbers of one row, to the decimal that is the fifth digit of the largest."""
    largest = max((abs(v) for v in values if v), default=1.0)
    decimals = int(np.clip(4 - np.floor(np.log10(largest)), 0, 9))
    return ["-" if v is None else f"{v:.{decimals}f}" for v in values]


def _short(value: float | None) -> str:
    return "-" if value is None else f"{value:.5g}"
