"""The workbench in a real browser, which adds, drags, undoes, leaves out, fits and saves."""

import re
import signal
from pathlib import Path

import pytest

from tests.conftest import DATA, SCENE
from tests.report.browser import Browser, installed, until
from tests.report.served import started


@pytest.fixture(scope="module")
def chromium(tmp_path_factory):
    if installed() is None:
        pytest.skip("no Chromium or Chrome is installed on this machine")
    browser = Browser(tmp_path_factory.mktemp("chromium"))
    browser.scheme("light")
    yield browser
    browser.close()


@pytest.fixture
def tab(chromium, served):
    """A fresh page; nothing may have gone wrong in it."""
    chromium.size(1400, 1000)
    chromium.errors.clear()
    chromium.open(served["address"])
    chromium.wait("document.body?.dataset.ready === 'yes'")
    yield chromium
    assert chromium.errors == []


BUTTON = "find(e => e.tagName === 'BUTTON' && e.textContent.startsWith({!r}))"
HANDLE = "find(e => e.classList?.contains('noUi-handle') && e.getAttribute('aria-label')?.startsWith({!r}))"


def choose(tab, name, text):
    """Choose an option of a list as a user does, by its beginning."""
    expression = f"(e => {{ e.selectedIndex = [...e.options].findIndex(o => o.text.startsWith({text!r})); e.dispatchEvent(new Event('change')); return e.selectedIndex }})"
    assert tab.run(f"{expression}(find(e => e.name === {name!r}))") >= 0


def errors_told(tab):
    return tab.run(f"{tab.model('status')}.text")


def test_it_says_that_it_loads_until_the_document_is_there(chromium, served):
    """A socket that never answers: a word, and no headings over empty boxes; with one that does, the word goes."""
    shown = "getComputedStyle({}).{}"
    word, body = shown.format("document.getElementById('loading')", "display"), shown.format("document.querySelector('main')", "visibility")
    silent = chromium.call("Page.addScriptToEvaluateOnNewDocument", source="window.WebSocket = class { send() {} close() {} }")["identifier"]
    chromium.open(served["address"])
    chromium.wait("document.readyState === 'complete' && !!document.getElementById('loading')")
    assert chromium.run("document.body.dataset.ready ?? null") is None
    assert (chromium.run(word), chromium.run(body)) == ("block", "hidden")
    assert chromium.run("document.getElementById('loading').textContent").startswith("Loading")
    chromium.call("Page.removeScriptToEvaluateOnNewDocument", identifier=silent)
    chromium.open(served["address"])
    chromium.wait("document.body?.dataset.ready === 'yes'")
    assert (chromium.run(word), chromium.run(body)) == ("none", "visible")


@pytest.mark.slow
def test_dragging_changes_curves_and_errors_while_dragging(tab):
    before = errors_told(tab)
    choose(tab, "add", "preload_loss")
    tab.wait(f"!!{HANDLE.format('loss')}")
    added = until(lambda: errors_told(tab) != before and errors_told(tab), 60)
    curve = "Bokeh.documents[0].get_model_by_name('magnitude').renderers[1].data_source.data.size[400]"
    at_first = tab.run(curve)
    tab.run(f"{HANDLE.format('loss')}.scrollIntoView({{block: 'center'}}) ?? true")
    x, y = tab.run(f"(e => {{ const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2] }})({HANDLE.format('loss')})")
    tab.mouse("mousePressed", x, y)
    for step in range(1, 11):
        tab.mouse("mouseMoved", x + 6 * step, y)
    until(lambda: errors_told(tab) != added, 60)
    until(lambda: tab.run(curve) != at_first, 60)
    assert tab.run(f"{tab.model('undo')}.disabled") is False
    tab.mouse("mouseReleased", x + 60, y)
    value = f"{tab.model('preload_loss.loss')}.value"
    moved = tab.wait(value)
    assert moved > 0.16
    tab.click(BUTTON.format("Undo"))
    tab.wait(f"{value} === 0.15")
    tab.click(BUTTON.format("Redo"))
    tab.wait(f"{value} === {moved}")
    tab.click(BUTTON.format("Remove"))
    until(lambda: errors_told(tab).split("ms for all")[0][:40] == before.split("ms for all")[0][:40], 60)


@pytest.mark.slow
def test_a_test_is_left_out_the_rest_fitted_the_step_kept(tab):
    choose(tab, "add", "preload_loss")
    tab.wait(f"!!{tab.model('preload_loss.loss')}")
    tab.click("find(e => e.type === 'checkbox' && e.parentElement?.textContent.trim() === Bokeh.documents[0].get_model_by_name('left_out').labels[1])")
    tab.wait(f"{tab.model('status')}.text.includes('1 left-out test')")
    tab.wait(f"{tab.model('map')}.x_range.factors.some(f => f[0] === 'left out')")
    tab.click(BUTTON.format("Fit the ticked"))
    tab.wait(f"{tab.model('message')}.text.includes('Fitted in')", 60)
    tab.click(BUTTON.format("Keep as a step"))
    tab.wait(f"{tab.model('ladder')}.text.includes('1: preload_loss')")


