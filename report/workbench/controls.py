"""The controls: a slider for every parameter of the effects that were added, and for every tolerance; which of them are fitted."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from bokeh.models import Button, Checkbox, Column, CustomJSTickFormatter, Div, NumericInput, Row, Select, Slider, Toggle
from markupsafe import Markup

from thermospindle.report.typeset import unit_cell
from thermospindle.report.workbench.bench import Bench
from thermospindle.report.workbench.state import (
    FURTHEST,
    Setting,
    key_of,
    remove_effect,
    set_deviation,
    set_free,
    set_value,
    span,
    span_of_tolerance,
)  # fmt: skip
from thermospindle.sim.effects.effect import Effect, Parameter, called
from thermospindle.sim.posing import round_down

STEPS = 400  # of a slider, about
WIDE: Any = {"sizing_mode": "stretch_width"}
LOOK = """
:host { color: var(--ink); font: inherit; }
label, .bk-input-group, .bk-slider-title, .bk-slider-value { color: var(--ink); font-size: 0.92rem; }
.bk-input { color: var(--ink); background: var(--paper); border: 1px solid var(--soft); min-height: 2.1rem; }
.bk-btn { color: var(--ink); background: var(--shade); border: 1px solid var(--soft); min-height: 2.1rem; }
.bk-btn:hover { background: var(--line); }
.bk-btn.bk-active { color: var(--paper); background: var(--accent); border-color: var(--accent); }
.bk-btn[disabled], .bk-btn[disabled]:hover { color: var(--soft); background: var(--paper); border: 1px dashed var(--line); opacity: 1; }
select.bk-input:not([multiple]) { background-image: linear-gradient(45deg, transparent 50%, var(--ink) 50%), linear-gradient(-45deg, transparent 50%, var(--ink) 50%);
  background-size: 5px 6px; background-position: right 13px center, right 8px center; background-repeat: no-repeat; }
.bk-slider-title { white-space: normal; line-height: 1.2; font-size: 0.87rem !important; }
.noUi-target { background: var(--line); border: none; box-shadow: none; }
.noUi-connect { background: color-mix(in srgb, var(--accent) 45%, transparent) !important; }
.noUi-handle { background: var(--paper); border: 2px solid var(--accent); box-shadow: none; }
.noUi-tooltip { color: var(--ink); background: var(--paper); }
.bk-input-group > .bk-inline { flex-wrap: wrap; }
p { margin: 0.2rem 0; } .soft { color: var(--soft); } .bad { color: var(--bad); font-weight: 600; }
h3 { font-size: 0.98rem; margin: 0.5rem 0 0; }
table { border-collapse: collapse; font-size: 0.9rem; font-variant-numeric: tabular-nums; width: 100%; }
th, td { padding: 0.25rem 0.5rem 0.25rem 0; text-align: right; border-bottom: 1px solid var(--line); font-weight: 400; vertical-align: top; }
th:first-child { text-align: left; } td { white-space: nowrap; } thead th { font-weight: 600; }
.bk-inline { display: flex; flex-wrap: wrap; gap: 0.2rem 0.9rem; }
.bk-inline > label { margin: 0 !important; }
.bk-input:focus-visible, .bk-btn:focus-visible, .noUi-handle:focus-visible, input:focus-visible
  { outline: 3px solid var(--focus) !important; outline-offset: 2px; box-shadow: none; }
"""
"""The page's colours inside of Bokeh's widgets, and a focus that is seen."""
PLAIN, PERCENT = "return parseFloat(tick.toPrecision(5)).toString()", "return (100 * tick).toFixed(2) + ' %'"

class Change(Protocol):
    """Called with what makes a setting of a setting, whether a slider is still being dragged, and which one it is."""

    def __call__(self, action: Callable[[Setting], Setting], dragging: bool, slider: str = "") -> None: ...


def labelled(name: str) -> dict[str, str]:
    """The attribute from which the page's script names what the browser could not."""
    return {"data-label": name}


