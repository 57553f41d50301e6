"""The report of a run: one HTML file that needs no network, measured beside computed.

It is a list of sections, (title, HTML); other modules add theirs through `extra_sections`. Numbers are prepared here, drawn in
`report.figures.report` and set in `report.html.j2`. The same run gives the same file;
the command line adds when and how it was made (`stamp`).
"""

from __future__ import annotations

import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from string import ascii_lowercase
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from thermospindle.model.files.whole import whole
from thermospindle.model.machine import Spindle
from thermospindle.model.rotor.frf import frf, point_rows
from thermospindle.model.rotor.modes import group_energy
from thermospindle.model.scene.reading import content_hash, load
from thermospindle.model.units import RPM
from thermospindle.report.figures import report as plots
from thermospindle.report.figures.report import Curve
from thermospindle.report.page.comparison import SAME_TEMPERATURE, compared
from thermospindle.report.page.headlines import calibration, headlines, misses
from thermospindle.report.typeset import minus, signed, with_error
from thermospindle.sim.identification.frf import POWER
from thermospindle.sim.identification.numbering import identified, in_band, same_speed, temperature_of
from thermospindle.sim.operating import provenance
from thermospindle.sim.run import Run, Step
from thermospindle.thermal.expansion import influence
from thermospindle.thermal.temperature import region_temperatures

Section = tuple[str, str]
"""Title and HTML of one section."""
Chart = tuple[str, str, str, Mapping[str, Callable[[Any], float]]]
"""Key, caption, label and the quantities, read of a bearing's state, of one figure over temperature."""

MADE = "<!-- made by -->"
"""Where `stamp` writes the command and the date."""

def write_report(run: Run, path: Path, extra_sections: Sequence[Section] = ()) -> None:
    """Write the report to `path`, whole or not at all, and its pictures by themselves into the folder `pictures` beside it."""
    text = html(run, extra_sections)
    with whole(Path(path)) as file:
        file.write_text(text, encoding="utf-8")
    beside = Path(path).parent / "pictures"
    beside.mkdir(exist_ok=True)
    for name, picture in drawn(text).items():
        (beside / f"{name}.svg").write_text(picture, encoding="utf-8")


def drawn(page: str) -> dict[str, str]:
    """The pictures of a page as SVG files of their own, on white, by their descriptions in small
    letters with dashes; of several with one description the later ones are numbered."""
    found: dict[str, str] = {}
    for picture in re.finditer(r'<svg viewBox="(\S+) (\S+) (\S+) (\S+)"[^>]*aria-label="([^"]*)"[^>]*>(.*?)</svg>', page, re.DOTALL):
        left, top, width, height, description, inside = picture.groups()
        name = re.sub(r"[^a-z0-9]+", "-", Markup(description).unescape().lower().replace("µ", "u")).strip("-")
        name = next(n for n in (name, *(f"{name}-{k}" for k in range(2, 1000))) if n not in found)
        head = f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" width="{width}pt" height="{height}pt" viewBox="{left} {top} {width} {height}">'
        found[name] = f'{head}<title>{description}</title><rect x="{left}" y="{top}" width="{width}" height="{height}" fill="white"/>{inside}</svg>\n'
    return found


def html(run: Run, extra_sections: Sequence[Section] = ()) -> str:
    """The report as text; `extra_sections` stand between the results and the account of where they come from."""
    run = replace(run, steps=tuple(sorted(run.steps, key=temperature_of)))
    every = [*results(run), *extra_sections, *background(run)]
    return page(run.spindle, _conditions(run), every, "Report" if extra_sections else "Run")


def page(spindle: Spindle, conditions: str, sections: Sequence[Section], kind: str = "", of: str = "") -> str:
    """A page of the report's look with any sections, at `conditions` in words; `kind` (Run,
    Comparison, ...) begins its title, and what it is `of` follows."""
    return str(_page().page(spindle, conditions, [(title, Markup(named(body, title))) for title, body in sections], kind, of, Markup(MADE)))


SCROLLED = re.compile(r'<(figure class="chart wide"|div class="scroll")>(?=(?:<svg[^>]* aria-label="([^"]*)"|<table[^>]*>\s*<caption>(.*?)</caption>)?)', re.DOTALL)
"""What scrolls sideways on a narrow page, with the description of its picture or the caption of its table."""


def named(body: str, title: str) -> str:
    """The HTML of a section in which all that scrolls, at which the Tab key stops, has a name: of
    its picture or table, or else the section's title."""

    def name(found: re.Match[str]) -> str:
        plain = Markup(found[3] or found[2] or escape(title)).striptags()
        role = ' role="group"' if found[1].startswith("div") else ""  # a figure is one itself
        return f'<{found[1]}{role} aria-label="{escape(plain)}">'

    return SCROLLED.sub(name, body)


