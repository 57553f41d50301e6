"""`spindle draft`: the file it writes is an effect with which the error falls."""

from __future__ import annotations

import json
import runpy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import thermospindle as ts
from tests.virtual_campaign import mode_campaign, model_of
from thermospindle.cli import main
from thermospindle.diagnosis.draft.answer import Place
from thermospindle.diagnosis.draft.draft import draft
from thermospindle.diagnosis.inference.evidence import evidence, left_out
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.diagnosis.inference.freeform import free_forms
from thermospindle.diagnosis.inference.hypothesis import Hypothesis, settled
from thermospindle.diagnosis.inference.problem import Problem
from thermospindle.diagnosis.parameters.mechanism import Mechanism, variants, with_own_laws
from thermospindle.diagnosis.verdict import _drift
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.sim.effects import CATALOGUE, by_name
from thermospindle.sim.effects.own import effect_of
from thermospindle.sim.effects.rules import check, has_full_rows
from thermospindle.sim.operating import operating_point

AT = (20.0, 30.0, 40.0, 50.0, 60.0, 70.0)


def of_rings(folder, change, sd, at=AT):
    """An answer in which the rings move apart by `change` (um) at temperatures `at`, at rest."""
    rows = [{"temperature_C": t, "speed_rpm": 0.0, "change_um": float(c), "sd": sd} for t, c in zip(at, change, strict=True)]
    file = folder / "d.json"
    file.write_text(json.dumps({"where": [{"element": "bearings rings apart radially", "unit": "um", "change": rows}]}), encoding="utf-8")
    return file


def drafted(answer, folder):
    """The text of the file drafted from an answer, and its effect, which keeps the rules."""
    file = folder / "own.py"
    file.write_text(text := draft(answer, "own").text, encoding="utf-8")
    own = effect_of(file)
    has_full_rows(own, [])
    return text, own, runpy.run_path(str(file))["law"]


def test_a_shape_that_the_tests_do_not_tell_is_said_to_be_none(tmp_path):
    """Nothing up to 30 C, some at 40, all from 50 on: how steep a sigmoid is there no test says (it was drafted with
    +- 32000 K). It is a number in the law, for as a parameter it would move nothing, and `add` refused the file."""
    text, own, _ = drafted(of_rings(tmp_path, [0.0, 0.0, 3.0, 7.7, 7.7], 0.4, AT[:5]), tmp_path)
    assert own.title.endswith("sigmoid in temperature")
    assert " K (not told by these tests)." in text
    assert "  # K, not told by these tests" in text
    assert [p.name for p in own.parameters] == ["size"]
    assert "+- 3" not in text.split("Rivals")[0]
    check(own, ts.load("hdd_2003"), (*CATALOGUE, own), own.where)
    sure = draft(of_rings(tmp_path, [0.0, 0.1, 0.5, 1.5, 1.9, 2.0], 0.01, AT), "own").text
    assert "width 4" in sure.split("Rivals")[0]
    assert "not told" not in sure


def test_a_gap_that_opens_from_a_temperature_on(tmp_path):
    """A seat that loosens above 30 C; a sigmoid through it is flat beyond what was seen."""
    _, own, law = drafted(of_rings(tmp_path, [0.0, 0.02, 2.0, 4.01, 5.98], 0.03, AT[:5]), tmp_path)
    assert own.title.endswith("linear above a temperature")
    values = own.typical()
    assert values["start"] == pytest.approx(30.0, abs=0.5)
    assert law(80.0, 0.0, values) == pytest.approx(10.0, rel=0.02)


def test_what_is_named_needs_no_draft(tmp_path, capsys):
    """A bond that was identified: a newcomer's plain `draft` wrote a step of the rings, which no law fitted, without a word."""
    answer = of_rings(tmp_path, [0.1 * t for t in AT], 0.01)
    told = json.loads(answer.read_text(encoding="utf-8"))
    answer.write_text(json.dumps(told | {"verdict": "identified", "effects": ["bond_softening"]}), encoding="utf-8")
    for element, warned in ((None, True), ("bearings rings apart radially", False)):
        asked = ["--element", element] if element else []
        assert main(["draft", str(answer), "--out", str(tmp_path / f"own_{warned}.py"), "--json", *asked]) == 0
        said = json.loads(capsys.readouterr().out)["warnings"]
        assert any("names bond_softening, and nothing has to be drafted: spindle add SCENE bond_softening --from" in w for w in said) == warned
    answer.write_text(json.dumps(told | {"verdict": "identified", "effects": ["air_film"]}), encoding="utf-8")
    assert main(["draft", str(answer), "--out", str(tmp_path / "film.py"), "--json"]) == 0
    assert "spindle add SCENE air_film --effect air_film.py --from" in capsys.readouterr().out  # of the user's own: `add` asks for its file


