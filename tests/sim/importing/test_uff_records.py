"""Raw hammer records in UFF files: which force each response answers, their axes and units."""

from __future__ import annotations

import numpy as np
import pytest

from tests.sim.importing.exported import set_58, set_164
from tests.sim.importing.recorded import LENGTH, MAPPING, RATE, exact, hit
from thermospindle.model.errors import BadInput, Unanswered
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import read_campaign


def records(random, point: int, reference: tuple[int, int], hits: int = 2, unit: str = "s", responses=(1, 2)) -> str:
    """UFF sets of `hits` hits on a point (1, 2), a force and its responses after each other, which name `reference` (node, direction)."""
    text = ""
    time = np.arange(round(RATE * LENGTH)) / RATE * {"s": 1, "ms": 1e3}.get(unit, 1)
    for _ in range(hits):
        force, answer = hit(random)
        text += set_58(time, force, (point, 3), (point, 3), 1, (17, 13, 0), (unit, "N", "NONE"))
        for r in responses:
            text += set_58(time, 1e3 * answer[r - 1, point - 1], (r, 3), reference, 1, (17, 11, 0), (unit, "mm/s", "NONE"))
    return text


def of_uff(folder, text, told=""):
    (folder / "hammer.uff").write_text(text)
    (folder / "m.toml").write_text(MAPPING.replace('test = "T20"', f'test = "T20"\n{told}', 1) + "[records]\nband_Hz = [50.0, 1000.0]\n")
    bring([folder / "hammer.uff"], mapping=folder / "m.toml", out=folder / "c")
    return read_campaign(folder / "c").tests[0]


@pytest.mark.parametrize("direction", [3, -3, 0], ids=["same", "opposite", "none"])
def test_records_of_two_hammer_points_in_one_file(tmp_path, direction):
    """Each response names the point that was hit; it was asked which of the two forces the hammer's was, and nothing answered that."""
    random = np.random.default_rng(4)
    test = of_uff(tmp_path, records(random, 1, (1, direction)) + records(random, 2, (2, direction)))
    model = exact(test.frf.frequency, test.window_decay)
    assert (test.frf.response_nodes, test.frf.reference_nodes) == ((1, 2), (1, 2))
    assert np.abs(test.frf.value - model).max() < 1e-3 * np.abs(model).max()


def test_a_response_to_no_force_of_its_file_is_asked_about_and_can_be_left_out(tmp_path):
    random = np.random.default_rng(4)
    text = records(random, 1, (1, 3), 1) + records(random, 2, (2, 3), 1) + "    -1\n" + records(random, 2, (7, 3), 1, responses=(1,)).split("    -1\n    -1\n", 1)[1]
    said = r'leave_out: the force that set 7 answers: its reference is 7:\+Z, and there are set 1 at 1:\+Z, set 4 at 2:\+Z; leave_out = \["set 7"\] does without it'
    with pytest.raises(Unanswered, match=said):
        of_uff(tmp_path, text)
    assert of_uff(tmp_path, text, 'leave_out = ["set 7"]').frf.reference_nodes == (1, 2)


def test_responses_that_name_no_reference_are_asked_about_and_forces_can_be_left_out(tmp_path):
    random = np.random.default_rng(4)
    text = records(random, 1, (0, 0), 1) + records(random, 2, (0, 0), 1, responses=())
    with pytest.raises(Unanswered, match=r'leave_out: which force set 2 answers, for it names no reference: there are set 1 at 1:\+Z, set 4 at 2:\+Z; leave_out = \["set 4"\]'):
        of_uff(tmp_path, text)
    with pytest.raises(Unanswered, match=r"leave_out: the responses to the force set 4: none has its point as reference"):
        of_uff(tmp_path, records(random, 1, (1, 3), 1) + records(random, 2, (0, 0), 1, responses=()))
    assert of_uff(tmp_path, text, 'leave_out = ["set 4"]').frf.reference_nodes == (1,)