def write_page(folder: Path, spindle: Spindle, tests: int, campaign: str, sections: Sequence[Section], kind: str, name: str = "") -> None:
    """`report.html` on so many tests of a `campaign`, by its title; its `name` and the scene's are
    in the page's own title, for pages of one spindle side by side."""
    conditions = f"the conditions of {tests} test{'s' if tests > 1 else ''}: {campaign}"
    (folder / "report.html").write_text(page(spindle, conditions, sections, kind, f"{name or campaign} beside {spindle.name}"), encoding="utf-8")


def stamp(folder: Path, command: str, date: str) -> None:
    """Write into the pages of a folder, below their titles, with which command and when they were made."""
    line = f'<p class="under"><code>{escape(command)}</code>, {escape(date)}</p>'
    for file in folder.glob("*.html"):
        file.write_text(file.read_text(encoding="utf-8").replace(MADE, line, 1), encoding="utf-8")


def results(run: Run) -> list[Section]:
    """Computed results beside measured and published ones."""
    page, table = _page(), compared(run)
    cold, hot = table.temperatures
    steps = [s for s in run.steps if temperature_of(s) in (cold, hot)]
    picture = plots.comparison("modes", table.labels(), table.peaks, cold, hot) if cold != hot and table.rows else ""
    fig8 = plots.responses("frf", driving_points(run, steps), table.peaks, run.spindle.hammer.band)
    hottest = max(run.steps, key=lambda s: abs(temperature_of(s) - run.spindle.reference_temperature)).point
    drawn = plots.section("section", hottest) if run.spindle.regions else None
    found = [
        ("In short", page.short(headlines(run, table), misses(table), calibration(run.spindle), table)),
        ("Natural frequencies", page.frequencies(table, Markup(picture), table.sources())),
        ("Frequency response", page.responses(Markup(fig8), run, steps, table)),
    ]
    if run.spindle.bearings or run.spindle.roller_bearings:
        found.append(("Bearings over temperature", page.bearings(bearing_figures(run), run)))
    if drawn is not None:
        found.append(("Thermal deformation", page.deformation(Markup(drawn[0]), drawn[1], hottest)))
    return [*found, ("All modes", page.modes([(s, identified(s), in_band(s)) for s in run.steps], group_energy))]


def background(run: Run) -> list[Section]:
    """How the results were made, and from which numbers."""
    page, spindle, last = _page(), run.spindle, run.steps[-1].point
    mesh = influence(spindle, temperatures=region_temperatures(spindle, last.condition.temperature)) if spindle.regions else None
    origins = Counter(p.origin for p in spindle.provenance.values())
    values, unchanged = values_of_file(spindle)
    return [
        ("The virtual test", page.acquisition(run.steps[0].test)),
        *([("Finite element meshes", page.meshes(mesh, last.condition.temperature))] if mesh else []),
        ("Where the numbers come from", page.origins(spindle, origins, values, unchanged)),
        ("Versions", page.versions(provenance(spindle))),
    ]


# ---------------------------------------------------------------- figures


