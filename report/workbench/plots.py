"""The pictures of the page as Bokeh figures: FRFs, the map of errors, the moving section. Colours of axes and grids are the page's, by CSS."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from bokeh.models import (
    ColumnDataSource,
    CustomJS,
    FactorRange,
    FixedTicker,
    HoverTool,
    LogTickFormatter,
    Patches,
    Range1d,
    SingleIntervalTicker,
    Toggle,
)  # fmt: skip
from bokeh.plotting import figure

from thermospindle.model.types import ComplexArray
from thermospindle.report.typeset import SMALLEST, UNITS, signed_short
from thermospindle.report.workbench.bench import Bench, Curves, Errors
from thermospindle.report.workbench.section import LARGEST, Piece
from thermospindle.report.workbench.shades import hexadecimal, shades
from thermospindle.report.workbench.state import Setting
from thermospindle.sim.posing import round_down

MEASURED, COMPUTED = "#d2691e", "#2f86d6"  # three to one and more on white and on black
FITTED, LEFT_OUT, CONDITIONS = "fitted", "left out", "conditions"
PERCENT = 5.0  # of change, the strongest colour where there are no errors
LEFT = 66  # px of both pictures of an FRF, so that their frequencies stand under each other
TOOLS = "xbox_zoom,reset"
FOCUS = ":focus-visible { outline: 3px solid var(--focus) !important; outline-offset: -3px; }"
Points = list[list[float]]


def _figure(label: str, **more: Any) -> Any:
    made = figure(sizing_mode="stretch_width", toolbar_location="above", html_attributes={"data-label": label}, stylesheets=[FOCUS], **more)
    made.toolbar.logo = None
    made.border_fill_color = made.background_fill_color = None
    made.xaxis.axis_label_text_font_style = made.yaxis.axis_label_text_font_style = "normal"
    return made


# ---------------------------------------------------------------- FRFs


class FrfPlots:
    """Magnitude and phase of one FRF, measured and computed, with the measured natural frequencies as ticks."""

    def __init__(self) -> None:
        self.computed, self.measured, self.peaks = (ColumnDataSource(data={"f": [], "size": [], "phase": []}) for _ in range(3))
        self.size = _figure("magnitude of the FRF", height=330, y_axis_type="log", tools=TOOLS, name="magnitude", x_range=Range1d(0, 1))
        self.phase = _figure("phase of the FRF", height=190, tools=TOOLS, name="phase", x_range=self.size.x_range, y_range=Range1d(-190, 190))
        for made, key in ((self.size, "size"), (self.phase, "phase")):
            made.line("f", key, source=self.measured, color=MEASURED, width=4, alpha=0.65)
            made.line("f", key, source=self.computed, color=COMPUTED, width=1.8)
            made.xaxis.axis_label = "frequency, Hz"
            made.min_border_left = LEFT
        self.size.vspan(x="f", source=self.peaks, line_color=MEASURED, line_dash="dotted", line_alpha=0.8)
        self.phase.yaxis.axis_label = "phase, deg"
        self.phase.yaxis.ticker = FixedTicker(ticks=[-180, -90, 0, 90, 180])
        self.size.yaxis.formatter = LogTickFormatter()

    def show(self, c: Curves) -> None:
        self.computed.data = _columns(c.frequency, c.computed)
        self.measured.data = _columns(c.frequency, c.measured) if c.measured is not None else {"f": [], "size": [], "phase": []}
        nothing = np.full(len(c.peaks), np.nan)
        self.peaks.data = {"f": c.peaks, "size": nothing, "phase": nothing}
        self.size.yaxis.axis_label = f"{c.quantity}, {UNITS[c.quantity]}"
        low, high = float(c.frequency[0]), float(c.frequency[-1])
        if (self.size.x_range.reset_start, self.size.x_range.reset_end) != (low, high):
            self.size.x_range.update(start=low, end=high, reset_start=low, reset_end=high)


def _columns(frequency: np.ndarray, value: ComplexArray) -> dict[str, np.ndarray]:
    """One curve; its phase from -170 to 190 degrees, so that the noise of what is about 180 draws no strokes across the figure."""
    phase = np.degrees(np.angle(value))
    return {"f": frequency, "size": np.maximum(np.abs(value), 1e-15), "phase": np.where(phase < -170, phase + 360, phase)}


# ---------------------------------------------------------------- the map of errors


class ErrorMap:
    """Errors of every mode in every test as coloured numbers; tests that are left out stand apart, with hatched cells.

    The columns `night` and `night_ink` are the colours of the dark page, which the page itself puts in the place of the others (labels.js).
    """

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.source = ColumnDataSource(data={k: [] for k in ("x", "y", "colour", "ink", "night", "night_ink", "text", "says", "hatch")})
        self.figure = _figure("map of errors", height=330, tools="", x_range=FactorRange(), y_range=FactorRange(), name="map")
        look = {"source": self.source, "width": 0.94, "height": 0.9}
        self.figure.rect("x", "y", fill_color="colour", line_color=None, hatch_pattern="hatch", hatch_color="ink", hatch_alpha=0.12, hatch_scale=14, **look)
        self.figure.text("x", "y", text="text", text_color="ink", text_align="center", text_baseline="middle", text_font_size="12px", source=self.source)
        self.figure.add_tools(HoverTool(tooltips=[("mode", "@y"), ("test", "@x"), ("", "@says"), ("error", "@text")]))
        self.figure.xaxis.major_label_orientation = 0.9
        self.figure.xaxis.group_text_font_size = "13px"
        self.figure.xaxis.separator_line_alpha = 0
        self.figure.grid.grid_line_color = None
        self.figure.axis.major_tick_line_color = self.figure.axis.axis_line_color = None

    def show(self, found: Errors, s: Setting, damping: bool) -> None:
        cells = [(c, c.damping if damping else c.frequency) for c in found.cells]
        there = [(c, v) for c, v in cells if v is not None]
        modes = sorted({c.mode for c in found.cells}, key=lambda m: (int(m.split()[0]), m))
        largest = max((abs(v) for _, v in there), default=0.0)
        largest, scale = (largest, 1.0) if self.bench.campaign else (SMALLEST, SMALLEST / PERCENT)
        factors = [self.place(test.id, s) for test in self.bench.shown]
        factors.sort(key=lambda place: place[0] == LEFT_OUT)  # in their order, those left out last
        if self.figure.x_range.factors != factors:
            self.figure.x_range.factors = factors
        if self.figure.y_range.factors != modes[::-1]:
            self.figure.y_range.factors = modes[::-1]
            self.figure.height = 130 + 30 * max(len(modes), 3)
        colours = [shades(scale * v, largest) for _, v in there]
        self.source.data = {
            "x": [self.place(c.test, s) for c, _ in there],
            "y": [c.mode for c, _ in there],
            **{name: [c[k] for c in colours] for k, name in enumerate(("colour", "ink", "night", "night_ink"))},
            "text": [signed_short(v) for _, v in there],
            "says": [c.says for c, _ in there],
            "hatch": ["right_diagonal_line" if c.test in s.left_out else "blank" for c, _ in there],
        }

    def place(self, test: str, s: Setting) -> tuple[str, str]:
        """(group, test) on the axis."""
        return (CONDITIONS if self.bench.campaign is None else LEFT_OUT if test in s.left_out else FITTED, test)


# ---------------------------------------------------------------- the moving section


class MovingSection:
    """The section, and a mode of it moving: the browser moves it, Python only says where every corner goes."""

    def __init__(self, drawn: Sequence[Piece]) -> None:
        self.drawn = drawn
        x, z = [p.x.tolist() for p in drawn], [p.z.tolist() for p in drawn]
        colours = [hexadecimal(p.rgb) for p in drawn]
        still: Points = [[0.0] * len(row) for row in x]
        self.motion = ColumnDataSource(data={"x": x, "z": z, "xa": still, "xb": still, "za": still, "zb": still})
        self.now = ColumnDataSource(data={"x": x, "z": z, "colour": colours})
        across, along = (np.concatenate([getattr(p, k) for p in drawn]) if drawn else np.zeros(1) for k in ("x", "z"))
        sides = [max(float(np.ptp(v)), 1.0) for v in (across, along)]
        half = [0.53 * side + LARGEST * max(sides) for side in sides]  # of what is shown: all of it, also where it moves to
        middle = float(along.min() + along.max()) / 2
        self.figure = _figure(
            "section, moving in the chosen mode", height=int(np.clip(400 * half[1] / half[0], 240, 520)), tools="", name="section", x_range=Range1d(-half[0], half[0]),
            y_range=Range1d(middle - half[1], middle + half[1]),
        )  # fmt: skip
        square = CustomJS(args={"figure": self.figure, "half": half, "middle": middle}, code=SQUARE)
        for size in ("inner_width", "inner_height"):
            self.figure.js_on_change(size, square)
        self.figure.toolbar_location = None
        self.figure.patches("x", "z", source=self.motion, fill_color=None, line_color="#84898f", line_alpha=0.5)
        moved = Patches(xs="x", ys="z", fill_color="colour", line_color="colour", fill_alpha=0.92)
        self.figure.add_glyph(self.now, moved)
        self.figure.grid.grid_line_color = None
        self.figure.xaxis.axis_label = "r, mm"
        self.figure.yaxis.axis_label = "z, mm"
        self.figure.axis.ticker = SingleIntervalTicker(interval=round_down(max(half) / 2))
        self.play = Toggle(label="Play", active=False, name="play", width=90)
        move = CustomJS(args={"motion": self.motion, "now": self.now, "play": self.play}, code=MOVE)
        self.play.js_on_change("active", move)
        self.motion.js_on_change("data", move)

    def show(self, moved: Sequence[tuple[ComplexArray, ComplexArray]]) -> None:
        start = [(p.x + x.real, p.z + z.real) for p, (x, z) in zip(self.drawn, moved, strict=True)]
        self.now.data = dict(self.now.data) | {"x": [x.tolist() for x, _ in start], "z": [z.tolist() for _, z in start]}
        parts = {"xa": [x.real for x, _ in moved], "xb": [x.imag for x, _ in moved], "za": [z.real for _, z in moved], "zb": [z.imag for _, z in moved]}
        self.motion.data = dict(self.motion.data) | {k: [row.tolist() for row in rows] for k, rows in parts.items()}


SQUARE = """
const { inner_width: w, inner_height: h } = figure
if (!(w > 0 && h > 0)) return
const unit = Math.max(2 * half[0] / w, 2 * half[1] / h)
figure.x_range.setv({ start: -unit * w / 2, end: unit * w / 2 })
figure.y_range.setv({ start: middle - unit * h / 2, end: middle + unit * h / 2 })
"""
"""A millimetre is as long along z as along r, whatever the width of the page."""
MOVE = """
play.label = play.active ? "Pause" : "Play"
const mine = window.spindle_loop = (window.spindle_loop ?? 0) + 1
const began = performance.now()
function at(phase) {
  const m = motion.data, c = Math.cos(phase), s = Math.sin(phase)
  for (let i = 0; i < m.x.length; i++) {
    for (let k = 0; k < m.x[i].length; k++) {
      now.data.x[i][k] = m.x[i][k] + c * m.xa[i][k] - s * m.xb[i][k]
      now.data.z[i][k] = m.z[i][k] + c * m.za[i][k] - s * m.zb[i][k]
    }
  }
  now.change.emit()
}
function step(time) {
  if (!play.active || window.spindle_loop !== mine) return
  at((time - began) / 1000 * 2 * Math.PI * 0.7)
  requestAnimationFrame(step)
}
if (play.active) requestAnimationFrame(step)
else at(0)
"""
"""Moves the section by requestAnimationFrame, 0.7 swings a second, in place: nothing goes back to Python. A new motion ends the old one."""
