"""What the files do not tell: the mapping file, its form, and the questions it leaves open."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conftest import ROOT, SCENE
from tests.made_campaign import FREQUENCY
from tests.sim.importing.exported import FRF, HEAD, SPINDLE, columns, imported, table
from thermospindle.model.errors import BadInput, Unanswered
from thermospindle.model.scene.reading import load
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import read_campaign


def test_direction_turned(tmp_path):
    """A sensor that looks along +X, at a point along -X: the sign is turned."""
    heads, found = columns("real", "(m/s)/N", FRF.value * np.array([1, -1, 1])[:, None, None])
    heads = [h.replace("H(3,", "H(3:+X,") for h in heads]
    frf = imported(tmp_path, "", table(tmp_path / "T20.csv", ["Hz", *heads], [FREQUENCY, *found]))
    np.testing.assert_allclose(frf.value, FRF.value, rtol=1e-8, atol=1e-12)


def test_everything_open_is_asked_at_once(tmp_path):
    file = table(tmp_path / "lab.csv", ["Frequency", "H(7,8) mag", "H(7,8) phase"], [FREQUENCY, np.abs(FRF.value[0, 0]), np.angle(FRF.value[0, 0])])
    with pytest.raises(Unanswered) as caught:
        bring([file], out=tmp_path / "c")
    text = "\n".join(caught.value.items)
    for word in ("phase_unit", "unit: the unit of its FRFs", "called: which points '7', '8' are", "temperature_C", "speed_rpm", "spindle"):
        assert word in text
    assert not (tmp_path / "c").exists()


def test_the_form_is_written_and_filled_in(tmp_path, capsys):
    """The form of an unknown file, its open answers filled in by search and replace, makes the campaign."""
    heads, found = columns("real", "(m/s)/N")
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    mapping = tmp_path / "lab.toml"
    answer = bring([file], mapping=mapping)
    assert len(answer.values["open"]) == 4
    text = mapping.read_text()
    assert "temperature_C = 20 " in text
    for old, new in (('spindle = "?"', 'spindle = "hdd_2003"'), ('speed_rpm = "?"', "speed_rpm = 0.0"), ('body = "?"', 'body = "hub"'),
                     ('["?", "?", "?"]', "[1.0, 2.0, 3.0]"), ('direction = "?"', 'direction = "+Z"')):  # fmt: skip
        assert old in text
        text = text.replace(old, new)
    mapping.write_text(text)
    bring([file], mapping=mapping, out=tmp_path / "c")
    assert [p.node for p in read_campaign(tmp_path / "c").points] == [1, 3, 6]


@pytest.mark.parametrize(("name", "left"), [("T20_n0", 0), ("T20", 1)])
def test_a_form_that_names_fill_in_is_not_said_to_be_open(tmp_path, name, left):
    """With --out too: what the names of files tell stands in the form, to be checked, and the same command again makes the campaign."""
    heads, found = columns("real", "(m/s)/N")
    file = table(tmp_path / f"{name}.csv", ["Frequency", *heads], [FREQUENCY, *found])
    asked = {"mapping": tmp_path / "lab.toml", "scene": ROOT / "scenes" / "hdd_2003", "out": tmp_path / "c"}
    said = r"1 thing is not told by the files: \(1\) T20: speed_rpm.*answer them in .*lab.toml, which is written" if left else "lab.toml is written, and nothing is open in it: T20_n0: 20 C, 0 rpm, read off the names"
    with pytest.raises(BadInput, match=said):
        bring([file], **asked)
    assert not (tmp_path / "c").exists()
    if not left:
        bring([file], **asked)
        assert read_campaign(tmp_path / "c").tests[0].temperature == 20.0


def test_what_all_tests_lack_is_answered_once(tmp_path):
    """One table for all tests, and one of a test that says otherwise; the form asks so, and a pattern that no test fits is refused."""
    heads, found = columns("real", "(m/s)/N")
    files = [table(tmp_path / f"run{k}.csv", ["Frequency [Hz]", *heads], [FREQUENCY, *found]) for k in range(3)]
    bring(files, scene=SCENE, mapping=tmp_path / "form.toml")
    text = (tmp_path / "form.toml").read_text()
    assert text.count('speed_rpm = "?"') == text.count('temperature_C = "?"') == 1
    (tmp_path / "form.toml").write_text(text.replace('speed_rpm = "?"', "speed_rpm = 0.0").replace('temperature_C = "?"', "temperature_C = 20.0").replace('id = "run2"\n# temperature_C = 20.0', 'id = "run2"\ntemperature_C = 35.0'))
    bring(files, scene=SCENE, mapping=tmp_path / "form.toml", out=tmp_path / "c")
    assert [(t.id, t.temperature, t.speed) for t in read_campaign(tmp_path / "c").tests] == [("run0", 20.0, 0.0), ("run1", 20.0, 0.0), ("run2", 35.0, 0.0)]
    (tmp_path / "form.toml").write_text(text.replace('id = "*"', 'id = "T*"'))
    with pytest.raises(BadInput, match=r"id = 'T\*': no file makes such a test; there are run0, run1, run2"):
        bring(files, scene=SCENE, mapping=tmp_path / "form.toml", out=tmp_path / "d")


@pytest.mark.parametrize(("names", "roving"), [(("p1", "p2", "p3"), True), (("T20", "T40", "T60"), False)])
def test_files_that_may_be_one_roving_test_are_said_to_be(tmp_path, names, roving):
    """Nine numbered files of a shaft became nine tests without a word."""
    heads, found = columns("real", "(m/s)/N", FRF.value)
    files = [table(tmp_path / f"{name}.csv", ["Frequency", *heads], [FREQUENCY, *found]) for name in names]
    said = bring(files, mapping=tmp_path / "m.toml").values["proposed"]
    assert ("3 files, a test each: where hammer or sensor roved and they are one test, give them the same test" in said) == roving


def test_arrays_that_are_not_needed_are_ignored_by_one_key(tmp_path):
    """Each of ten other arrays of a .mat had to be told "ignore" by itself; `Freq_domain` and
    `Time_domain` are axes, and that of time not the one of FRFs."""
    others = {f"PSD_chan_{k}": np.ones(len(FREQUENCY)) for k in range(8)}
    file = tmp_path / "T20.npz"
    lists = {"response_nodes": FRF.response_nodes, "reference_nodes": FRF.reference_nodes}
    np.savez(file, Freq_domain=FREQUENCY, Time_domain=np.arange(3 * len(FREQUENCY)) / 1000, H=FRF.value, **lists, **others)
    mapping = tmp_path / "form.toml"
    [asked, *_] = bring([file], mapping=mapping).values["open"]
    assert "what PSD_chan_0" in asked
    assert "domain" not in asked
    assert '# "*" = "ignore"    # instead of the lines of all that are not needed' in mapping.read_text()
    frf = imported(tmp_path, '[[files]]\nfile = "*"\nunit = "(m/s)/N"\ncolumns = { "*" = "ignore" }\n', file)
    np.testing.assert_allclose(frf.frequency, FREQUENCY)
    np.testing.assert_allclose(frf.value, FRF.value, rtol=1e-12)


def test_ends_that_are_counted_along_an_array_say_so(tmp_path):
    file = tmp_path / "T20.npz"
    np.savez(file, frequency=FREQUENCY, H=FRF.value)
    with pytest.raises(Unanswered) as caught:
        bring([file], out=tmp_path / "c")
    [asked] = [item for item in caught.value.items if "which points" in item]
    assert asked.endswith("; 'response 1' is counted along an array that names no nodes")


def test_a_table_ignores_the_rest_too(tmp_path):
    heads, found = columns("real", "(m/s)/N")
    file = table(tmp_path / "T20.csv", ["Frequency", *heads, "Ch 9"], [FREQUENCY, *found, np.ones(len(FREQUENCY))])
    np.testing.assert_allclose(imported(tmp_path, '[[files]]\nfile = "*"\ncolumns = { "*" = "ignore" }\n', file).value, FRF.value, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ('{ "Recep" = "H(1,1)" }', "files: columns: 'Recep' is no column of T20.csv; there are Frequency, "),
        ('{ "*" = "H(1,1)" }', "files: columns: '\\*' = 'H\\(1,1\\)': all columns that nothing else tells can only be \"ignore\""),
    ],
)
def test_a_column_that_is_not_there_is_refused(tmp_path, told, said):
    """It was silently not used."""
    heads, found = columns("real", "(m/s)/N")
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    with pytest.raises(BadInput, match=said):
        imported(tmp_path, f'[[files]]\nfile = "T20.csv"\ncolumns = {told}\n', file)


def test_a_file_that_makes_no_campaign_asks_nothing(tmp_path):
    """Coherence alone: its form had "1 answer is open", the scene's name."""
    file = tmp_path / "coherence.unv"
    file.write_bytes((ROOT / "tests" / "data" / "uff_files_jl" / "dataset58_coh.unv").read_bytes())
    with pytest.raises(BadInput, match=r"coherence\.unv: no FRF, time record or mode in it; geometry, spectra or coherence alone are no campaign"):
        bring([file], mapping=tmp_path / "form.toml")
    assert not (tmp_path / "form.toml").exists()