def driving_points(run: Run, steps: Sequence[Step]) -> dict[str, list[Curve]]:
    """Exact, virtually tested and measured mobility at every hammer point, by title.

    The exact one is evaluated under the test's exponential window, which evaluates an FRF at i omega + decay.
    """
    panels = {}
    for k, node in enumerate(run.spindle.hammer.hammer_nodes):
        letter, point = ascii_lowercase[k % 26] * (k // 26 + 1), run.spindle.point(node)
        curves = []
        for step in steps:
            estimate, decay = step.test.estimate.h1, step.test.estimate.window_decay
            lines = np.linspace(estimate.frequency[0], estimate.frequency[-1], 1600)
            row = point_rows(run.spindle, step.point.chain, (node,))
            shifted = np.asarray(lines - 1j * decay / (2 * np.pi) if decay else lines)
            exact = frf(step.point.linear, row, row, shifted, kind="mobility")[0, 0]
            curves.append(Curve("exact", temperature_of(step), lines, exact))
            i, j = estimate.response_nodes.index(node), estimate.reference_nodes.index(node)
            coherence = None if estimate.coherence is None else estimate.coherence[i, j]
            curves.append(Curve("test", temperature_of(step), estimate.frequency, estimate.value[i, j], coherence))
            curves += _measured_curves(run, step, node)
        panels[f"{letter}) struck and measured on the {run.spindle.structure.carrier(point.body)}: point {node} ({point.name}), along {point.axis[1].lower()}"] = curves
    return panels


def _measured_curves(run: Run, step: Step, node: int) -> Iterator[Curve]:
    for test in (t for c in run.measured for t in c.tests if t.frf is not None):
        near = abs(test.temperature - temperature_of(step)) <= SAME_TEMPERATURE and same_speed(test, run)
        if near and node in test.frf.response_nodes and node in test.frf.reference_nodes:  # type: ignore[union-attr]
            h = test.frf
            assert h is not None
            value = h.value[h.response_nodes.index(node), h.reference_nodes.index(node)]
            used = h.frequency > 0
            yield Curve("measured", temperature_of(step), h.frequency[used], value[used] / (2j * np.pi * h.frequency[used]) ** POWER[h.quantity])


def bearing_figures(run: Run) -> list[tuple[str, Markup]]:
    """Bearing states over temperature: (caption, SVG)."""
    temperature = [temperature_of(s) for s in run.steps]
    figures: tuple[Chart, ...] = (
        ("angle", "Contact angle.", "contact angle, degrees", {"": lambda b: np.degrees(b.contact_angle)}),
        (
            "deformation",
            "Deformation of one ball, both contacts.",
            "deformation, µm",
            {"": lambda b: b.deformation * 1e6},
        ),
        ("force", "Contact force of one ball.", "contact force, N", {"": lambda b: b.contact_force}),
        ("ball", "Stiffness of one ball.", "ball stiffness, N/µm", {"": lambda b: b.ball_stiffness * 1e-6}),
        ("preload", "Preload, the axial force of a bearing.", "preload, N", {"": lambda b: b.preload}),
        (
            "stiffness",
            "Radial and axial stiffness of one bearing.",
            "bearing stiffness, N/µm",
            {"radial": lambda b: b.radial_stiffness * 1e-6, "axial": lambda b: b.axial_stiffness * 1e-6},
        ),
    )
    of_rollers: tuple[Chart, ...] = (
        ("clearance", "Clearance of rollers across, negative where they are pressed.", "clearance, µm", {"": lambda b: b.clearance * 1e6}),
        ("roller", "Contact force of the most loaded roller.", "contact force, N", {"": lambda b: b.contact_force}),
        ("rollers", "Radial stiffness of a roller bearing.", "bearing stiffness, N/µm", {"": lambda b: b.radial_stiffness * 1e-6}),
    )
    states, rolling = ({b.name: [s.point.state.any_bearing(b.name) for s in run.steps] for b in kind} for kind in (run.spindle.bearings, run.spindle.roller_bearings))
    answer = []
    for own, charts in ((states, figures), (rolling, of_rollers)):
        for key, caption, label, quantities in charts if own else ():
            curves = {name: {b: [float(value(s)) for s in own[b]] for b in own} for name, value in quantities.items()}
            answer.append((caption, Markup(plots.trend(key, temperature, curves, label, from_zero=key not in ("angle", "clearance")))))
    return answer


# ---------------------------------------------------------------- numbers of the scene


def values_of_file(spindle: Spindle) -> tuple[dict[str, Any], bool]:
    """Numbers of the scene file by the keys of `spindle.provenance`, and whether the spindle still is the file's."""
    if spindle.file is None or not spindle.file.is_file():
        return {}, True
    values: dict[str, Any] = {}

    def walk(node: Any, key: str) -> None:
        if isinstance(node, Mapping):
            for name, value in node.items():
                walk(value, f"{key}.{name}" if key else name)
        elif isinstance(node, list) and node and isinstance(node[0], Mapping):
            for index, value in enumerate(node):
                walk(value, f"{key}.{value.get('name', value.get('node', index))}")
        elif key in spindle.provenance:
            values[key] = node

    walk(tomllib.loads(spindle.file.read_text(encoding="utf-8-sig")), "")
    return values, content_hash(load(spindle.file)) == content_hash(spindle)


# ---------------------------------------------------------------- the page


@cache
def _page() -> Any:
    """The macros of the template, which takes longer to compile than to fill."""
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"signed": signed, "with_error": with_error, "minus": minus}
    environment.globals |= {"RPM": RPM, "degrees": np.degrees}
    return environment.get_template("report.html.j2").module


def _conditions(run: Run) -> str:
    temperatures = ", ".join(f"{temperature_of(s):g}" for s in run.steps)
    speed = run.steps[0].point.condition.speed / RPM
    return f"{temperatures} °C, " + (f"{speed:.0f} rpm" if speed else "at rest")
