"""The report: its numbers are the run's, it needs no network, and it works for other scenes, temperatures and measurements."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from tests.conftest import ROOT
from tests.made_campaign import other_campaign
from tests.model.test_loaded import rollers
from tests.report.parsed_page import Page, number
from thermospindle.model.machine import Condition
from thermospindle.model.rotor.modes import group_energy
from thermospindle.model.scene.reading import content_hash, load
from thermospindle.report.figures.report import Peaks
from thermospindle.report.log.content import bearing_series
from thermospindle.report.page.comparison import Row, Table, compared
from thermospindle.report.page.headlines import headlines, misses
from thermospindle.report.page.report import _page, background, bearing_figures, driving_points, html, named, stamp, write_report
from thermospindle.sim.campaign.campaign import Test
from thermospindle.sim.campaign.modes import ModeRow
from thermospindle.sim.hammer.test import estimate_of
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.operating import operating_point
from thermospindle.sim.run import Run


@pytest.fixture(scope="module")
def text(run: Run) -> str:
    return html(run)


@pytest.fixture(scope="module")
def page(text: str) -> Page:
    return Page(text)


def test_coherence_is_drawn_of_several_hits_alone(run: Run, text: str):
    """Of one it would be 1 whatever the noise."""
    assert "No coherence is drawn: it tells how well several hits agree, and there is one" in text
    assert "functions and coherence at" not in text
    step = run.steps[0]
    record, settings = step.test.record, replace(step.test.settings, hits=2)
    twice = replace(record, force=np.concatenate([record.force] * 2, axis=1), velocity=np.concatenate([record.velocity, 0.9 * record.velocity], axis=1))
    test = replace(step.test, record=twice, settings=settings, estimate=estimate_of(settings, step.point, twice))
    more = html(replace(run, steps=(replace(step, test=test),)))
    assert "functions and coherence at" in more
    assert "No coherence" not in more


# ---------------------------------------------------------------- numbers


def test_the_table_of_frequencies_holds_the_numbers_of_the_run(run: Run, page: Page):
    """Measured, published and computed columns, mode by mode; the model has three modes more in the band than were measured."""
    rows = [row for row in page.tables["frequencies"] if row and row[0].isdigit()]
    cold, hot = (step.point.modes for step in run.steps)
    measured = {(r.test, r.mode): r.frequency for t in run.measured[0].tests for r in t.modes}
    assert len(rows) == sum(m.frequency < 6000 for m in cold) == 8
    for i, row in enumerate(rows):
        assert row[1] == cold[i].kind
        computed = [number(cell) for cell in row[9:12]]
        exact = [cold[i].frequency, hot[i].frequency, hot[i].frequency - cold[i].frequency]
        assert computed == pytest.approx(exact, abs=0.0501)
        if i < 5:
            values = [measured["T20", i + 1], measured["T60", i + 1]]
            assert [number(c) for c in row[3:6]] == pytest.approx([*values, values[1] - values[0]], abs=0.0501)
            assert "± 1.4" in row[5]  # two frequencies, 1 Hz each
        else:
            assert row[3:9] == ["–"] * 6
    assert [number(row[6]) for row in rows[:5]] == [1002, 1545, 1795, 1821, 2010]
    assert [number(row[8]) for row in rows[:5]] == [-1, -3, -24, -21, -14]


def test_identified_frequencies_stand_in_the_row_of_their_mode(run: Run, page: Page):
    """Within the identification's band, and with the standard error of a shift from both temperatures."""
    rows = [row for row in page.tables["frequencies"] if row and row[0].isdigit()]
    for i in (0, 1):
        for k, cell in enumerate(rows[i][12:14]):
            seen = run.steps[k].identified
            nearest = int(np.argmin(np.abs(seen.frequency - run.steps[k].point.modes[i].frequency)))
            error = float(cell.split("±")[1])
            assert number(cell) == pytest.approx(seen.frequency[nearest], abs=error / 2)
            assert error == pytest.approx(seen.frequency_sd[nearest], rel=0.35)  # one digit is printed
    assert rows[4][12] == "–"