def test_tables_without_a_name_are_counted_from_one(tmp_path):
    """`files.0.step_Hz` beside `points.1`, which was the first."""
    told = tmp_path / "told.toml"
    told.write_text('[[files]]\nfile = "*"\nstep_Hz = -1\n')
    with pytest.raises(BadInput, match=r"told\.toml: files\.1\.step_Hz = -1: "):
        bring([tmp_path / "x.csv"], mapping=told, out=tmp_path / "c")


def test_answers_alone_are_said_to_be_of_no_use(tmp_path):
    time = np.arange(4000) / 8000
    file = table(tmp_path / "operating.csv", ["Time [s]", "acceleration 3 [g]"], [time, np.sin(900 * time)])
    with pytest.raises(Unanswered) as caught:
        bring([file], out=tmp_path / "c")
    assert any("answers alone, without the force that was hit with, are no measurement that can be used" in item for item in caught.value.items), caught.value.items


@pytest.mark.parametrize(("rows", "count"), [(("1,5,2,25,3,5", "2,5,2,35,3,6"), 6), (("1,2,25,3,5", "2,2,35,3,6"), 5)])
def test_commas_for_columns_and_decimals_are_named(tmp_path, rows, count):
    """It was asked what column 1 to column 6 are, under three headings."""
    file = tmp_path / "german.csv"
    file.write_text("\n".join(["Frequency,Re,Im", *rows]) + "\n")
    with pytest.raises(BadInput, match=rf"german\.csv: 3 headings stand over {count} numbers: with commas between columns and in numbers nobody can tell"):
        bring([file], out=tmp_path / "c")