class Controls:
    """Rows for the effects and tolerances of a setting; `change` is told what a user does."""

    def __init__(self, bench: Bench, s: Setting, change: Change) -> None:
        self.bench, self.change = bench, change
        self.sliders: dict[str, Slider | Select] = {}
        self.ticks: dict[str, Checkbox] = {}
        self.numbers: dict[str, tuple[NumericInput, float]] = {}  # and what a value is multiplied with to be shown there
        self.rows: dict[str, Column] = {}
        options = [("", "choose an effect (by keys: arrows, then Enter) ..."), *((e.name, f"{e.name}: {e.title}") for e in bench.effects)]
        self.add = Select(title="Add an effect", value="", options=options, stylesheets=[LOOK], name="add", **WIDE)
        self.effects = Column(**WIDE)
        self.tolerances = Column(*(self._tolerance(t.name, t.sd, s) for t in bench.tolerances), visible=False, **WIDE)
        self.open = Toggle(label=f"Tolerances ({len(bench.tolerances)})", stylesheets=[LOOK], name="tolerances", **WIDE)
        self.open.on_change("active", lambda attr, old, new: self.tolerances.update(visible=new))
        self.show(s)

    def show(self, s: Setting) -> None:
        """Bring every control to a setting; rows stay where they are."""
        for name in [n for n in self.rows if n not in s.effects]:
            del self.rows[name]
            for key in [k for k in self.sliders if k.rpartition(".")[0] == name]:
                del self.sliders[key]
                self.ticks.pop(key, None)
                self.numbers.pop(key, None)
        for name in s.effects:
            if name not in self.rows:
                self.rows[name] = self._effect(self.bench.effect(name), s)
        children = [self.rows[name] for name in s.effects]
        if self.effects.children != children:
            self.effects.children = children
        for name, values in s.effects.items():
            for p in self.bench.effect(name).parameters:
                self._bring(key_of(name, p.name), values[p.name], span(p, values[p.name]))
        for t in self.bench.tolerances:
            value = s.deviations.get(t.name, 0.0)
            self._bring(t.name, value, span_of_tolerance(t.sd, value))
        for key, tick in self.ticks.items():
            if tick.active != (key in s.free):
                tick.active = key in s.free

    def _bring(self, key: str, value: float, ends: tuple[float, float]) -> None:
        control = self.sliders[key]
        if isinstance(control, Select):
            if control.value != f"{value:g}":
                control.value = f"{value:g}"
            return
        low, high = min(control.start, ends[0]), max(control.end, ends[1])
        if (control.start, control.end) != (low, high):
            control.update(start=low, end=high)
        if control.value != value:
            control.value = value
        number, times = self.numbers[key]
        if number.value != (shown := rounded(times * value)):
            number.value = shown

    # ------------------------------------------------------------ rows

    def _effect(self, effect: Effect, s: Setting) -> Column:
        head = Div(text=str(Markup("<h3>{}</h3><p class=soft>{}</p>").format(effect.name, effect.title)), stylesheets=[LOOK], **WIDE)
        drop = Button(label="Remove", stylesheets=[LOOK], width=90, html_attributes=labelled(f"remove {effect.name}"))
        drop.on_click(lambda: self.change(lambda now: remove_effect(now, effect.name), False))
        rows = [self._parameter(effect, p, s) for p in effect.parameters]
        return Column(Row(head, drop, **WIDE), *rows, **WIDE)

    def _parameter(self, effect: Effect, p: Parameter, s: Setting) -> Row:
        key, value, unit = key_of(effect.name, p.name), s.effects[effect.name][p.name], "" if p.unit == "1" else f", {unit_cell(p.unit)}"
        says = {**labelled(f"{p.name}{unit}"), "title": p.meaning}
        if p.choices:
            options = [(f"{c:g}", called(p, c, self.bench.spindle) or f"{c:g}") for c in p.choices]
            chosen = Select(title=p.name, value=f"{value:g}", options=options, stylesheets=[LOOK], description=None, html_attributes=says, **WIDE)
            chosen.on_change("value", lambda attr, old, new: self._set(effect.name, p.name, float(new), False))
            self.sliders[key] = chosen
            return Row(chosen, **WIDE)
        slider = self._slider(key, f"{p.name}{unit}", span(p, value), value, PLAIN, says, lambda v, dragging: self._set(effect.name, p.name, v, dragging))
        number = self._number(key, value, 1.0, lambda v: self._set(effect.name, p.name, min(max(v, p.limits[0]), p.limits[1]), False))
        return Row(slider, number, self._tick(key, s), **WIDE)

    def _set(self, effect: str, parameter: str, value: float, dragging: bool) -> None:
        self.change(lambda s: set_value(s, effect, parameter, value) if effect in s.effects else s, dragging, key_of(effect, parameter))

    def _tolerance(self, name: str, sd: float, s: Setting) -> Row:
        value, title = s.deviations.get(name, 0.0), f"{name}, % (±\u00a0{100 * sd:.3g})"

        def take(v: float, dragging: bool) -> None:
            self.change(lambda s: set_deviation(s, name, v), dragging, name)

        slider = self._slider(name, title, span_of_tolerance(sd), value, PERCENT, labelled(name), take)
        low, high = FURTHEST
        number = self._number(name, slider.value, 100.0, lambda v: self.change(lambda s: set_deviation(s, name, min(max(v, low), high)), False))
        return Row(slider, number, self._tick(name, s), **WIDE)

    def _slider(
        self, key: str, title: str, ends: tuple[float, float], value: float, shown: str, says: dict[str, str], take: Callable[[float, bool], None]
    ) -> Slider:
        """Between `ends`; `take` is told its value, and whether it is still being dragged."""
        slider = Slider(
            title=title, start=ends[0], end=ends[1], value=value, step=step_of(*ends), format=CustomJSTickFormatter(code=shown), stylesheets=[LOOK], tooltips=False,
            show_value=False, name=key, html_attributes=says, **WIDE,
        )  # fmt: skip
        slider.on_change("value", lambda attr, old, new: take(new, True))
        slider.on_change("value_throttled", lambda attr, old, new: take(new, False))
        self.sliders[key] = slider
        return slider

    def _number(self, key: str, value: float, times: float, take: Callable[[float], None]) -> NumericInput:
        """The value to be typed, times a factor (100: percent); a slider's own steps are round ones."""
        number = NumericInput(value=rounded(times * value), mode="float", width=84, stylesheets=[LOOK], html_attributes=labelled(f"{key} as a number"), name=f"number {key}")

        def typed(attr: str, old: float | None, new: float | None) -> None:
            if new is not None and new != rounded(times * self.sliders[key].value):
                take(new / times)

        number.on_change("value", typed)
        self.sliders[key].on_change("value", lambda attr, old, new: number.update(value=rounded(times * new)))
        self.numbers[key] = number, times
        return number

    def _tick(self, key: str, s: Setting) -> Checkbox:
        tick = Checkbox(label="fit", active=key in s.free, width=52, stylesheets=[LOOK], html_attributes=labelled(f"fit {key}"), name=f"fit {key}", visible=self.bench.campaign is not None)
        tick.on_change("active", lambda attr, old, new: self.change(lambda s: set_free(s, key, new), False))
        self.ticks[key] = tick
        return tick


def rounded(value: float) -> float:
    """As it is shown."""
    return float(f"{value:.5g}")


def step_of(low: float, high: float) -> float:
    """A round step, about `STEPS` of them from one end to the other."""
    return float(f"{round_down((high - low) / STEPS):.6g}")
