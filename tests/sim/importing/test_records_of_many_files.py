"""Hits of one hammer point in files of their own: each is scaled by what its own file says."""

import numpy as np
import pytest

from tests.sim.importing.recorded import MAPPING, RATE, exact, hit
from thermospindle.model.errors import Unanswered
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import read_campaign

POUND = 4.4482216152605  # N


def recorded(folder, force_units, response_units):
    """A file a hit on point 1, the response in the unit told."""
    random, per = np.random.default_rng(5), {"m/s": 1.0, "mm/s": 1e-3, "lbf": POUND, "N": 1.0, "m/s^2": 1.0, "furlong": 1.0}
    for k, (force_unit, unit) in enumerate(zip(force_units, response_units, strict=True)):
        force, answer = hit(random)
        head = f"Time [s],force 1 [{force_unit}],velocity 1 [{unit}]"
        rows = np.c_[np.arange(len(force)) / RATE, force / per[force_unit], answer[0, 0] / per[unit]]
        np.savetxt(folder / f"hammer{k}.csv", rows, delimiter=",", header=head, comments="", fmt="%.12g")
    (folder / "m.toml").write_text(MAPPING)
    return sorted(folder.glob("hammer*.csv"))


@pytest.mark.parametrize(
    ("forces", "responses"),
    [(["N"] * 4, ["mm/s"] * 4), (["N", "lbf", "N", "N"], ["mm/s"] * 4), (["N"] * 4, ["m/s", "mm/s", "mm/s", "m/s"])],
)
def test_every_file_has_its_own_units(forces, responses, tmp_path):
    files = recorded(tmp_path, forces, responses)
    bring(files, mapping=tmp_path / "m.toml", out=tmp_path / "c")
    found = read_campaign(tmp_path / "c").tests[0].frf
    peak = np.argmax(np.abs(found.value[0, 0]))
    decay = read_campaign(tmp_path / "c").tests[0].window_decay
    wanted = exact(found.frequency, decay)[0, 0]
    assert found.value[0, 0, peak] == pytest.approx(wanted[peak], rel=5e-3)


def test_velocities_and_accelerations_are_no_one_response(tmp_path):
    files = recorded(tmp_path, ["N"] * 3, ["mm/s", "m/s^2", "mm/s"])
    with pytest.raises(Unanswered, match="responses of one quantity in all files of a hammer point; some are accelerance, mobility"):
        bring(files, mapping=tmp_path / "m.toml", out=tmp_path / "c")


def test_a_unit_that_nobody_knows_is_asked_for_as_that(tmp_path):
    files = recorded(tmp_path, ["N"] * 2, ["m/s^2", "furlong"])
    with pytest.raises(Unanswered, match="the unit of its response") as told:
        bring(files, mapping=tmp_path / "m.toml", out=tmp_path / "c")
    assert "one quantity" not in str(told.value)