STEEP, SLIGHT = [0.5 + np.exp((t - 70) / 4) for t in AT], [3 + 0.02 * (t - 20) / 50 for t in AT]


@pytest.mark.parametrize("change", [STEEP, SLIGHT, [0.5 + np.exp(9000 * (1 / 343.15 - 1 / (t + 273.15))) for t in AT]], ids=["steep", "slight", "Arrhenius"])
def test_an_offset_may_be_large_beside_what_changes(change, tmp_path):
    """What is drafted keeps the rules and gives what was found: the offset over the size, of a law
    that is 1e-5 of what it is when hot, was 134 169 and beyond its limits."""
    _, own, law = drafted(of_rings(tmp_path, change, 1e-3), tmp_path)
    assert [law(t, 0.0, own.typical()) for t in AT] == pytest.approx(change, abs=4e-3)
    assert own.parameters[1].name == "offset"
    assert own.parameters[0].typical == pytest.approx(np.ptp(change), rel=0.3)  # at the hottest test: what was seen there
    assert law(70.0, 0.0, own.neutral()) == 0.0


def test_what_is_drafted_with_an_offset_is_nothing_of_no_size(spindle, tmp_path):
    """By every rule that `add` has: an offset beside the size was still there where the size was
    none, and `add` refused what `draft` had written."""
    for share in (0.1, 1.0):  # the bearings pressed, and loose
        text, own, _ = drafted(of_rings(tmp_path, [share * c for c in SLIGHT], 1e-3 * share), tmp_path)
        assert "+ offset" in text
        check(own, spindle)
        assert own.typical()["offset"] * own.typical()["size"] == pytest.approx(3 * share, rel=0.01)


def test_what_changes_by_nothing_is_not_drafted(tmp_path):
    with pytest.raises(BadInput, match="changes by 0 in every test"):
        draft(of_rings(tmp_path, np.zeros(6), 0.01), "own")


def test_a_law_that_two_tests_rule_out_is_not_drafted(tmp_path):
    """1 um at 20 C and 10 um at 60 C, to 0.1: once a constant of 5 +- 0.07. As many parameters as
    tests fit both, and the file says what that is worth."""
    text, own, law = drafted(of_rings(tmp_path, [1.0, 10.0], 0.1, (20.0, 60.0)), tmp_path)
    assert "linear in temperature" in own.title
    assert "2 parameters fit 2 tests whatever changes over them" in text
    assert [law(t, 0.0, own.typical()) for t in (20.0, 60.0)] == pytest.approx([1.0, 10.0], abs=1e-4)
    text = draft(of_rings(tmp_path, [5.0, 5.1], 0.1, (20.0, 60.0)), "own").text  # as it must be where nothing rules it out
    assert "radially drifts: constant" in text
    assert "of 2 tests with 1 parameters" in text


def test_a_drift_is_told_from_where_an_effect_is_neutral():
    """As a drafted file adds it there: an effect of one's own may be neutral at 1."""
    mechanism = SimpleNamespace(name="own", own_law=False, free=False, size=SimpleNamespace(name="size", unit="1", neutral=1.0), values=lambda size, shape: {})
    tests = [SimpleNamespace(condition=Condition(t)) for t in (20.0, 60.0)]
    h = SimpleNamespace(
        mechanisms=[mechanism], fit=SimpleNamespace(shapes=[()]), evidence=SimpleNamespace(ln=2.0, sizes=np.array([[1.0, 1.5]]), size_covariance=np.eye(2)[None])
    )
    found = SimpleNamespace(model=SimpleNamespace(tests=tests), base=SimpleNamespace(evidence=SimpleNamespace(ln=0.0)))
    assert _drift(found, h, 0).change.tolist() == [0.0, 0.5]


COMMON, OWN = 0.3, 0.003  # um, errors that all tests have alike and each its own