def test_a_title_above_numbers_is_no_row_of_headings(tmp_path):
    file = tmp_path / "titled.csv"
    file.write_text("cold, first\n100.5,2.5,3.0,1\n200.5,2.5,3.0,1\n")
    with pytest.raises(Unanswered, match="not told by the files"):
        bring([file], out=tmp_path / "c")


def test_points_of_a_scene(tmp_path):

    heads, found = columns("real", "(m/s)/N", FRF.value)
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    (tmp_path / "m.toml").write_text('[[tests]]\nid = "T20"\ntemperature_C = 20.0\nspeed_rpm = 0.0\n')
    values = bring([file], mapping=tmp_path / "m.toml", scene=SCENE, out=tmp_path / "c").values
    assert values["points"] == [{"node": 1, "name": "hub_top0"}, {"node": 3, "name": "hub_side0"}, {"node": 6, "name": "seat90"}]
    assert values["tests"][0]["band_Hz"] == [FREQUENCY[0], FREQUENCY[-1]]
    assert values["warnings"] == []


@pytest.mark.parametrize(
    ("unit", "temperature", "speed", "doubts"),
    [("Hz", 293.15, 0.0, ["test T20: temperature_C = 293.15, and hdd_2003 is meant for 20 to 60 C: is it in another unit?"]),
     ("Hz", 20.0, -1e9, ["test T20: speed_rpm = -1e+09, and hdd_2003 is meant for 7200 rpm: is it in another unit?"]), ("kHz", 20.0, 0.0, ["test T20: lines from 400000 to"])],
)  # fmt: skip
def test_other_units_than_the_scenes_are_doubted(tmp_path, unit, temperature, speed, doubts):

    heads, found = columns("real", "(m/s)/N", FRF.value)
    file = table(tmp_path / "T20.csv", [f"Frequency [{unit}]", *heads], [FREQUENCY, *found])
    (tmp_path / "m.toml").write_text(f'[[tests]]\nid = "T20"\ntemperature_C = {temperature}\nspeed_rpm = {speed}\n')
    said = bring([file], mapping=tmp_path / "m.toml", scene=SCENE, out=tmp_path / "c").values["warnings"]
    assert len(said) == len(doubts)
    assert all(one.startswith(doubt) for one, doubt in zip(said, doubts, strict=True))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda v: v.conj(), r"T20.csv .*conjugated.*conjugate = true"),
        (lambda v: -v, r"negative real part.*as 3:-Z for 3:\+Z"),
        (lambda v: v * 2j * np.pi * FREQUENCY, r"negative real part.*taken for accelerance its numbers pass: is its unit told as that of mobility by mistake"),
        (lambda v: v * np.where(np.arange(301) == 150, 0, 1), r"zero on 1 lines.*band_Hz"),
        (lambda v: v * np.array([[1, 3], [1, 1], [1, 1]])[:, :, None], r"reciprocity.*another unit, sign or node"),
    ],
    ids=["conjugated", "sign", "unit", "gap", "reciprocity"],
)
def test_what_no_structure_does_is_told_with_the_users_file(tmp_path, change, said):
    heads, found = columns("real", "(m/s)/N", change(FRF.value))
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    with pytest.raises(BadInput, match=said):
        imported(tmp_path, "", file)