def test_everything_is_reached_by_keyboard_with_a_name_and_a_visible_focus(tab):
    choose(tab, "add", "bond_softening")
    tab.wait(f"!!{HANDLE.format('transition')}")
    tab.click(BUTTON.format("Tolerances"))
    tab.wait(f"{tab.model('tolerance_rows')}.visible")
    tab.run("document.activeElement.blur() ?? true")
    deepest = "(() => { let e = document.activeElement; while (e?.shadowRoot?.activeElement) e = e.shadowRoot.activeElement; return e })()"
    tab.wait(f"!!{HANDLE.format('bearing damping')}")
    seen = {}
    for _ in range(110):
        tab.key("Tab", 9)
        said = tab.run(
            f"(e => {{ if (!e || e === document.body) return null; const s = getComputedStyle(e); const label = e.getAttribute('aria-label')"
            " || e.labels?.[0]?.textContent || e.getRootNode().querySelector?.(`label[for='${e.id}']`)?.textContent || e.title || e.textContent;"
            f" return [e.tagName, (label || '').trim(), s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) >= 1 || s.boxShadow !== 'none'] }})({deepest})"
        )
        if said is None:  # from the end to the beginning
            continue
        assert said[1], f"a {said[0]} without a name, after {list(seen)[-1:]}"
        assert said[2], f"{said[:2]}: its focus is not seen"
        seen[said[1]] = said[0]
    names = " | ".join(seen)
    for wanted in ("Test", "Response", "Hammer", "Add an effect", "hot_compliance", "fit bond_softening.transition", "remove bond_softening", "Tolerances",
                   "hub mass", "Fit the ticked", "Undo", "Keep as a step", "Mode", "Play", "Diagnose", "Folder", "Save", "Frequency"):  # fmt: skip
        assert wanted in names, f"{wanted} is not reached: {names}"


def test_tables_that_scroll_on_a_narrow_page_have_a_name(tab):
    """The Tab key stops at them there, as at anything else."""
    assert tab.run("[...document.querySelectorAll('.scroll, .rows')].filter(e => !e.getAttribute('aria-label')).length") == 0


def test_a_slider_moves_by_arrow_keys(tab):
    choose(tab, "add", "preload_loss")
    tab.wait(f"!!{HANDLE.format('loss')}")
    tab.run(f"{HANDLE.format('loss')}.focus() ?? true")
    tab.key("ArrowRight", 39)
    tab.wait(f"{tab.model('preload_loss.loss')}.value > 0.15")
    tab.wait(f"{tab.model('undo')}.disabled === false")


def test_it_fits_the_window_and_can_be_read_in_light_and_dark(tab):
    button = "find(e => e.classList?.contains('bk-btn') && !e.disabled)"
    for scheme in ("light", "dark"):
        tab.scheme(scheme)
        for width in (1400, 400):
            tab.size(width, 1000)
            tab.wait(f"document.documentElement.scrollWidth <= {width}")
        for what, least in (("document.body", 7.0), (button, 4.5)):
            ink, paper = tab.run(f"['color', 'backgroundColor'].map(k => getComputedStyle({what})[k].match(/\\d+/g).map(Number))")
            assert contrast(ink, paper) > least, (scheme, what)
    tab.scheme("light")


@pytest.mark.slow
def test_the_map_of_errors_has_colours_of_its_own_on_a_dark_page(tab):
    drawn = "window.Bokeh?.documents?.[0]?.get_model_by_name('map')?.renderers"  # a page that is being loaded again has none for a while
    fields = f"{drawn}?.map(r => (r.glyph.fill_color ?? r.glyph.text_color).field).join()"
    for scheme, wanted in (("dark", "night,night_ink"), ("light", "colour,ink"), ("dark", "night,night_ink")):
        tab.scheme(scheme)
        tab.wait(f"{fields} === '{wanted}'")
    tab.call("Page.reload")
    tab.wait(f"document.body?.dataset.ready === 'yes' && {fields} === 'night,night_ink'")
    tab.scheme("light")


def contrast(a, b):
    """Of WCAG 2.1, 1.4.3."""

    def luminance(rgb):
        shares = [c / 255 for c in rgb[:3]]
        return sum(w * (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4) for w, c in zip((0.2126, 0.7152, 0.0722), shares, strict=True))

    high, low = sorted((luminance(a), luminance(b)), reverse=True)
    return (high + 0.05) / (low + 0.05)