@pytest.mark.parametrize(("slope", "shift", "law"), [(0.1, 0.0, "linear in temperature"), (0.1, 1.5, "linear in temperature, and a constant"), (0.0, 1.5, "constant")])
def test_what_is_wrong_alike_in_all_tests_hides_no_law(slope, shift, law, tmp_path):
    """0.1 um over 50 K, 33 times what tests have of their own: with the standard errors alone, of
    nearly nothing but the common one, a constant was drafted. Size and error are those of
    generalised least squares (Aitken 1936) on paper: the common error leaves the slope alone."""
    random = np.random.default_rng(1)
    change = shift + COMMON * random.standard_normal() + slope * (np.array(AT) - 20) / 50 + OWN * random.standard_normal(6)
    answer = of_rings(tmp_path, change, float(np.hypot(COMMON, OWN)))
    assert "radially drifts: constant" in draft(answer, "own").text  # answers of before
    raw = json.loads(answer.read_text(encoding="utf-8"))
    raw["where"][0]["change_covariance"] = (COMMON**2 + OWN**2 * np.eye(6)).tolist()
    answer.write_text(json.dumps(raw), encoding="utf-8")
    text, own, _ = drafted(answer, tmp_path)
    assert own.title.endswith(f": {law}")
    if slope:
        x = (np.array(AT) - 20) / 40
        x -= x.mean()
        assert own.parameters[0].typical == pytest.approx(x @ change / (x @ x), rel=1e-3)
        assert f"+- {OWN / np.sqrt(x @ x):.2g} um" in text


@pytest.mark.parametrize("damaged", [[[1.0]], "none", [[1.0, 2.0], [2.0, 1.0]], [[1.0, 0.5], [0.0, 1.0]], [[-1.0, 0.0], [0.0, 1.0]], [[None, 0.0], [0.0, 1.0]], [[1e300, 0.0], [0.0, 1.0]]])
def test_what_is_no_covariance_is_refused(damaged, tmp_path):
    raw = json.loads(of_rings(tmp_path, [0.0, 10.0], 0.1, (20.0, 60.0)).read_text(encoding="utf-8"))
    raw["where"][0]["change_covariance"] = damaged
    (tmp_path / "d.json").write_text(json.dumps(raw), encoding="utf-8")
    with pytest.raises(BadInput, match="elements that drift"):
        draft(tmp_path / "d.json", "own")


def test_covariance_of_logarithms_by_hand():
    """Of ln(1 + c), by 1 / (1 + c): a stiffness that is halved, and one a quarter larger, both known to 1 % of what was."""
    rows = [{"temperature_C": t, "speed_rpm": 0.0, "relative": c, "sd": 0.01} for t, c in ((20.0, -0.5), (60.0, 0.25))]
    change, covariance = Place(element="mount", unit="%", change=rows, change_covariance=[[1e-4, 5e-5], [5e-5, 1e-4]]).logarithmic
    assert change == pytest.approx([100 * np.log(0.5), 100 * np.log(1.25)])
    assert covariance == pytest.approx(np.array([[4.0, 0.8], [0.8, 0.64]]))  # per cent: sd 2 and 0.8, correlation a half


CONDITIONS = [Condition(t, n * RPM) for t, n in ((20, 0), (20, 7200), (28, 0), (36, 0), (44, 7200), (52, 0), (60, 0), (60, 7200))]


@pytest.fixture(scope="module")
def slipping(spindle, tmp_path_factory):
    """Tables of modes of a spindle whose preload slips off by a fifth between 36 and 44 C, and what
    the free form says of them, as an answer."""
    hidden = next(m for m in free_forms(spindle) if m.name == "preload")

    def slip(spindle, condition, values):
        return hidden.effect.spindle(spindle, condition, {"change": 100 * np.log(0.8) if condition.temperature > 40 else 0.0})

    effect = replace(hidden.effect, spindle=slip)
    model = model_of(spindle, mode_campaign(spindle, CONDITIONS, 3, [(effect, {"change": 1.0})]))
    base = settled(model, Hypothesis(first := fit(model), evidence(model, first)))
    own = fit(model, (hidden,), Problem(model, (hidden,)).start({0: 0.0}))
    free = settled(model, Hypothesis(own, evidence(model, own)))
    factor = np.exp(free.evidence.sizes[0] / 100)
    sd = factor * np.sqrt(np.diag(free.evidence.size_covariance[0])) / 100
    rows = [
        {"temperature_C": c.temperature, "speed_rpm": c.speed / RPM, "relative": float(f - 1), "sd": float(s)}
        for c, f, s in zip(CONDITIONS, factor, sd, strict=True)
    ]
    covariance = np.outer(factor, factor) * free.evidence.size_covariance[0] / 1e4
    file = tmp_path_factory.mktemp("slipping") / "diagnosis.json"
    file.write_text(json.dumps({"where": [{"element": "preload", "unit": "%", "change": rows, "change_covariance": covariance.tolist()}]}), encoding="utf-8")
    return model, base, file


