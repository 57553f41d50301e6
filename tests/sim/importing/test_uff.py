"""What a UFF file says of its axes, units and ends is used, each part alone, or refused in one
sentence; FRFs are the rotor's own, written by hand."""

from __future__ import annotations

import numpy as np
import pytest

from tests.made_campaign import FREQUENCY, POINTS
from tests.sim.importing.exported import DIRECTIONS, FRF, HEAD, PAIRS, SPINDLE, columns, imported, set_58, set_164, table
from thermospindle.model.errors import BadInput, Unanswered
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.campaign.uff import read_frf
from thermospindle.sim.importing import units


def frfs(**how) -> str:
    """Every FRF in its place; `how` goes to the sets."""
    x, factor = how.pop("x", FREQUENCY), how.pop("factor", 1.0)
    return "".join(set_58(x, factor * h, (r, DIRECTIONS[r]), (q, DIRECTIONS[q]), **how) for (r, q), h in zip(PAIRS, FRF.value.reshape(len(PAIRS), -1), strict=True))


def written(folder, text, name="T20.uff"):
    (folder / name).write_text(text)
    return folder / name


@pytest.mark.parametrize(("label", "kind", "factor"), [("rad/s", 18, 2 * np.pi), ("rad/sec", 18, 2 * np.pi), ("kHz", 18, 1e-3), ("KHZ", 0, 1e-3), ("rpm", 18, 60.0), ("Hz", 1, 1.0), ("NONE", 18, 1.0)])
def test_lines_in_any_unit_that_is_known(tmp_path, label, kind, factor):
    """All were read as Hz: modes 6.28 and 1000 times off without a word."""
    frf = imported(tmp_path, "", written(tmp_path, frfs(x=FREQUENCY * factor, kinds=(kind, 11, 13), labels=(label, "m/s", "N"))))
    np.testing.assert_allclose(frf.frequency, FREQUENCY, rtol=1e-5)
    np.testing.assert_allclose(frf.value, FRF.value, rtol=1e-9)


@pytest.mark.parametrize(("label", "kind"), [("orders", 20), ("orders", 18), ("s", 17), ("bar", 0)])
def test_lines_that_are_no_frequency_are_refused_unless_the_mapping_tells_them(tmp_path, label, kind):
    file = written(tmp_path, frfs(kinds=(kind, 11, 13), labels=(label, "m/s", "N")))
    with pytest.raises(BadInput, match=rf"T20.uff: set 1: abscissa of type {kind} in '{label}'; allowed is frequency \(18\) in Hz, kHz, rad/s, rpm; start_Hz and step_Hz in its \[\[files\]\]"):
        imported(tmp_path, "", file)
    frf = imported(tmp_path, '[[files]]\nfile = "T20.uff"\nstart_Hz = 400.0\nstep_Hz = 1.0\n', file)
    np.testing.assert_allclose(frf.frequency, FREQUENCY)


def test_an_axis_that_says_nothing_is_said_to_be_taken_in_SI(tmp_path):
    file = written(tmp_path, frfs(kinds=(0, 11, 13), labels=("NONE", "m/s", "N")))
    (tmp_path / "m.toml").write_text(SPINDLE + HEAD)
    notes = bring([file], mapping=tmp_path / "m.toml", out=tmp_path / "c").values["notes"]
    assert f"T20.uff: functions that do not say what their abscissa is ({len(PAIRS)}) are taken in Hz, time records in s" in notes


@pytest.mark.parametrize("heading", ["Frequency [rad/s]", "Frequency (rad/s)"])
def test_lines_of_a_text_table_in_another_unit(tmp_path, heading):
    heads, found = columns("real", "(m/s)/N")
    frf = imported(tmp_path, "", table(tmp_path / "T20.csv", [heading, *heads], [2 * np.pi * FREQUENCY, *found]))
    np.testing.assert_allclose(frf.frequency, FREQUENCY, rtol=1e-9)


def test_an_axis_of_a_text_table_in_a_unit_that_is_not_known(tmp_path):
    heads, found = columns("real", "(m/s)/N")
    file = table(tmp_path / "T20.csv", ["Frequency [bar]", *heads], [FREQUENCY, *found])
    with pytest.raises(BadInput, match=r'Frequency \[bar\]: its unit \'bar\' is none of frequency that is known; allowed are Hz, kHz, rad/s, rpm; columns tells it, as in "frequency \[Hz\]"'):
        imported(tmp_path, "", file)
    frf = imported(tmp_path, '[[files]]\nfile = "T20.csv"\ncolumns = { "Frequency [bar]" = "frequency [kHz]" }\n', file)
    np.testing.assert_allclose(frf.frequency, 1e3 * FREQUENCY, rtol=1e-9)


