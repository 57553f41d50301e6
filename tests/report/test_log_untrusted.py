"""Logs of others: what one says of itself is checked before a file is called by it, or an array shaped."""

import numpy as np
import pytest
import rerun.blueprint as rrb

from thermospindle.model.errors import BadInput
from thermospindle.report.log.columns import log_frf_numbers, log_peak_numbers, whole_log
from thermospindle.report.log.read import read_log
from thermospindle.report.log.told import describe, log_json
from thermospindle.report.verbs.inspect import inspect
from thermospindle.sim.identification.frf import Frf


def logged(path, test, responses=(1,)):
    """A log of one FRF, whose `test` is described to have these responses."""
    frf = Frf(np.array([1.0, 2.0]), np.ones((1, 1, 2), complex), responses, (1,), "mobility")
    with whole_log(path, "run", "a log", {"title": "a title", "scene": "a scene"}, rrb.Blueprint()) as recording:
        log_frf_numbers(recording, test, 0, 20.0, 0.0, frf)
        log_peak_numbers(recording, [])
    return path


def test_frfs_are_written_by_test(tmp_path):
    inspect(logged(tmp_path / "a.rrd", "T20_n0"), tmp_path / "out")
    assert (tmp_path / "out" / "T20_n0.csv").is_file()


@pytest.mark.parametrize("test", ["../../escaped", "/tmp/escaped", "a/b", ".hidden", ""])
def test_a_test_whose_name_is_a_path_is_refused(test, tmp_path):
    with pytest.raises(BadInput, match=r"a.rrd: the test .*: must be letters, digits"):
        inspect(logged(tmp_path / "a.rrd", test), tmp_path / "deep" / "er" / "out")
    assert [p.name for p in tmp_path.rglob("*") if not p.is_dir()] == ["a.rrd"]


@pytest.mark.parametrize("told", [describe, log_json])
def test_numbers_that_contradict_their_description_are_refused(told, tmp_path):
    log = read_log(logged(tmp_path / "a.rrd", "T20_n0", responses=(1, 2)))
    with pytest.raises(BadInput, match=r"a.rrd: is not a whole log of thermospindle: what it holds is not what it says of itself"):
        told(log)


def test_units_are_of_what_is_in_the_log(tmp_path):
    log = read_log(logged(tmp_path / "a.rrd", "T20_n0"))
    assert log.units["/numbers/peaks:frequency"] == "Hz"
    peaks = {of.partition(":")[2] for of in log.units if of.startswith("/numbers/peaks")}
    assert peaks <= set(log.table("/numbers/peaks"))