def left(model, h: Hypothesis) -> float:
    """Error on every temperature predicted from all others."""
    at = [c.temperature for c in CONDITIONS]
    return left_out(model, h.fit, h.evidence, [[k for k, t in enumerate(at) if t == one] for one in sorted(set(at))])[0]


def test_with_the_drafted_effect_the_error_falls(slipping, tmp_path):
    """Also on conditions that were left out, beside which the step lies between two others: there at least twofold; and it acts as drafted."""
    model, base, answer = slipping
    file = tmp_path / "slip.py"
    file.write_text(draft(answer, "slip").text, encoding="utf-8")
    effect = effect_of(file)
    assert effect.name == "slip"
    assert "step in temperature" in effect.title
    found: list[Mechanism] = variants(effect)
    own = fit(model, (found[0],), Problem(model, (found[0],)).start({0: effect.parameters[0].typical}))
    after = settled(model, Hypothesis(own, evidence(model, own)))
    assert after.evidence.ln > base.evidence.ln + 10
    assert left(model, after) < left(model, base) / 2
    assert after.evidence.sizes[0].mean() == pytest.approx(100 * np.log(0.8), abs=2.0)


def test_an_effect_of_the_catalogue_is_drafted_with_the_law_that_the_data_have(spindle, tmp_path):
    """Rings warmer by a law of temperature at rest, where friction gives nothing: the file acts as the effect does at 60
    C and 7200 rpm, its size by the law; at no size not at all, and what cannot be it is refused as the effect itself is."""
    at, values = Condition(60.0, 7200 * RPM), {"common_share": 0.2, "level_share": 0.0}
    rows = [{"temperature_C": t, "speed_rpm": n, "change_1": 0.02 * (t - 20), "sd": 0.01} for t in (20.0, 30.0, 40.0, 60.0) for n in (0.0, 7200.0)]
    effect = {"at": {"temperature_C": 60.0, "speed_rpm": 7200.0}, "values": values}
    answer, file = tmp_path / "d.json", tmp_path / "warm.py"
    place = {"element": "thermal_gradient", "unit": "1", "change": rows, "effect": effect}
    answer.write_text(json.dumps({"where": [place]}), encoding="utf-8")
    file.write_text(draft(answer, "warm").text, encoding="utf-8")
    drafted = effect_of(file)
    assert "linear in temperature" in drafted.title
    assert drafted.resembles[0] == "thermal_gradient"
    [own] = with_own_laws(variants(by_name("thermal_gradient", CATALOGUE))[:1], spindle, [at])
    cold, warm = Condition(20.0), Condition(40.0)
    fitted = drafted.typical()
    assert operating_point(spindle, cold, [(drafted, fitted)]).state.bearings[0].stiffness == pytest.approx(
        operating_point(spindle, cold).state.bearings[0].stiffness, rel=1e-4
    )
    by_file = operating_point(spindle, warm, [(drafted, fitted)]).state.bearings[0].stiffness
    by_effect = operating_point(spindle, warm, [(own.effect, {"scale": 0.4, **values})]).state.bearings[0].stiffness
    plain = operating_point(spindle, warm).state.bearings[0].stiffness
    assert by_file == pytest.approx(by_effect, rel=1e-4)
    assert abs(by_file[0, 0] / plain[0, 0] - 1) > 0.002
    damaged = json.loads(answer.read_text(encoding="utf-8"))
    damaged["where"][0]["effect"]["at"]["temperature_C"] = "hot"
    answer.write_text(json.dumps(damaged), encoding="utf-8")
    with pytest.raises(BadInput, match="elements that drift"):
        draft(answer, "warm")