def test_the_keyboard_alone_looks_through_the_effects_adds_one_and_undoes_it(tab):
    """Arrows on the closed list only choose; Enter adds. Ctrl+Z and Ctrl+Y walk, but not while a number is typed."""
    added = "Bokeh.documents[0].get_model_by_name('effects').children.length"
    deepest = "(() => { let e = document.activeElement; while (e?.shadowRoot?.activeElement) e = e.shadowRoot.activeElement; return e })()"
    tab.wait("find(e => e.name === 'add')?.dataset.patient === 'yes'")
    tab.run("find(e => e.name === 'add').focus() ?? true")
    for _ in range(3):
        tab.key("ArrowDown", 40)
    assert tab.run("find(e => e.name === 'add').selectedIndex") == 3
    wanted = tab.run("find(e => e.name === 'add').selectedOptions[0].text").split(":")[0]
    assert tab.run(added) == 0
    tab.key("Enter", 13, "\r")
    tab.wait(f"{added} === 1")
    first = f"find(e => e.getAttribute?.('aria-label') === 'remove {wanted}')"
    tab.wait(f"!!{first}")
    tab.key("z", 90, modifiers=2)
    tab.wait(f"{added} === 0")
    tab.wait("!Bokeh.documents[0].get_model_by_name('redo').disabled")  # it comes after the list
    tab.key("y", 89, modifiers=2)
    tab.wait(f"{added} === 1")
    tab.run("find(e => e.type === 'text' && e.name !== 'name').focus() ?? true")
    assert tab.run(f"{deepest}.tagName") == "INPUT"
    tab.key("z", 90, modifiers=2)
    tab.run("find(e => e.name === 'add').focus() ?? true")
    tab.key("ArrowDown", 40)
    tab.run("find(e => e.name === 'add').blur() ?? true")
    tab.wait("find(e => e.name === 'add').selectedIndex === 0")
    assert tab.run(added) == 1
    tab.key("z", 90, modifiers=2)
    tab.wait(f"{added} === 0")


@pytest.mark.slow
def test_the_section_moves_when_it_is_asked_to(tab):
    corner = f"{tab.model('section')}.renderers[1].data_source.data.z[0][0]"
    first = tab.run(corner)
    assert tab.run(f"{tab.model('play')}.active") is False, "whoever wants less motion is not shown any"
    tab.click(BUTTON.format("Play"))
    until(lambda: tab.run(corner) != first, 60)
    tab.click(BUTTON.format("Pause"))
    tab.wait(f"!{tab.model('play')}.active")


@pytest.mark.slow
def test_saving_from_the_page(tab, served):
    choose(tab, "add", "preload_loss")
    tab.wait(f"!!{tab.model('preload_loss.loss')}")
    tab.click(BUTTON.format("Save scene"))
    tab.wait(f"{tab.model('message')}.text.includes('Saved in')", 60)
    assert (Path(served["out"]) / "mine" / "scene" / "spindle.toml").is_file()


@pytest.mark.slow
def test_the_fit_to_the_lines_runs_to_its_end(chromium, tmp_path):
    """On FRFs of another program with a bond that softens (12.5 nm/N): added, fitted by the button,
    with its gain told, and undone in one step."""
    process, told = started(tmp_path, SCENE, DATA / "foreign_bond")
    chromium.size(1400, 1000)
    chromium.errors.clear()
    try:
        chromium.open(told["address"])
        chromium.wait("document.body?.dataset.ready === 'yes'", 60)
        choose(chromium, "add", "bond_softening")
        value = f"{chromium.model('bond_softening.hot_compliance')}.value"
        chromium.wait(f"!!{chromium.model('bond_softening.hot_compliance')}", 60)
        before = chromium.run(value)
        chromium.click(BUTTON.format("Fit all to the FRF lines"))
        chromium.wait(f"{chromium.model('message')}.text.includes('Fitted to the lines')", 1800)
        said = chromium.run(f"{chromium.model('message')}.text")
        assert float(re.search(r"ln evidence \+(\d+)", said)[1]) > 100
        assert chromium.run(value) == pytest.approx(12.5, abs=2.7)  # three of its standard errors
        assert chromium.run(value) != before
        chromium.click(BUTTON.format("Undo"))
        chromium.wait(f"{value} === {before}", 60)
        assert chromium.errors == []
    finally:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=60)
    chromium.open("about:blank")


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["five_bearing", "mk7702", "free_shaft"])
def test_other_scenes_without_tests(scene, chromium, tmp_path):
    process, told = started(tmp_path, scene)
    chromium.errors.clear()
    try:
        chromium.open(told["address"])
        chromium.wait("document.body?.dataset.ready === 'yes'", 60)
        assert "while a slider moves, this computes" in errors_told(chromium)
        assert chromium.run(f"{chromium.model('map')}.y_range.factors.length") > 3
        assert chromium.errors == []
    finally:
        process.send_signal(signal.SIGTERM)
        process.communicate(timeout=20)
    assert process.returncode == 0
    chromium.wait("document.getElementById('lost').hidden === false")
    chromium.open("about:blank")  # a page whose server is gone goes on asking for it
    chromium.run("0")