@pytest.mark.parametrize(
    ("above", "below", "factor"),
    [("NONE", "NONE", 1e3 / 10), ("NONE", "lbf", 1e3 * 4.4482216152605), ("m/s", "NONE", 1 / 10), ("NONE", "N", 1e3), ("mm/s", "N", 1e3)],
)
def test_each_side_of_an_frf_has_the_unit_of_its_label_or_of_set_164(tmp_path, above, below, factor):
    """Set 164 is 1000 to a metre and 10 to a newton; a force's label beside it was dropped, and a label of the numerator alone was no unit."""
    frf = imported(tmp_path, "", written(tmp_path, set_164(1e3, 10.0) + frfs(labels=("Hz", above, below), factor=factor)))
    np.testing.assert_allclose(frf.value, FRF.value, rtol=1e-8)


def test_a_unit_that_one_frf_has_and_nobody_knows_is_told_with_its_set_and_with_those_that_are_known(tmp_path):
    """It was told of the file, whose other FRFs have others, and none that is known was named."""
    rows = list(zip(PAIRS, FRF.value.reshape(len(PAIRS), -1), strict=True))
    sets = [set_58(FREQUENCY, h, (r, DIRECTIONS[r]), (q, DIRECTIONS[q]), labels=("Hz", "m/s" if k else "furlong", "N")) for k, ((r, q), h) in enumerate(rows)]
    (tmp_path / "m.toml").write_text(SPINDLE + HEAD)
    with pytest.raises(Unanswered) as asked:
        bring([written(tmp_path, "".join(sets))], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    told = str(asked.value)
    assert "'(furlong)/N' is none; known are m, mm, um, nm, in, mil, mils, thou, m/s," in told
    assert "over N, mN, kN or lbf (that is set 1; its other FRFs have units that are known)" in told


@pytest.mark.parametrize("factors", [(0.0, 0.0), (1e3, 0.0), (0.0, 1.0)])
def test_factors_of_nothing_are_refused_with_geometry_and_without(tmp_path, factors):
    geometry = f"    -1\n    15\n{1:10d}{0:10d}{0:10d}{0:10d}{12.0:13.5E}{0.0:13.5E}{20.0:13.5E}\n    -1\n" if factors[0] == 0 else ""
    file = written(tmp_path, set_164(*factors) + geometry + frfs(labels=("Hz", "NONE", "NONE")))
    for reading in (lambda: imported(tmp_path, "", file), lambda: read_frf(file, "mobility", POINTS)):
        with pytest.raises(BadInput, match=rf"T20.uff.*: data set 164: the factor of {'force' if factors[0] else 'length'} = 0: must lie between"):
            reading()


def by_name(turned: int, direction: int, sign: float = 1.0) -> str:
    """Ends by name alone, node 0; that of `turned` looks in another direction."""
    names = {1: "hub_top0", 3: "hub_side0", 6: "seat90"}
    text = ""
    for (r, q), h in zip(PAIRS, FRF.value.reshape(len(PAIRS), -1), strict=True):
        ends = [(0, direction if n == turned else DIRECTIONS[n]) for n in (r, q)]
        text += set_58(FREQUENCY, h * (sign if r == turned else 1) * (sign if q == turned else 1), *ends, names=(names[r], names[q]))
    return text


def test_the_direction_of_an_end_that_is_told_by_name_counts(tmp_path):
    """As that of one told by node does: its sign was left as it was."""
    frf = imported(tmp_path, "", written(tmp_path, by_name(3, 1, -1.0)))
    np.testing.assert_allclose(frf.value, FRF.value, rtol=1e-9)


def test_a_named_end_across_its_point_is_asked_about_and_may_be_told(tmp_path):
    file = written(tmp_path, by_name(3, 2))
    with pytest.raises(Unanswered, match=r"points: called: which points 'hub_side0:\+Y' are: a \[\[points\]\] with called = \[\"hub_side0:\+Y\"\]"):
        imported(tmp_path, "", file)
    (tmp_path / "m.toml").write_text(SPINDLE + HEAD.replace('direction = "-X"', 'direction = "-X"\ncalled = ["hub_side0:+Y"]'))
    bring([file], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    assert read_campaign(tmp_path / "c").tests[0].frf.response_nodes == (1, 3, 6)


def with_coherence(directions=DIRECTIONS, lines=slice(None), pairs=PAIRS, extra="") -> str:
    return frfs() + extra + "".join(
        set_58(FREQUENCY[lines], FRF.coherence[FRF.response_nodes.index(r), FRF.reference_nodes.index(q)][lines], (r, directions[r]), (q, directions[q]), 6, (18, 0, 0), ("Hz", "NONE", "NONE"))
        for r, q in pairs
    )


def brought(tmp_path, text):
    (tmp_path / "m.toml").write_text(SPINDLE + HEAD)
    notes = bring([written(tmp_path, text)], mapping=tmp_path / "m.toml", out=tmp_path / "c").values["notes"]
    return read_campaign(tmp_path / "c").tests[0].frf, [n for n in notes if "coherence" in n]


NOWHERE = dict.fromkeys(DIRECTIONS, 0)


@pytest.mark.parametrize("directions", [DIRECTIONS, NOWHERE, {n: -d for n, d in DIRECTIONS.items()}], ids=["same", "none", "opposite"])
def test_coherence_belongs_to_the_one_frf_between_its_points(tmp_path, directions):
    """Without directions it was dropped, and nothing said so."""
    frf, notes = brought(tmp_path, with_coherence(directions))
    np.testing.assert_allclose(frf.coherence, FRF.coherence, rtol=1e-9)
    assert notes == []


@pytest.mark.parametrize(("lines", "first"), [(slice(1, None), "400"), (slice(None, -1), "700")])
def test_a_coherence_with_a_line_less_cuts_its_frf_to_the_lines_of_both(tmp_path, lines, first):
    frf, notes = brought(tmp_path, with_coherence(lines=lines))
    np.testing.assert_allclose(frf.frequency, FREQUENCY[lines])
    np.testing.assert_allclose(frf.value, FRF.value[..., lines], rtol=1e-9)
    np.testing.assert_allclose(frf.coherence, FRF.coherence[..., lines], rtol=1e-9)
    assert notes == [f"T20.uff: the line at {first} Hz of set 1, set 2, set 3, set 4 and 2 more left out: coherence has no such line"]


def test_coherence_that_fits_no_frf_is_left_out_by_name(tmp_path):
    _, notes = brought(tmp_path, with_coherence(lines=slice(0, 150)))
    assert "coherence of 1:+Z over 1:+Z (set 7), 1:+Z over 6:+Z (set 8)," in notes[0]
    assert "and 2 more left out: 150 lines from 400 to 549 Hz are not the 301 from 400 to 700 Hz of the FRF" in notes[0]


def test_coherence_of_one_pair_alone_is_left_out_with_what_lacks_it(tmp_path):
    frf, notes = brought(tmp_path, with_coherence(pairs=PAIRS[:5]))
    assert frf.coherence is None
    assert notes == ["test T20: its coherence left out: H(6,6) has none"]


def test_coherence_that_may_be_of_two_frfs_or_of_none_is_left_out_by_name(tmp_path):
    """A second FRF of node 3, across, makes a coherence of node 3 without direction one of two; node 9 has no FRF at all."""
    across = set_58(FREQUENCY, FRF.value[0, 0], (3, 2), (1, 3)) + set_58(FREQUENCY, FRF.coherence[0, 0], (9, 0), (1, 0), 6, (18, 0, 0), ("Hz", "NONE", "NONE"))
    head = HEAD + '[[points]]\nnode = 4\nname = "across"\nbody = "hub"\nposition_mm = [12.5, 0.0, 15.0]\ndirection = "+Y"\ncalled = ["3:+Y"]\n'
    (tmp_path / "m.toml").write_text(SPINDLE + head)
    notes = bring([written(tmp_path, with_coherence(NOWHERE, extra=across))], mapping=tmp_path / "m.toml", out=tmp_path / "c").values["notes"]
    assert "T20.uff: coherence of 3 over 1 (set 11) left out: 2 FRFs of its test are between these points" in notes
    assert "T20.uff: coherence of 9 over 1 (set 8) left out: its test has no FRF between these points" in notes


@pytest.mark.parametrize(
    ("text", "quantity", "factor"),
    [("in/s^2/lbf", "accelerance", 0.0254 / 4.4482216152605), ("(in/s2)/N", "accelerance", 0.0254), ("m/s/s/N", "accelerance", 1.0), ("(m/s/s)/N", "accelerance", 1.0)]
    + [(f"{g}/N", "accelerance", 9.80665) for g in ("g", "G", "gn")]
    + [(f"{mil}/lbf", "receptance", 25.4e-6 / 4.4482216152605) for mil in ("mil", "(mils)", "thou")]
    + [("ips/lbf", "mobility", 0.0254 / 4.4482216152605), ("(mil/s)/N", "mobility", 25.4e-6)],
)
def test_ways_of_writing_a_unit(text, quantity, factor):
    assert units.of_frf(text) == (quantity, pytest.approx(factor))
    assert (units.length_factor(text) is None) == ("g" in text.lower())


def test_quantities_that_contradict_each_other_are_told_with_their_articles(tmp_path):
    with pytest.raises(Unanswered, match="its label 'Acceleration' is that of an accelerance, its unit '\\(m/s\\)/N' that of a mobility"):
        imported(tmp_path, "", written(tmp_path, frfs(word="Acceleration")))