def test_an_effect_that_departs_from_its_law_acts_by_its_formula_in_the_size_that_was_seen(spindle, tmp_path):
    """Without a condition `at` which its formula is asked: at each test's own. Half the size at 60
    C, where a law of its own softens with temperature."""
    softening = by_name("bond_softening", CATALOGUE)
    size, *others = softening.parameters
    values = {p.name: p.typical for p in others}
    rows = [{"temperature_C": t, "speed_rpm": 0.0, f"change_{size.unit}": size.typical * (1 - (t - 20) / 80), "sd": 0.01 * size.typical} for t in (20.0, 30.0, 40.0, 50.0, 60.0)]
    answer, file = tmp_path / "d.json", tmp_path / "own_bond.py"
    answer.write_text(json.dumps({"where": [{"element": "bond_softening", "unit": size.unit, "change": rows, "effect": {"values": values}}]}), encoding="utf-8")
    file.write_text(text := draft(answer, "own_bond").text, encoding="utf-8")
    assert "acts as its formula has it at each condition" in text
    own, hot = effect_of(file), Condition(60.0)
    by_file, by_effect = (operating_point(spindle, hot, [acting]).linear.stiffness for acting in ((own, own.typical()), (softening, {**values, size.name: size.typical / 2})))
    assert by_file == pytest.approx(by_effect, rel=1e-6, abs=1e-6 * np.abs(by_effect).max())
    assert not np.allclose(by_effect, operating_point(spindle, hot).linear.stiffness, rtol=1e-3)
    check(own, spindle)


@pytest.mark.parametrize(("told", "counted"), [({"reference_temperature_C": 35.0}, "(T - 35) / 40"), ({"reference_temperature_C": -5.0}, "(T + 5) / 40"), ({}, "(T - 20) / 40")])
def test_laws_count_temperature_from_the_scenes_reference(told, counted, tmp_path):
    """What falls in proportion to the distance from there falls by nothing there, so that no
    constant is left over; older answers count from 20 C."""
    zero = told.get("reference_temperature_C", 20.0)
    rows = [{"temperature_C": t, "speed_rpm": 0.0, "relative": np.expm1(-0.002 * (t - zero)), "sd": 0.001} for t in (zero, 28.0, 36.0, 44.0, 52.0, 60.0)]
    (tmp_path / "d.json").write_text(json.dumps({"where": [{"element": "preload", "unit": "%", "change": rows}], **told}), encoding="utf-8")
    text = draft(tmp_path / "d.json", "own").text
    assert f"change = size * ({counted}) in %," in text
    (tmp_path / "own.py").write_text(text, encoding="utf-8")
    assert [p.name for p in effect_of(tmp_path / "own.py").parameters] == ["size"]


def test_help_says_that_a_draft_is_a_file(capsys):
    with pytest.raises(SystemExit):
        main(["draft", "--help"])
    said = capsys.readouterr().out
    assert "--out FILE.py" in said
    assert "folder to write" not in said


def test_drafts_of_what_is_not_there_are_refused(slipping, tmp_path):
    _, _, answer = slipping
    with pytest.raises(BadInput, match="--element mount"):
        draft(answer, "own", "mount")
    empty = tmp_path / "none.json"
    empty.write_text('{"where": []}', encoding="utf-8")
    with pytest.raises(BadInput, match="there is nothing to draft"):
        draft(empty, "own")


@pytest.mark.parametrize(("beside", "told"), [(["preload"], True), (["mount stiffness"], False)])
def test_what_add_is_told_to_take_goes_with_the_draft(slipping, tmp_path, capsys, beside, told):
    """The build tolerances of an answer only where they were fitted beside what is drafted: of another explanation `add` refuses them."""
    _, _, answer = slipping
    source = tmp_path / "d.json"
    source.write_text(json.dumps(json.loads(answer.read_text()) | {"tolerances_beside": beside}), encoding="utf-8")
    assert main(["draft", str(source), "--out", str(tmp_path / "own.py")]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert ("--from" in said) == told
    assert "spindle add SCENE own --effect" in said


def test_temperatures_beyond_a_law_are_drafted_too(tmp_path):
    """Found by `make torture`: the middle between 50 and 600 C lies outside the limits of the sigmoid's, from where no fit may start."""
    from tests.torture.wholes import diagnosis

    raw = json.loads(diagnosis())
    raw["where"][0]["change"][-1]["temperature_C"] = 600.0
    (tmp_path / "d.json").write_text(json.dumps(raw), encoding="utf-8")
    assert "EFFECT" in draft(tmp_path / "d.json", "own", None).text