def test_differences_from_the_measurement(run: Run, page: Page):
    """The paper's own analysis and the model, less the measured column."""
    rows = [row for row in page.tables["misses"] if row and row[0].isdigit()]
    assert [number(row[2]) for row in rows] == [-21, -7, 57, 33, -58]
    assert [number(row[4]) for row in rows] == [-4, -1, 4, 6, 5]
    cold = run.steps[0].point.modes
    exact = [cold[i].frequency - f for i, f in enumerate((1023, 1552, 1738, 1788, 2068))]
    assert [number(row[5]) for row in rows] == pytest.approx(exact, abs=0.0501)


def test_bearing_table(run: Run, page: Page):
    """Every quantity of the figures, both bearings at both temperatures."""
    rows = [row for row in page.tables["bearings"] if row and row[1] in ("upper", "lower")]
    assert len(rows) == 4
    for row in rows:
        step = next(s for s in run.steps if s.point.condition.temperature == float(row[0]))
        b = step.point.state.bearing(row[1])
        exact = [np.degrees(b.contact_angle), b.deformation * 1e6, b.contact_force, b.ball_stiffness * 1e-6]
        exact += [b.preload, b.radial_stiffness * 1e-6, b.axial_stiffness * 1e-6]
        assert [number(c) for c in row[2:9]] == pytest.approx(exact, abs=0.000501)


def test_a_machine_on_rollers_alone_has_no_empty_table_of_balls():
    """It had the head of one, over no row, and then "The same of rollers"."""
    spindle = rollers()
    few = SimpleNamespace(spindle=spindle, steps=[SimpleNamespace(point=operating_point(spindle, Condition(20.0)))])
    found = Page(str(_page().bearings(bearing_figures(few), few)))
    assert list(found.tables) == ["rollers"]
    assert [row[1] for row in found.tables["rollers"][1:]] == [b.name for b in spindle.roller_bearings]


def test_clearances_are_drawn_and_logged_in_micrometres(monkeypatch: pytest.MonkeyPatch):
    """Rollers mounted with 4 um have them at the reference temperature."""
    spindle = rollers()
    few = SimpleNamespace(spindle=spindle, steps=[SimpleNamespace(point=operating_point(spindle, Condition(20.0)))])
    curves = {}
    monkeypatch.setattr("thermospindle.report.figures.report.trend", lambda key, temperature, of, label, from_zero: curves.setdefault(key, (label, of)) and "")
    bearing_figures(few)
    names = [b.name for b in spindle.roller_bearings]
    assert curves["clearance"] == ("clearance, µm", {"": {name: pytest.approx([4.0], abs=1e-6) for name in names}})
    for name in names:
        assert bearing_series(few, name)["clearance", "µm"] == pytest.approx([4.0], abs=1e-6)