def test_a_sign_that_looks_like_another_quantity_is_told_as_a_sign(tmp_path):
    """Minus an accelerance is a receptance's phase."""
    heads, found = columns("real", "(m/s^2)/N", -FRF.value * 2j * np.pi * FREQUENCY)
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    with pytest.raises(BadInput, match=r"looks the other way, say so where it is named, by the other sign of its axis, as 3:-Z for 3:\+Z; .*; or, where the unit may be wrong, taken for receptance"):
        imported(tmp_path, "", file)


def test_a_conjugated_export_is_turned_by_one_key(tmp_path):
    heads, found = columns("real", "(m/s)/N", FRF.value.conj())
    frf = imported(tmp_path, '[[files]]\nfile = "*.csv"\nconjugate = true\n', table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found]))
    np.testing.assert_allclose(frf.value, FRF.value, rtol=1e-8, atol=1e-12)


def test_missing_pairs_leave_the_largest_rectangle(tmp_path):
    heads, found = columns("real", "(m/s)/N")
    (tmp_path / "mapping.toml").write_text(SPINDLE + HEAD)
    file = table(tmp_path / "T20.csv", ["Frequency", *heads[:-2]], [FREQUENCY, *found[:-2]])
    notes = bring([file], mapping=tmp_path / "mapping.toml", out=tmp_path / "c").values["notes"]
    assert read_campaign(tmp_path / "c").tests[0].frf.value.shape[:2] == (2, 2)
    assert any("H(6,1) left out" in n for n in notes)


def test_files_of_one_test_are_put_together_in_the_form(tmp_path):
    """A file a hammer point, in decibels over micrometres, decimal comma, UTF-16 with its mark: nothing is left to be asked."""
    force = FRF.value / (2j * np.pi * FREQUENCY) * 1e6
    for j, q in enumerate(FRF.reference_nodes):
        heads = [f"H({r},{q}) {part}" for r in FRF.response_nodes for part in ("dB [dB re 1 µm/N]", "Phase [°]")]
        found = [v for h in force[:, j] for v in (20 * np.log10(np.abs(h)), np.degrees(np.angle(h)))]
        file = table(tmp_path / f"Spindel_20C_0rpm_Hammer{q}.csv", ["Frequenz [Hz]", *heads], [FREQUENCY, *found], ";", comma=True, above="Prüfer: K. Müller\n\n")
        file.write_bytes(file.read_text(encoding="utf-8").encode("utf-16"))
    mapping = tmp_path / "lab.toml"
    values = bring([tmp_path / "*.csv"], mapping=mapping, scene="hdd_2003").values
    assert values["proposed"] == ["Spindel_20C_0rpm: 20 C, 0 rpm, 2 files"]
    bring([tmp_path / "*.csv"], mapping=mapping, scene="hdd_2003", out=tmp_path / "c")
    (test,) = read_campaign(tmp_path / "c").tests
    assert test.frf.quantity == "receptance"
    np.testing.assert_allclose(test.frf["hub_side0", "seat90"], force[1, 1] * 1e-6, rtol=1e-8)


def test_a_question_about_all_files_is_answered_once(tmp_path):
    """What every file lacks stands once in the form, column by column; a point that two files would hold twice keeps them apart."""
    for name in ("T20_hit1", "T20_hit2", "T60_hit1"):
        table(tmp_path / f"{name}.csv", ["Frequency [Hz]", "left", "right"], [FREQUENCY, *np.abs(FRF.value[:2, 0])])
    mapping = tmp_path / "lab.toml"
    bring([tmp_path / "*.csv"], mapping=mapping, scene="hdd_2003")
    text = mapping.read_text()
    assert (text.count('"left" = "?"'), text.count('file = "*.csv"')) == (1, 1)
    mapping.write_text(text.replace('"left" = "?"', '"left" = "H(1,1) mag"').replace('"right" = "?"', '"right" = "H(3,1) mag"').replace('speed_rpm = "?"', "speed_rpm = 0"))
    values = bring([tmp_path / "*.csv"], mapping=mapping, scene="hdd_2003", out=tmp_path / "c").values
    assert [t["id"] for t in values["tests"]] == ["T20", "T60_hit1"]