def test_records_that_are_not_as_many_or_as_long_are_one_sentence(tmp_path):
    """They ended in a traceback, and of two records of different length the first was dropped."""
    random = np.random.default_rng(4)
    one = records(random, 1, (1, 3), 1)
    with pytest.raises(BadInput, match=r"hammer.uff: set 2: has 1 hit of 8192 samples, its force set 1 2 of 8192; they must be the same"):
        of_uff(tmp_path, one + records(random, 1, (1, 3), 1, responses=()))
    short = set_58(np.arange(4096) / RATE, np.zeros(4096), (1, 3), (1, 3), 1, (17, 13, 0), ("s", "N", "NONE"))
    with pytest.raises(BadInput, match=r'hammer.uff: set 4: has 4096 samples every 0.00012207 s in N, set 1 of the same channel 8192 .*leave_out = \["set 4"\]'):
        of_uff(tmp_path, one + short)


def test_time_in_milliseconds_and_in_what_is_not_known(tmp_path):
    random = np.random.default_rng(4)
    test = of_uff(tmp_path, records(random, 1, (1, 3), unit="ms"))
    model = exact(test.frf.frequency, test.window_decay)[:, :1]
    assert np.abs(test.frf.value - model).max() < 1e-3 * np.abs(model).max()
    (tmp_path / "own").mkdir()
    text = records(random, 1, (1, 3), unit="ticks")
    with pytest.raises(BadInput, match=r"hammer.uff: set 1: abscissa of type 17 in 'ticks'; allowed is time \(17\) in s, ms, us; sample_rate_Hz in its \[\[files\]\] tells its step"):
        of_uff(tmp_path / "own", text)
    assert of_uff(tmp_path / "own", text, f"sample_rate_Hz = {RATE}").frf.reference_nodes == (1,)


def test_what_a_record_is_can_be_told(tmp_path):
    """Of a unit that is none, and of force and response in each other's place, it was asked for
    `columns`, which a UFF file had none of. One set tells for all hits of its channel."""
    random = np.random.default_rng(4)
    text = records(random, 1, (1, 3)).replace("mm/s", "V   ")
    with pytest.raises(Unanswered, match=r"columns: the unit of its response 'set 2', as in \"response 3 \[m/s\^2\]\"; found is 'V'"):
        of_uff(tmp_path, text)
    test = of_uff(tmp_path, text, 'columns = { "set 2" = "response 1 [mm/s]", "set 3" = "response [mm/s]" }')
    model = exact(test.frf.frequency, test.window_decay)[:, :1]
    assert test.frf.response_nodes == (1, 2)
    assert np.abs(test.frf.value - model).max() < 1e-3 * np.abs(model).max()
    (tmp_path / "alone").mkdir()
    alone = of_uff(tmp_path / "alone", text, 'columns = { "set 2" = "ignore", "set 3" = "response 2:-Z [mm/s]" }')
    assert np.abs(alone.frf.value + model[1:]).max() < 1e-3 * np.abs(model).max()
    (tmp_path / "wrong").mkdir()
    with pytest.raises(BadInput, match=r'set 2: columns = { "set 2" = \'H\(1,1\) real\' }; allowed for a record are force, response 3, ignore'):
        of_uff(tmp_path / "wrong", text, 'columns = { "set 2" = "H(1,1) real" }')
    with pytest.raises(BadInput, match=r"columns: 'set 9' is no column of hammer\*; there are set 1, set 2, set 3, set 4, set 5, set 6"):
        of_uff(tmp_path / "wrong", text, 'columns = { "set 9" = "ignore" }')


def test_records_without_labels_are_in_the_units_of_set_164(tmp_path):
    random = np.random.default_rng(4)
    text = set_164(1e3, 1.0) + records(random, 1, (1, 3)).replace("mm/s", "NONE").replace(f"NONE                 {'N':20}", f"NONE                 {'NONE':20}")
    test = of_uff(tmp_path, text)
    model = exact(test.frf.frequency, test.window_decay)[:, :1]
    assert np.abs(test.frf.value - model).max() < 1e-3 * np.abs(model).max()