@pytest.mark.parametrize(("quantity", "power"), [("receptance", -1), ("mobility", 0), ("accelerance", 1)])
def test_what_was_measured_is_drawn_as_mobility(run: Run, quantity: str, power: int):
    """Of one mass on a spring, 1 / (k - m w^2), times i w for a velocity and (i w)^2 for an acceleration; the line at 0 Hz has none."""
    frequency = np.arange(0.0, 3000.0, 100.0)
    s = 2j * np.pi * frequency
    mobility = s / (1e6 + 0.03 * s**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        value = mobility * s**power
    test = Test("a", 20.0, 0.0, frf=Frf(frequency, value[None, None], (1,), (1,), quantity))
    measured = replace(run, measured=(SimpleNamespace(tests=(test,)),))
    [curve] = [c for curves in driving_points(measured, run.steps[:1]).values() for c in curves if c.style == "measured"]
    assert curve.frequency == pytest.approx(frequency[1:])
    assert curve.mobility == pytest.approx(mobility[1:], rel=1e-12)


def test_mode_table(run: Run, page: Page):
    """Frequency, damping and shares of strain energy of every mode in the band, temperature by temperature."""
    rows = [row for row in page.tables["modes"] if row and row[0] in ("20", "60")]
    modes = [(s, m) for s in run.steps for m in s.point.modes if m.frequency < 6000]
    assert len(rows) == len(modes)
    for row, (step, mode) in zip(rows, modes, strict=True):
        assert number(row[4]) == pytest.approx(mode.frequency, abs=0.00501)
        assert number(row[6]) == pytest.approx(100 * mode.damping_ratio, abs=0.000501)
        shares = [100 * share for share in group_energy(step.point.chain, mode).values()]
        assert [number(c) for c in row[8:]] == pytest.approx(shares, abs=0.0501)


def test_says_what_is_missed(run: Run, page: Page):
    """Split of the rocking pair, direction of mode 1, larger shifts of the bearing modes, and what carries them."""
    said = " ".join(page.items).replace("\u00a0", " ")
    assert "The largest miss at 20 °C is mode 5 (axial): computed 2010.0 Hz, measured 2068.0 Hz, 58.0 Hz or 2.8 % too low" in said
    assert "Modes 3 and 4 (rocking) are measured 50.0 Hz apart, computed 26.0 Hz" in said
    assert "mode 1 (axial) rises by 3.0 ± 1.4 Hz when measured and falls by 1.7 Hz when computed" in said
    assert "move further than computed ones in modes 3, 4 and 5" in said
    assert "names “ball bearing”" in said


def test_sources_and_settings(run: Run, page: Page, text: str):
    """Provenance of every number with the file's value, the scene's hash, the acquisition, and the meshes."""
    origins = {row[0]: row[1:] for row in page.tables["origins"]}
    assert {key for key in origins if key != "number"} == set(run.spindle.provenance)
    assert origins["bearing_pair.preload_N"][:2] == ["16.0", "printed"]
    assert ["scene hash", content_hash(run.spindle)] in page.tables["versions"]
    assert ["hits averaged per point", "1"] in page.tables["acquisition"]
    assert ["sample rate", "25000 Hz"] in page.tables["acquisition"]
    assert [row[0] for row in page.tables["meshes"]] == ["part", "stationary", "rotating"]
    assert "differs from its file" not in text


# ---------------------------------------------------------------- the file


def test_needs_no_network(page: Page, text: str):
    """No scripts; references point into the file or hold their data; no address in style sheets."""
    assert "script" not in page.tags
    assert all(r.startswith(("#", "data:image/png;base64,")) for r in page.references)
    assert not re.search(r"url\((?!#)|@import|https?://", text)
    targets = {r[1:] for r in page.references if r.startswith("#")} | set(re.findall(r"url\(#([^)]+)\)", text))
    assert targets <= set(page.ids)
    assert len(page.ids) == len(set(page.ids))
    assert len(text.encode()) < 3e6


def test_same_run_same_file_written_whole(run: Run, text: str, tmp_path: Path):
    """Byte for byte, nothing else left in the folder, and the old file kept when a new one cannot be made."""
    path = tmp_path / "report.html"
    write_report(run, path)
    assert path.read_text(encoding="utf-8") == text
    with pytest.raises(IndexError):
        write_report(replace(run, steps=()), path)
    assert {p.name for p in tmp_path.iterdir()} == {"report.html", "pictures"}
    assert path.read_text(encoding="utf-8") == text


def test_what_scrolls_has_a_name(text: str) -> None:
    """The Tab key stops there on a narrow page: a picture has its description, a table its caption,
    and one without the title of its section."""
    scrolled = re.findall(r'<(?:figure class="chart wide"|div class="scroll")([^>]*)>', text)
    assert len(scrolled) > 8
    assert [s for s in scrolled if not re.search(r'aria-label="[^"]+"', s)] == []
    assert 'role="group" aria-label="Versions"><table id="versions">' in text
    assert 'role="group" aria-label="Natural frequencies and their shifts, Hz, with one standard error where it is known."><table id="frequencies">' in text
    said = named('<figure class="chart wide"><svg role="img" aria-label="1 &lt; 2"></svg></figure><div class="scroll"><table><caption>a <b>"b"</b></caption></table></div>', "x")
    assert 'wide" aria-label="1 &lt; 2"><svg' in said
    assert 'aria-label="a &#34;b&#34;"><table' in said


@pytest.fixture(scope="module")
def alone(run: Run) -> str:
    """One temperature of a scene without file and measurements, with two sections more."""
    spindle = replace(run.spindle, file=None)
    return html(Run(spindle, run.steps[:1], ()), [("Runout <&>", '<p id="runout">1 &lt; 2</p>'), ("Diagnosis", "<p>none</p>")])


def test_extra_sections(alone: str):
    """Stand in the given order between results and background; their HTML is kept, their titles are escaped."""
    titles = re.findall(r"<h2>(.*?)</h2>", alone)
    place = titles.index("Runout &lt;&amp;&gt;")
    assert titles[place - 1 : place + 3] == ["All modes", "Runout &lt;&amp;&gt;", "Diagnosis", "The virtual test"]
    assert '<p id="runout">1 &lt; 2</p>' in alone


def test_title_command_and_date(run: Run, text: str, tmp_path: Path):
    """The kind of page begins its title; the command line's stamp stands below it, escaped and once, and nothing else changes."""
    assert f"<title>Run: {run.spindle.title}</title>" in text
    assert not re.search(r"<(fig)?caption>(Table|Fig\.) \d|numbered as in Table", text)  # of the paper
    (tmp_path / "report.html").write_text(text, encoding="utf-8")
    stamp(tmp_path, "spindle run 'a <b>' --out x", "2026-01-02 03:04 UTC")
    made = (tmp_path / "report.html").read_text(encoding="utf-8")
    line = '<p class="under"><code>spindle run &#39;a &lt;b&gt;&#39; --out x</code>, 2026-01-02 03:04 UTC</p>'
    assert made == text.replace("<!-- made by -->", line)
    assert made.index("</h1>") < made.index(line) < made.index("<section")


# ---------------------------------------------------------------- other scenes, temperatures, measurements


@pytest.mark.parametrize("temperatures", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_without_measurements_or_file(run: Run, alone: str, temperatures: int):
    page = Page(alone if temperatures == 1 else html(Run(replace(run.spindle, file=None), run.steps, ())))
    rows = [row for row in page.tables["frequencies"] if row and row[0].isdigit()]
    assert len(rows) == 8
    assert "misses" not in page.tables
    assert number(rows[0][3]) == pytest.approx(run.steps[0].point.modes[0].frequency, abs=0.0501)


def test_what_was_measured_between_the_ends_of_a_run_is_shown(run: Run):
    """It was said to be missing "for want of a run at its temperature", beside a run at just that
    one, as of the free shaft at 20 of 15 to 25 C."""
    campaign = other_campaign([ModeRow("a", 1, "axial", 1010.0, 1.0)], temperature=40.0)
    cold, hot = run.steps[0], run.steps[-1]
    point = replace(hot.point, condition=replace(hot.point.condition, temperature=40.0))
    table = compared(Run(replace(run.spindle, file=None), (cold, replace(hot, point=point), hot), (campaign,)))
    assert table.elsewhere == ()
    assert table.temperatures == (40.0, hot.point.condition.temperature)
    assert set(table.sources()) == {"measured", "computed", "identified"}


def test_records_without_MuJoCo_are_said_to_be_so(run: Run, text: str):
    """Of the reduced model the page said that the spindle was struck in MuJoCo."""
    assert "The spindle was struck in MuJoCo, in time, with linear bearing elements, and its FRFs" in text
    reduced = [replace(s, test=replace(s.test, element="reduced")) for s in run.steps]
    page = html(Run(replace(run.spindle, file=None), tuple(reduced), ()))
    assert "struck in MuJoCo" not in page
    assert "the linear model, reduced to its modes, without MuJoCo, and its FRFs" in page


def test_measured_elsewhere_is_named_not_shown(run: Run):
    """A campaign at temperatures that the run does not have."""
    campaign = other_campaign([ModeRow("a", 1, "axial", 1010.0, 1.0)], temperature=35.0)
    spindle = replace(run.spindle, file=None)
    table = compared(Run(spindle, run.steps, (campaign,)))
    assert table.elsewhere == ("measured at 35 °C",)
    assert set(table.sources()) == {"computed", "identified"}
    assert misses(table) == []


def test_changed_spindle_is_told(run: Run):
    """Values of the file are not passed off as the run's."""
    changed = replace(run.spindle, reference_temperature=21.0)
    said = {title: str(body) for title, body in background(Run(changed, run.steps, ()))}
    assert "differs from its file" in said["Where the numbers come from"]


@pytest.mark.parametrize(("scene", "told"), [("hdd_2003", "16.0 → "), ("five_bearing", "rear2 211 → 238, rear1 211 → 638, front3 382 → 926, front2 191 → 292, front1 191 → 234 N")])
def test_the_preload_of_every_bearing_that_has_its_own(scene: str, told: str) -> None:
    """That of one stood for all five, then five numbers and five names apart from them; preload
    that rises is not what is left of it, and no change is -0."""
    spindle = load(ROOT / "scenes" / scene)
    steps = [SimpleNamespace(point=operating_point(spindle, Condition(t))) for t in (20.0, 60.0)]
    cards = {what: (number, why) for what, number, why in headlines(SimpleNamespace(steps=steps), Table((), (), (20.0, 60.0), {}, ()))}  # type: ignore[arg-type]
    assert cards["Preload"][0].replace("\u00a0", " ").startswith(told)
    assert not re.search(r"[-−]0 %", " ".join(cards["Radial bearing stiffness"]))
    assert ("of it is left" in cards["Preload"][1]) == (scene == "hdd_2003")


@pytest.mark.parametrize(("scene", "cards"), [("mk7702", 0), ("hdd_2003", 3)])
def test_headlines_of_scenes_with_and_without_ball_rows(scene: str, cards: int) -> None:
    """A division by a preload that nothing has was a traceback of every `run` of a scene on rated bearings."""
    spindle = load(ROOT / "scenes" / scene)
    steps = [SimpleNamespace(point=operating_point(spindle, Condition(t))) for t in (20.0, 40.0)]
    table = Table((), (), (20.0, 40.0), {}, ())
    assert len(headlines(SimpleNamespace(steps=steps), table)) == cards  # type: ignore[arg-type]
    none = [SimpleNamespace(point=replace(s.point, state=replace(s.point.state, bearings=tuple(replace(b, preload=0.0) for b in s.point.state.bearings)))) for s in steps]
    assert all("0.0 → 0.0 N" in number for what, number, _ in headlines(SimpleNamespace(steps=none), table) if what == "Preload")  # type: ignore[arg-type]


def test_what_temperature_leaves_alone_is_not_a_row_of_zeros() -> None:
    """A spring's preload was "16.0 → 16.0 N, 100 % of it is left", and seven modes on bearings given by numbers "+0.0, +0.0, +0.0, ... Hz"."""
    steps = [SimpleNamespace(point=operating_point(load(ROOT / "tests" / "scenes" / "inner_turning_spring"), Condition(t))) for t in (20.0, 60.0)]
    rows = tuple(Row(n, "lateral", name, 0.8, 0.2, "") for n, name in enumerate(("feet", "feet", "shaft"), 1))
    peaks = tuple(Peaks("computed", "computed", t, {1: (548.84, np.nan), 2: (583.73 - 1e-4 * t, np.nan), 3: (900.0 - t, np.nan)}) for t in (20.0, 60.0))
    cards = headlines(SimpleNamespace(steps=steps), Table(rows, peaks, (20.0, 60.0), {}, ()))  # type: ignore[arg-type]
    assert cards[0] == ("Preload", "16.0 N", "the same at 20 and 60 °C")
    assert [number for _, number, _ in cards[-2:]] == ["less than 0.05 Hz", "-40.0 Hz"]