def test_points_on_a_flexible_shaft_are_told_by_its_name(tmp_path):
    scene = load("mk7702")
    shaft = scene.structure.shafts[0]
    height = scene.points[0].position[2]
    point = f'[[points]]\nnode = 77\nname = "nose"\nbody = "{shaft.name}"\nposition_mm = [0.0, 0.0, {1e3 * height}]\ndirection = "+X"\n'
    (tmp_path / "m.toml").write_text('[[tests]]\nid = "T20"\ntemperature_C = 20.0\nspeed_rpm = 0.0\n' + point)
    h = FRF.value[0, 0]
    file = table(tmp_path / "T20.csv", ["Frequency", "H(77,77) real [(m/s)/N]", "H(77,77) imag"], [FREQUENCY, h.real, h.imag])
    bring([file], mapping=tmp_path / "m.toml", scene="mk7702", out=tmp_path / "c")
    assert read_campaign(tmp_path / "c").points[0].body == shaft.name
    (tmp_path / "m.toml").write_text((tmp_path / "m.toml").read_text().replace(f'body = "{shaft.name}"', 'body = "nowhere"'))
    with pytest.raises(Unanswered, match=f"a body of the scene mk7702 .*{shaft.name}"):
        bring([file], mapping=tmp_path / "m.toml", scene="mk7702", out=tmp_path / "d")


def test_patterns_and_folders(tmp_path):
    """A pattern that no shell expanded is expanded; a folder is told from a file."""
    (tmp_path / "a.csv").write_text("frequency,mode\n1000,1\n")
    (tmp_path / "b.csv").write_text("frequency,mode\n1001,1\n")
    assert len(bring([tmp_path / "*.csv"], mapping=tmp_path / "m.toml").values["open"]) == 4
    with pytest.raises(BadInput, match=r"is a folder; name its files"):
        bring([tmp_path], out=tmp_path / "c")
    with pytest.raises(BadInput, match=r"\*\.txt: no file is called so"):
        bring([tmp_path / "*.txt"], out=tmp_path / "c")


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ('[[files]]\nfile = "other.csv"\n', r"m.toml: files: file = 'other.csv': is none of T20.csv"),
        ('[[tests]]\nid = "T30"\n', r"m.toml: tests: id = 'T30': no file makes such a test; there are T20"),
        ('[[files]]\nfile = "*"\nunits = "g/N"\n', "did you mean unit"),
        ("[[points]]\nnode = 1\n[[points]]\nnode = 1\n", "points: node = 1 stands 2 times"),
        ('[[points]]\nnode = 1\nname = "much too long a name"\n', "points.1: name = 'much too long a name'"),
        ("[records]\nband_Hz = [1.0]\n", "records.band_Hz"),
        ("[records]\nband_Hz = [3e3, 50]\n", r"m.toml: records.band_Hz = \[3000.0, 50\]: its ends are the wrong way round"),
        ("band_Hz = [3e3, 50]\n", r"m.toml: band_Hz = \[3000.0, 50\]: its ends are the wrong way round; the lower one comes first"),
    ],
)
def test_a_wrong_mapping_is_one_sentence(tmp_path, wrong, said):
    heads, found = columns("real", "(m/s)/N")
    file = table(tmp_path / "T20.csv", ["Frequency", *heads], [FREQUENCY, *found])
    (tmp_path / "m.toml").write_text(wrong)
    with pytest.raises(BadInput, match=said):
        bring([file], mapping=tmp_path / "m.toml", out=tmp_path / "c")


def test_the_form_proposes_conditions_of_the_scene(tmp_path):
    """It proposed 7200 rpm to every machine."""
    heads, found = columns("real", "(m/s)/N")
    files = [table(tmp_path / f"run{k}.csv", ["Frequency [Hz]", *heads], [FREQUENCY, *found]) for k in range(3)]
    for scene, speed in ((SCENE, "7200.0"), (ROOT / "scenes" / "five_bearing", "8000.0"), (ROOT / "scenes" / "free_shaft", "0.0")):
        form = tmp_path / f"{scene.name}.toml"
        bring(files, scene=scene, mapping=form)
        assert form.read_text(encoding="utf-8").count(f"# speed_rpm = {speed}    # where it is another") == 3
