"""Raw hammer records: their channels, directions, signs and bands, and FRFs as the exact answer of the model that made them."""

from __future__ import annotations

from io import StringIO

import numpy as np
import pytest
from rich.console import Console

from tests.conftest import SCENE
from tests.sim.importing.recorded import MAPPING, RATE, exact, hit
from thermospindle.model.errors import BadInput, Unanswered
from thermospindle.report.verbs.importing import bring
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.importing.records.windows import end_needed


def test_force_and_response_exchanged_are_said_to_be(hammered, tmp_path):
    """What rings on was told to be the force: each hit seemed to be a double one. With the columns told it is read as ever."""
    text = (hammered / "hammer2.csv").read_text()
    (tmp_path / "hammer2.csv").write_text(text.replace("force 2 [N],velocity 1 [mm/s]", "velocity 1 [mm/s],force 2 [N]", 1))
    (tmp_path / "m.toml").write_text(MAPPING)
    said = r"hammer2.csv: columns: whether force and response are exchanged: its force 'force 2 \[N\]' rings on, and its response 'velocity 1 \[mm/s\]' is a pulse"
    with pytest.raises(Unanswered, match=said) as error:
        bring([tmp_path / "hammer2.csv"], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    assert "double" not in str(error.value)
    told = 'test = "T20"\ncolumns = { "force 2 [N]" = "velocity 1 [mm/s]", "velocity 1 [mm/s]" = "force 2 [N]" }'
    (tmp_path / "m.toml").write_text(MAPPING.replace('test = "T20"', told, 1))
    bring([tmp_path / "hammer2.csv"], mapping=tmp_path / "m.toml", out=tmp_path / "c")


def test_a_dead_channel_is_one_sentence_and_can_be_left_out(hammered, tmp_path, recwarn):
    rows = np.loadtxt(hammered / "hammer1.csv", delimiter=",", skiprows=1)
    rows[:, 3] = 0.0
    head = "Time [s],force 1 [N],velocity 1 [mm/s],velocity 2 [mm/s]"
    np.savetxt(tmp_path / "hammer1.csv", rows, delimiter=",", header=head, comments="", fmt="%.9g")
    (tmp_path / "m.toml").write_text(MAPPING)
    with pytest.raises(BadInput, match="response 2: zero on every line; a dead channel is not allowed; leave_out = "):
        bring([tmp_path / "hammer1.csv"], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    assert not [w for w in recwarn if issubclass(w.category, RuntimeWarning)]

    (tmp_path / "m.toml").write_text(MAPPING.replace('test = "T20"', 'test = "T20"\nleave_out = ["H(2,1)"]'))
    bring([tmp_path / "hammer1.csv"], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    assert read_campaign(tmp_path / "c").tests[0].frf.response_nodes == (1,)

    (tmp_path / "m.toml").write_text(MAPPING.replace('test = "T20"', 'test = "T20"\nleave_out = ["H(2,9)"]'))
    with pytest.raises(BadInput, match=r"m.toml: files: leave_out: 'H\(2,9\)' is no FRF of the files; there are H\(1,1\)"):
        bring([tmp_path / "hammer1.csv"], mapping=tmp_path / "m.toml", out=tmp_path / "d")


@pytest.mark.parametrize(
    ("heading", "told", "turned"),
    [("velocity 2 [mm/s]", "", 1), ("velocity 2:-Z [mm/s]", "", -1), ("velocity 2 [mm/s]", 'columns = { "velocity 2 [mm/s]" = "velocity 2:-Z [mm/s]" }', -1)],
)
def test_a_sensor_that_looks_the_other_way_is_turned(hammered, tmp_path, heading, told, turned):
    """The direction of a column of a time record counts, as that of an FRF does."""
    text = (hammered / "hammer1.csv").read_text()
    (tmp_path / "hammer1.csv").write_text(text.replace("velocity 2 [mm/s]", heading, 1))
    (tmp_path / "m.toml").write_text(MAPPING.replace('test = "T20"', f'test = "T20"\n{told}', 1))
    bring([tmp_path / "hammer1.csv"], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    (tmp_path / "plain.toml").write_text(MAPPING)
    bring([hammered / "hammer1.csv"], mapping=tmp_path / "plain.toml", out=tmp_path / "d")
    frf, plain = (read_campaign(tmp_path / name).tests[0].frf for name in "cd")
    np.testing.assert_allclose(frf.value[1], turned * plain.value[1])
    np.testing.assert_allclose(frf.value[0], plain.value[0])


def test_a_reference_of_the_mapping_turns_the_one_of_the_heading_and_is_no_other(hammered, tmp_path):
    """A force sensor that reads pressure as negative; and a point that no heading tells is refused,
    where it was not used before, without a word."""
    rows = np.loadtxt(hammered / "hammer1.csv", delimiter=",", skiprows=1)
    rows[:, 1] *= -1
    np.savetxt(tmp_path / "hammer1.csv", rows, delimiter=",", header="Time [s],force 1 [N],velocity 1 [mm/s],velocity 2 [mm/s]", comments="", fmt="%.9g")
    (tmp_path / "m.toml").write_text(MAPPING)
    with pytest.raises(BadInput, match="negative real part"):
        bring([tmp_path / "hammer1.csv"], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    (tmp_path / "m.toml").write_text(MAPPING.replace('test = "T20"', 'test = "T20"\nreference = "1:-Z"', 1))
    answer = bring([tmp_path / "hammer1.csv"], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    assert "a blow against the direction of 1:-Z" in "\n".join(answer.values["notes"])
    (tmp_path / "m.toml").write_text(MAPPING.replace('test = "T20"', 'test = "T20"\nreference = "nose"', 1))
    with pytest.raises(BadInput, match=r"m.toml: files: reference = 'nose': the headings of hammer\* say 1; allowed is what a heading leaves open, or the way that it looks, as in \"1:-Z\""):
        bring([tmp_path / "hammer1.csv"], mapping=tmp_path / "m.toml", out=tmp_path / "d")


def test_time_records_of_a_uff_file(tmp_path):
    """Dataset 58, function type 1: force and responses of three hits one after the other, a file for each kind of channel."""
    import pyuff

    random = np.random.default_rng(7)
    base = {"type": 58, "binary": 0, "func_type": 1, "abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s", "ref_node": 1, "ref_dir": 3, "orddenom_spec_data_type": 0}
    for _ in range(3):
        force, answer = hit(random)
        time = np.arange(len(force)) / RATE
        channels = [("force.uff", 1, 13, "N", force), ("motion.uff", 1, 11, "m/s", answer[0, 0]), ("motion.uff", 2, 11, "m/s", answer[1, 0])]
        for name, node, kind, unit, value in channels:
            told = {"rsp_node": node, "rsp_dir": 3, "ordinate_spec_data_type": kind, "ordinate_axis_units_lab": unit, "x": time, "data": value}
            pyuff.UFF(str(tmp_path / name)).write_sets(base | told | {"abscissa_inc": 1 / RATE}, mode="add")
    mapping = MAPPING.replace('file = "hammer*"', 'file = "*.uff"') + "[records]\nband_Hz = [50.0, 1000.0]\n"
    (tmp_path / "m.toml").write_text(mapping)
    answer = bring([tmp_path / "force.uff", tmp_path / "motion.uff"], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    assert "3 of 3 hits" in "\n".join(answer.values["notes"])
    test = read_campaign(tmp_path / "c").tests[0]
    model = exact(test.frf.frequency, test.window_decay)[:, :1]
    assert np.abs(test.frf.value - model).max() < 2e-3 * np.abs(model).max()


@pytest.mark.parametrize(("of_force", "of_answer", "struck"), [(-1, -1, "1"), (1, -1, "1"), (-1, 1, "1"), (-1, 1, "1:-Z")])
def test_signs_are_kept(tmp_path, of_force, of_answer, struck):
    """A blow in the other direction, recorded so, is the same FRF; one sign of the two alone is another,
    unless the reference says so, and a negative force is told. It was turned, silently, and its answer not."""
    random = np.random.default_rng(5)
    force, answer = zip(*(hit(random) for _ in range(4)), strict=True)
    np.savez(tmp_path / "hammer1.npz", fs=RATE, force=of_force * np.array(force), velocity2=of_answer * np.array(answer)[:, 1, 0])
    told = MAPPING.replace('test = "T20"', f'test = "T20"\nreference = "{struck}"\ncolumns = {{ force = "force [N]", velocity2 = "velocity 2 [m/s]" }}', 1)
    (tmp_path / "m.toml").write_text(told + "[records]\nband_Hz = [50.0, 1000.0]\n")
    notes = bring([tmp_path / "hammer1.npz"], mapping=tmp_path / "m.toml", out=tmp_path / "c").values["notes"]
    assert any("4 of 4 hits is recorded negative" in n for n in notes) == (of_force < 0)
    test = read_campaign(tmp_path / "c").tests[0]
    model = exact(test.frf.frequency, test.window_decay)[1:, :1]
    assert np.abs(test.frf.value - (-1) ** ("-Z" in struck) * of_force * of_answer * model).max() < 1e-3 * np.abs(model).max()


@pytest.mark.parametrize(("told", "kept"), [("", (400.0, 6000.0)), ("[records]\nband_Hz = [100.0, 1000.0]\n", (100.0, 1000.0))], ids=["the scene's", "told"])
def test_records_are_kept_in_the_band_that_the_scene_is_measured_in(tmp_path, told, kept):
    """Where the mapping tells none, and said in one sentence; what lies beyond is poles that cost time and tell nothing of the scene."""
    random = np.random.default_rng(5)
    force, answer = zip(*(hit(random) for _ in range(4)), strict=True)
    np.savez(tmp_path / "hammer1.npz", fs=RATE, force=np.array(force), velocity1=np.array(answer)[:, 0, 0], velocity2=np.array(answer)[:, 1, 0])
    form = MAPPING.split("[[points]]", maxsplit=1)[0].replace('"rig"', '"hdd_2003"').replace(
        'test = "T20"', 'test = "T20"\nreference = 1\ncolumns = { force = "force [N]", velocity1 = "velocity 1 [m/s]", velocity2 = "velocity 2 [m/s]" }', 1
    )
    (tmp_path / "m.toml").write_text(form + told)
    answer = bring([tmp_path / "hammer1.npz"], mapping=tmp_path / "m.toml", scene=SCENE, out=tmp_path / "c")
    frequency = read_campaign(tmp_path / "c").tests[0].frf.frequency
    assert kept[0] <= frequency[0] < kept[0] + 2.0
    assert frequency[-1] <= kept[1]
    said = [n for n in answer.values["notes"] if "band_Hz under [records]" in n]
    assert said == ([] if told else ["time records: kept from 400 to 6000 Hz, where the hammer test of hdd_2003 is; band_Hz under [records] keeps another band"])


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_a_sample_that_is_no_number_is_named(tmp_path, wrong):
    """By file, channel, hit and sample; it was told as a fault of the coherence of FRFs."""
    force, answer = hit(np.random.default_rng(5))
    forces, answers = np.array([force] * 3), np.array([answer[:, 0]] * 3)
    answers[1, 1, 99:101] = wrong
    np.savez(tmp_path / "hammer1.npz", fs=RATE, force=forces, velocity1=answers[:, 0], velocity2=answers[:, 1])
    told = MAPPING.replace('test = "T20"', 'test = "T20"\nreference = 1\ncolumns = { force = "force [N]", velocity1 = "velocity 1 [m/s]", velocity2 = "velocity 2 [m/s]" }', 1)
    (tmp_path / "m.toml").write_text(told)
    with pytest.raises(BadInput, match=rf"hammer1\.npz: velocity2: sample 100 of row 2 is {wrong:g}, which is no number, and 1 more of it are none either"):
        bring([tmp_path / "hammer1.npz"], mapping=tmp_path / "m.toml", out=tmp_path / "c")


def test_what_records_leave_open_is_asked_at_once(tmp_path):
    """Units, sampling rate, points that were hit: one list, and once its form is filled in nothing more is asked."""
    random = np.random.default_rng(5)
    for q in (0, 1):
        force, answer = zip(*(hit(random) for _ in range(3)), strict=True)
        np.savez(tmp_path / f"T20_hammer{q + 1}.npz", force=np.array(force), velocity1=np.array(answer)[:, 0, q], velocity2=np.array(answer)[:, 1, q])
    files = [tmp_path / f"T20_hammer{q}.npz" for q in (1, 2)]
    (tmp_path / "points.toml").write_text(MAPPING.split('id = "T20"')[0].split("[[files]]")[0] + "[[points]]" + MAPPING.split("[[points]]", 1)[1])
    with pytest.raises(Unanswered) as caught:
        bring(files, mapping=tmp_path / "points.toml", out=tmp_path / "c")
    both = "T20_hammer1.npz, T20_hammer2.npz: "
    for word in ("sample_rate_Hz", "reference: the point that was hit", *(f"columns: the unit of its {name}" for name in ("force 'force'", "response 'velocity1'", "response 'velocity2'"))):
        assert sum(item.startswith(both + word) for item in caught.value.items) == 1, word
    form = MAPPING.replace('"hammer*"', '"*.npz"').replace(
        'test = "T20"', f'test = "T20"\nsample_rate_Hz = {RATE}\ncolumns = {{ force = "force [N]", velocity1 = "velocity 1 [m/s]", velocity2 = "velocity 2 [m/s]" }}', 1
    ).replace("[[tests]]", '[[files]]\nfile = "*1.npz"\nreference = 1\n[[files]]\nfile = "*2.npz"\nreference = 2\n[[tests]]')
    (tmp_path / "m.toml").write_text(form)
    bring(files, mapping=tmp_path / "m.toml", out=tmp_path / "c")
    assert read_campaign(tmp_path / "c").tests[0].frf.reference_nodes == (1, 2)


def test_offset_and_drift_of_accelerometers_are_taken_out_and_said(tmp_path):
    """A charge amplifier that wanders by a third of the largest value of both channels, 71 % of its
    own over the record, not about zero; without that the FRFs are 4 % off."""
    random = np.random.default_rng(5)
    force, answer = zip(*(hit(random, power=1) for _ in range(4)), strict=True)
    motion = np.array(answer)[:, :, 0]
    wander = np.abs(motion).max() * (0.1 + 0.3 * np.linspace(0, 1, motion.shape[-1]))
    motion[:, 1] += wander
    np.savez(tmp_path / "hammer1.npz", fs=RATE, force=np.array(force), acceleration1=motion[:, 0], acceleration2=motion[:, 1])
    told = MAPPING.replace('test = "T20"', 'test = "T20"\nreference = 1\ncolumns = { force = "force [N]", acceleration1 = "acceleration 1 [m/s^2]", acceleration2 = "acceleration 2 [m/s^2]" }', 1)
    (tmp_path / "m.toml").write_text(told + "[records]\nband_Hz = [50.0, 1000.0]\n")
    notes = bring([tmp_path / "hammer1.npz"], mapping=tmp_path / "m.toml", out=tmp_path / "c").values["notes"]
    assert [n for n in notes if "drift" in n] == ["hammer1.npz: offset and drift taken out, in shares of the largest value: acceleration2 71%"]
    test = read_campaign(tmp_path / "c").tests[0]
    s = 2j * np.pi * test.frf.frequency + test.window_decay
    model = exact(test.frf.frequency, test.window_decay)[:, :1] * s
    assert test.frf.quantity == "accelerance"
    assert np.abs(test.frf.value - model).max() < 2e-3 * np.abs(model).max()


def test_slow_lines_on_which_nothing_is_heard_are_left_out_and_said(tmp_path):
    """An accelerometer's noise, a three hundredth of its largest value, and drift: below some 30 Hz the answer is less than that."""
    random = np.random.default_rng(5)
    force, answer = zip(*(hit(random, power=1) for _ in range(4)), strict=True)
    motion = np.array(answer)[:, :, 0]
    motion += np.abs(motion).max() * (3e-3 * random.standard_normal(motion.shape) + 0.1 * np.linspace(0, 1, motion.shape[-1]) * random.standard_normal((4, 2, 1)))
    np.savez(tmp_path / "hammer1.npz", fs=RATE, force=np.array(force), acceleration1=motion[:, 0], acceleration2=motion[:, 1])
    told = MAPPING.replace('test = "T20"', 'test = "T20"\nreference = 1\ncolumns = { force = "force [N]", acceleration1 = "acceleration 1 [m/s^2]", acceleration2 = "acceleration 2 [m/s^2]" }', 1)
    (tmp_path / "m.toml").write_text(told)
    notes = bring([tmp_path / "hammer1.npz"], mapping=tmp_path / "m.toml", out=tmp_path / "c").values["notes"]
    assert any(n.endswith("below, nothing is coherent with the force") for n in notes)
    frf = read_campaign(tmp_path / "c").tests[0].frf
    size = np.abs(exact(frf.frequency[:1]) * 2 * np.pi * frf.frequency[0])[:, 0, 0].max()
    assert 1.0 < size / frf.sd[:, 0, :10].mean() < 10.0  # as large as its noise where the band begins
    (tmp_path / "m.toml").write_text(told + "[records]\nband_Hz = [10.0, 1000.0]\n")
    bring([tmp_path / "hammer1.npz"], mapping=tmp_path / "m.toml", out=tmp_path / "d")
    assert read_campaign(tmp_path / "d").tests[0].frf.frequency[0] < 12.0 < frf.frequency[0]


@pytest.mark.parametrize("order", ["hits, responses", "responses, hits"])
def test_all_channels_in_one_array(tmp_path, order):
    """As many hits as the force has, whichever axis they are; another number of them is said."""
    random = np.random.default_rng(5)
    force, answer = zip(*(hit(random) for _ in range(4)), strict=True)
    motion = np.array(answer)[:, :, 0]
    motion = motion if order == "hits, responses" else motion.swapaxes(0, 1)
    np.savez(tmp_path / "hammer1.npz", fs=RATE, force=np.array(force), velocity=motion, resp_nodes=np.array([1, 2]))
    told = MAPPING.replace('test = "T20"', 'test = "T20"\nreference = 1\ncolumns = { force = "force [N]", velocity = "velocity [m/s]" }', 1)
    (tmp_path / "m.toml").write_text(told + "[records]\nband_Hz = [50.0, 1000.0]\n")
    bring([tmp_path / "hammer1.npz"], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    test = read_campaign(tmp_path / "c").tests[0]
    model = exact(test.frf.frequency, test.window_decay)[:, :1]
    assert np.abs(test.frf.value - model).max() < 1e-3 * np.abs(model).max()
    np.savez(tmp_path / "hammer1.npz", fs=RATE, force=np.array(force)[:3], velocity=motion, resp_nodes=np.array([1, 2]))
    with pytest.raises(BadInput, match="its force force 3 of"):
        bring([tmp_path / "hammer1.npz"], mapping=tmp_path / "m.toml", out=tmp_path / "d")


def test_where_one_point_needs_a_window_all_of_a_test_have_it(tmp_path):
    """Records of a third of a second of a slow mode, which still ring, and of a point that moves with a fast one
    alone, which do not: the window's damping is in the FRFs of both. They were made without it, and told to have it."""
    random, n = np.random.default_rng(8), round(0.35 * RATE)
    force, answer = zip(*(hit(random) for _ in range(4)), strict=True)
    slow, fast = np.array(answer)[:, :, 0, :n], (np.array(answer)[:, :, 1] - 0.7 * np.array(answer)[:, :, 0])[..., :n]
    for q, moved in ((1, slow), (2, fast)):
        np.savez(tmp_path / f"hammer{q}.npz", fs=RATE, force=np.array(force)[:, :n], velocity1=moved[:, 0])
    columns = 'columns = { force = "force [N]", velocity1 = "velocity 1 [m/s]" }'
    of_each = "".join(f'[[files]]\nfile = "hammer{q}.npz"\ntest = "T20"\nreference = {q}\n{columns}\n' for q in (1, 2))
    (tmp_path / "m.toml").write_text(MAPPING.replace('[[files]]\nfile = "hammer*"\ntest = "T20"\n', of_each) + "[records]\nband_Hz = [50.0, 1000.0]\n")
    answer = bring([tmp_path / "hammer1.npz", tmp_path / "hammer2.npz"], mapping=tmp_path / "m.toml", out=tmp_path / "c")
    assert sum("exponential window down to 0.01" in note for note in answer.values["notes"]) == 2
    answer.show(console := Console(file=StringIO(), width=300))
    assert console.file.getvalue().count("exponential window down to 0.01") == 1  # one sentence of both
    assert "  hammer1.npz, hammer2.npz: 4 of 4 hits" in console.file.getvalue()
    test = read_campaign(tmp_path / "c").tests[0]
    assert test.window_decay == pytest.approx(-np.log(0.01) / 0.302, rel=1e-2)  # what of a record follows its hit
    model, unwindowed = (exact(test.frf.frequency, decay)[0] for decay in (test.window_decay, 0.0))
    of_fast, plain = (of[1] - 0.7 * of[0] for of in (model, unwindowed))
    assert np.abs(test.frf.value[0, 0] - model[0]).max() < 0.01 * np.abs(model[0]).max()
    assert np.abs(test.frf.value[0, 1] - of_fast).max() < 0.01 * np.abs(of_fast).max()
    assert np.abs(test.frf.value[0, 1] - plain).max() > 0.2 * np.abs(of_fast).max()


@pytest.mark.parametrize(("shift", "asked"), [(1, False), (25, False), (2500, True)])
def test_hits_that_begin_a_little_later_at_one_point_have_the_lines_of_the_others(tmp_path, shift, asked):
    """A file a hammer point, of records equally long, in one of which the trigger came later: it was refused for
    lines that were another, and told to be a test of its own. Where hits would lose much of their length it is asked."""
    random = np.random.default_rng(9)
    force, answer = zip(*(hit(random) for _ in range(4)), strict=True)
    for q in (1, 2):
        later = shift * (q - 1)
        of_force, moved = np.array(force), np.array(answer)[:, :, q - 1]
        records = [np.pad(v[..., : v.shape[-1] - later], [(0, 0)] * (v.ndim - 1) + [(later, 0)]) for v in (of_force, moved[:, 0])]
        np.savez(tmp_path / f"hammer{q}.npz", fs=RATE, force=records[0], velocity1=records[1])
    columns = 'columns = { force = "force [N]", velocity1 = "velocity 1 [m/s]" }'
    of_each = "".join(f'[[files]]\nfile = "hammer{q}.npz"\ntest = "T20"\nreference = {q}\n{columns}\n' for q in (1, 2))
    (tmp_path / "m.toml").write_text(MAPPING.replace('[[files]]\nfile = "hammer*"\ntest = "T20"\n', of_each) + "[records]\nband_Hz = [50.0, 1000.0]\n")
    files = [tmp_path / "hammer1.npz", tmp_path / "hammer2.npz"]
    if asked:
        with pytest.raises(Unanswered, match="T20: hit_length_s: one length for all hits, so that one window, and the same lines, fit all its FRFs; at most "):
            bring(files, mapping=tmp_path / "m.toml", out=tmp_path / "c")
        return
    bring(files, mapping=tmp_path / "m.toml", out=tmp_path / "c")
    test = read_campaign(tmp_path / "c").tests[0]
    model = exact(test.frf.frequency, test.window_decay)[0]
    for q in range(2):
        assert np.abs(test.frf.value[0, q] - model[q]).max() < 0.01 * np.abs(model[q]).max()


def test_a_window_is_for_what_rings_and_not_for_noise():
    """A response that has died away to the noise of its sensor, 0.05 % of its peak, needs none; one that still rings
    does, as loud as that noise or three times softer, and so does a dead one with a short tail of which nobody can tell."""
    random, n = np.random.default_rng(6), 16384
    t = np.arange(n) / 8192
    noise = 5e-4 * random.standard_normal((1, 4, 3, n))
    died = np.exp(-10 * t) * np.sin(2 * np.pi * 900 * t)
    assert end_needed(died + noise) == 1.0
    assert end_needed(died + 0 * noise) == 1.0
    for left in (5e-3, 1e-3, 2e-4):
        assert end_needed(np.exp(np.log(left) / t[-1] * t) * np.sin(2 * np.pi * 900 * t) + noise) == 0.01
    assert end_needed((died + noise)[..., :400]) == 0.01


@pytest.mark.parametrize("tone", [0.0, 2e-3, 0.05])
def test_a_window_is_not_for_tones_that_stay(tone):
    """Unbalance of a running spindle is as loud at the end of a record as in its middle: it had
    windows put on what had died away. One is put on where a mode still rings beside it."""
    random, n = np.random.default_rng(6), 16384
    t = np.arange(n) / 8192
    phases = 2 * np.pi * random.random((1, 4, 1, 1))
    turning = tone * sum(np.sin(2 * np.pi * k * 83.3 * t + k * phases) for k in (1, 2)) + 5e-4 * random.standard_normal((1, 4, 3, n))
    assert end_needed(np.exp(-10 * t) * np.sin(2 * np.pi * 900 * t) + turning) == 1.0
    for left in (1e-2, 5e-3):
        assert end_needed(np.exp(np.log(left) / t[-1] * t) * np.sin(2 * np.pi * 900 * t) + turning) == 0.01
