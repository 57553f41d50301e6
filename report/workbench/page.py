"""The page of one browser tab: it shows a session, and turns what a user does into actions on it.
All computing is in `bench`, all states in `state`.

While a slider is dragged, only the newest value is computed; where all tests together take longer than `SMOOTH`, only the shown
one is, and where that takes longer than `SMOOTH` too, nothing until the slider is let go. The page says which of these it does.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from bokeh.document import Document
from bokeh.models import Button, CheckboxGroup, Div, RadioButtonGroup, Select, TextInput
from markupsafe import escape

from thermospindle.diagnosis.forward.model import FAILED
from thermospindle.report.workbench import explanations as told
from thermospindle.report.workbench import lines, words
from thermospindle.report.workbench.bench import Bench, Errors, Shown, channels, curves, errors, fitted, modes_of
from thermospindle.report.workbench.controls import LOOK, WIDE, Controls, labelled
from thermospindle.report.workbench.explanations import Explanations
from thermospindle.report.workbench.plots import ErrorMap, FrfPlots, MovingSection
from thermospindle.report.workbench.save import save
from thermospindle.report.workbench.section import moving, pieces
from thermospindle.report.workbench.state import (
    Session,
    Setting,
    add_effect,
    amend,
    computed,
    do,
    keep,
    key_of,
    leave_out,
    redo,
    set_named,
    take_up,
    undo,
)  # fmt: skip
from thermospindle.report.workbench.work import Work

SMOOTH = 0.15  # s, up to which something is computed while a slider is dragged
AGAIN = 1.0  # s
RECENT = 5  # times that something was computed, of which the shortest counts


class Page:
    """Widgets by name, the session, and what was last computed."""

    def __init__(self, bench: Bench, document: Document, out: Path, known: Explanations | None = None) -> None:
        self.bench, self.document, self.out, self.known = bench, document, out, known
        self.session = Session(Setting(left_out=frozenset(bench.left_out), free=frozenset(t.name for t in bench.tolerances) if bench.campaign else frozenset()))
        self.wanted: Setting | None = None  # what a slider is being dragged to
        self.seen: Setting | None = None
        self.found = Errors((), None, None)
        self.costs: dict[str, deque[float]] = {"all": deque(maxlen=RECENT), "shown": deque(maxlen=RECENT)}
        self.moved = (0.0, "")  # when which slider was last let go
        self.frf, self.map, self.section = FrfPlots(), ErrorMap(bench), MovingSection(pieces(bench.spindle))
        self.controls = Controls(bench, self.session.now, self.change)
        self._widgets()
        self.work = Work(document, self.halt, self.say)
        self._wire()
        self.choose_test()
        self.show_numbers()
        self.show_rest()

    # ------------------------------------------------------------ widgets

    def _widgets(self) -> None:
        look: dict[str, Any] = {"stylesheets": [LOOK]}
        tests = [(s.id, words.of_test(s)) for s in self.bench.shown]
        self.test = Select(title="Test" if self.bench.campaign else "Condition", options=tests, value=self.bench.shown[0].id, name="test", **look, **WIDE)
        self.response, self.hammer = (Select(title=t, name=t.lower(), **look, **WIDE) for t in ("Response", "Hammer"))
        self.mode = Select(title="Mode", name="mode", **look, **WIDE)
        self.quantity = RadioButtonGroup(labels=["Frequency", "Damping ratio"], active=0, name="quantity", **look)
        self.undo, self.redo = (Button(label=t, name=t.lower(), disabled=True, width=80, **look) for t in ("Undo", "Redo"))
        self.left_out = CheckboxGroup(labels=[s.id for s in self.bench.shown], inline=True, name="left_out", **look)
        self.fit = Button(label="Fit the ticked to the errors shown", name="fit", disabled=self.bench.campaign is None, **look, **WIDE)
        self.weigh = Button(label="Fit all to the FRF lines, as diagnose does", name="weigh", disabled=self.bench.campaign is None, **look, **WIDE)
        self.keep = Button(label="Keep as a step", name="keep", **look, **WIDE)
        self.step = Select(title="Step", options=[], name="step", **look, **WIDE)
        self.take_up = Button(label="Take up again", name="take_up", disabled=True, **look, **WIDE)
        self.explanation = Select(title="Explanation", options=[], name="explanation", **look, **WIDE)
        self.take = Button(label="Take in its values", name="take", disabled=True, **look, **WIDE)
        self.diagnose = Button(label="Diagnose (a minute or more)", name="diagnose", disabled=self.bench.campaign is None, **look, **WIDE)
        self.name = TextInput(title=f"Folder in {self.out.name}", value="mine", name="name", **look, **WIDE)
        self.save = Button(label="Save scene, report and script" if self.bench.campaign else "Save scene and script", name="save", **look, **WIDE)
        self.halt = Button(label="Stop", name="halt", width=80, visible=False, html_attributes=labelled("stop the work in the background"), **look)
        self.short, self.status, self.ladder, self.reasons, self.numbers, self.message = (
            Div(text="", name=n, html_attributes={"role": "status"} if n in ("short", "message") else {}, **look, **WIDE) for n in ("short", "status", "ladder", "reasons", "numbers", "message")
        )
        self.section.play.stylesheets = [LOOK]

    def roots(self) -> dict[str, Any]:
        """What the template places, by name."""
        own = {k: getattr(self, k) for k in (
            "test", "response", "hammer", "mode", "quantity", "undo", "redo", "left_out", "fit", "weigh", "keep", "step", "take_up", "explanation", "take",
            "diagnose", "name", "save", "halt", "short", "status", "ladder", "reasons", "numbers", "message",
        )}  # fmt: skip
        drawn = {"magnitude": self.frf.size, "phase": self.frf.phase, "map": self.map.figure, "section": self.section.figure, "play": self.section.play}
        c = self.controls
        return own | drawn | {"add": c.add, "effects": c.effects, "tolerances": c.open, "tolerance_rows": c.tolerances}

    def _wire(self) -> None:
        self.test.on_change("value", lambda attr, old, new: self.choose_test())
        for chosen in (self.response, self.hammer):
            chosen.on_change("value", lambda attr, old, new: self.show_frf(self.session.now))
        self.mode.on_change("value", lambda attr, old, new: self.show_mode())
        self.quantity.on_change("active", lambda attr, old, new: self.show_errors())
        self.left_out.on_change("active", lambda attr, old, new: self.change(lambda s: leave_out(s, [self.bench.shown[k].id for k in new]), False))
        self.controls.add.on_change("value", lambda attr, old, new: self._add(new))
        self.undo.on_click(lambda: self._walk(undo))
        self.redo.on_click(lambda: self._walk(redo))
        self.keep.on_click(lambda: self.become(keep(self.session, self.found.fitted, self.found.left_out)))
        self.take_up.on_click(lambda: self.become(take_up(self.session, int(self.step.value))))
        self.take.on_click(self._take)
        self.fit.on_click(self._fit)
        self.weigh.on_click(self._weigh)
        self.diagnose.on_click(self._diagnose)
        self.save.on_click(self._save)
        self.halt.on_click(self.work.stop.set)

    # ------------------------------------------------------------ actions

    def change(self, action: Callable[[Setting], Setting], dragging: bool, slider: str = "") -> None:
        """Do something to the setting; of what a drag asks for in the meantime only the newest is computed.

        A slider moved again within `AGAIN`, as by keys, is one step to undo.
        """
        setting = action(self.session.now)
        if not dragging:
            self.wanted = None
            now, (before, moved) = time.perf_counter(), self.moved
            if setting != self.session.now:
                self.moved = now, slider
            step = amend if slider and slider == moved and now - before < AGAIN else do
            self.become(step(self.session, setting))
        elif setting != (self.wanted or self.session.now):
            if self.wanted is None:
                self.document.add_next_tick_callback(self._dragged)
            self.wanted = setting

    def _dragged(self) -> None:
        setting, self.wanted = self.wanted, None
        if setting is None or computed(setting) == self.seen:
            return
        if self.cost("all") < SMOOTH:
            self.compute(setting)
        elif self.cost("shown") < SMOOTH:
            self.show_frf(setting)
            self.seen = None

    def cost(self, what: str) -> float:
        """s that it takes, of the last times the shortest: whatever else the machine does is not held against it."""
        return min(self.costs[what], default=0.0)

    def become(self, session: Session) -> None:
        """Show another session."""
        before, self.session = self.session, session
        if computed(session.now) != self.seen:
            self.compute(session.now)
            self.list_modes()
            self.show_numbers()
        if session is not before:
            self.show_rest()

    def _walk(self, where: Callable[[Session], Session]) -> None:
        self.moved = (0.0, "")
        self.become(where(self.session))

    def _add(self, name: str) -> None:
        if name:
            self.controls.add.value = ""
            self.change(lambda s: s if name in s.effects else add_effect(s, self.bench.effect(name)), False)

    def _take(self) -> None:
        if self.known and self.explanation.value:
            row = self.known.rows[int(self.explanation.value)]
            self.change(lambda s: told.taken(self.bench, s, row), False)

    # ------------------------------------------------------------ computing and showing

    @property
    def shown(self) -> Shown:
        return self.bench.show(self.test.value)

    def compute(self, s: Setting) -> None:
        """Everything at a setting; where no spindle can be built there, the page says why and keeps what it showed."""
        began = time.perf_counter()
        try:
            self.found = errors(self.bench, s)
        except FAILED as error:
            self.say(f"No spindle can be built there: {error}", bad=True)
            self.seen = None
            return
        self.seen = computed(s)
        self.show_frf(s)
        self.costs["all"].append(time.perf_counter() - began)
        self.show_map(s)
        self.show_status(s)

    def show_frf(self, s: Setting) -> None:
        if not (self.response.value and self.hammer.value):
            return
        began = time.perf_counter()
        try:
            self.frf.show(curves(self.bench, s, self.shown, int(self.response.value), int(self.hammer.value)))
        except FAILED as error:
            self.say(f"No spindle can be built there: {error}", bad=True)
            return
        self.costs["shown"].append(time.perf_counter() - began)
        if self.message.text.startswith("<p class=bad>No spindle"):
            self.say("")

    def show_map(self, s: Setting | None = None) -> None:
        self.map.show(self.found, s or self.session.now, self.quantity.active == 1)

    def show_errors(self) -> None:
        self.show_map()
        self.show_numbers()

    def show_numbers(self) -> None:
        """The map's numbers as a table; not while a slider moves."""
        self.numbers.text = words.numbers(self.found, [s.id for s in self.bench.shown], self.quantity.active == 1)

    def show_status(self, s: Setting) -> None:
        drag = "all tests" if self.cost("all") < SMOOTH else "the shown test" if self.cost("shown") < SMOOTH else "nothing until you let go"
        self.short.text = words.short(self.bench, self.found)
        self.status.text = words.status(self.bench, s, self.found) + words.aside(self.bench) + words.timing(self.cost("all"), drag) + words.remarks(self.found)

    def choose_test(self) -> None:
        """Another test: its channels, its modes, its FRF."""
        responses, hammers = channels(self.bench, self.shown)
        for select, nodes in ((self.response, responses), (self.hammer, hammers)):
            select.options = [(str(node), name) for node, name in nodes.items()]
            if select.value not in [str(n) for n in nodes]:
                select.value = str(next(iter(nodes)))
        self.compute(self.session.now) if self.seen is None else self.show_frf(self.session.now)
        self.list_modes()

    def list_modes(self) -> None:
        try:
            self.point, self.modes = modes_of(self.bench, self.session.now, self.shown)
        except FAILED:
            return
        self.mode.options = [(str(k), f"{k + 1} {m.kind}, {m.frequency:.1f} Hz, {m.damping_ratio:.2%}" + (f", {m.whirl}" if m.whirl != "none" and self.point.condition.speed else "")) for k, m in enumerate(self.modes)]
        if not self.mode.value or int(self.mode.value) >= len(self.modes):
            self.mode.value = "0"
        self.show_mode()

    def show_mode(self) -> None:
        if self.modes and self.mode.value:
            self.section.show(moving(self.section.drawn, self.point.chain, self.modes[int(self.mode.value)]))

    def show_rest(self) -> None:
        """Controls, undo, ladder and explanations as the session has them."""
        s = self.session
        self.controls.show(s.now)
        active = [k for k, shown in enumerate(self.bench.shown) if shown.id in s.now.left_out]
        if self.left_out.active != active:
            self.left_out.active = active
        self.undo.disabled, self.redo.disabled = not s.past, not s.future
        self.ladder.text = words.ladder(s)
        steps = [(str(k), r.name) for k, r in enumerate(s.ladder)]
        if self.step.options != steps:
            self.step.options = steps
            self.step.value = steps[-1][0] if steps else ""
        self.take_up.disabled = not steps
        if self.known:
            options = [(str(k), e.words) for k, e in enumerate(self.known.rows)]
            self.reasons.text = told.table(self.known)
            if self.explanation.options != options:
                self.explanation.options = options
                self.explanation.value = "0" if options else ""
            self.take.disabled = not options
        elif not self.reasons.text:
            self.reasons.text = "<p class=soft>None yet: diagnose here, or start with --diagnosis found/diagnosis.json.</p>"

    def say(self, text: str, bad: bool = False) -> None:
        self.message.text = f"<p{' class=bad' * bad}>{escape(text)}</p>" if text else ""

    # ------------------------------------------------------------ work in the background

    def _fit(self) -> None:
        s = self.session.now

        def done(found: Any) -> None:
            self._fitted(found.value)
            said = [f"{key} {value:.4g} ± {found.sd[key]:.2g}" for key, value in found.value.items() if "." in key]
            self.say(f"Fitted in {found.steps} steps. {', '.join(said)}")

        self.work.begin("Fit", lambda progress: fitted(self.bench, s, progress), done)

    def _fitted(self, values: Mapping[str, float]) -> None:
        """Take in fitted values, of what is still there."""
        now = self.session.now
        there = {t.name for t in self.bench.tolerances} | {key_of(e, p) for e, own in now.effects.items() for p in own}
        self.become(do(self.session, set_named(now, {key: v for key, v in values.items() if key in there})))

    def _weigh(self) -> None:
        s, at = self.session.now, iter(range(1, 10**6))
        steps = lines.STEPS + len(self.bench.shown) - len(s.left_out)

        def done(found: lines.Weighed) -> None:
            self._fitted(found.value)
            self.say(lines.said(found))

        self.work.begin("Fit to the lines", lambda progress: lines.weighed(self.bench, s, lambda text: progress(f"{next(at)} of {steps}: {text}")), done)

    def _diagnose(self) -> None:
        s, steps, at = self.session.now, told.steps(self.bench, self.session.now), iter(range(1, 10**6))

        def done(found: Explanations) -> None:
            self.known = found
            self.show_rest()
            self.say(f"Diagnosis: {found.word}. {found.reason}")

        self.work.begin("Diagnosis", lambda progress: told.find(self.bench, s, lambda text: progress(f"{next(at)} of {steps}: {text}")), done)

    def _save(self) -> None:
        name = self.name.value.strip()
        if not name or name in (".", "..") or "/" in name or "\\" in name:
            self.say(f"{name!r} is no name of a folder; use letters, digits and - _", bad=True)
            return
        s, folder = self.session, self.out / name
        self.work.begin(
            "Saving", lambda progress: save(self.bench, s.now, self.found, s.ladder, folder, progress),
            lambda written: self.say(f"Saved in {folder}: {', '.join(written)}"),
        )  # fmt: skip
