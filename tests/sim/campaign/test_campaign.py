"""Campaigns: what is written reads back bit for bit, and no write leaves half of one."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.made_campaign import FREQUENCY, POINTS, campaign, rotor_frf
from thermospindle.model.errors import BadInput
from thermospindle.model.files.whole import NEW
from thermospindle.model.scene.reading import SCENES, load
from thermospindle.model.units import RPM
from thermospindle.sim.campaign.campaign import Campaign, Test, read_campaign, write_campaign
from thermospindle.sim.campaign.form import in_unit
from thermospindle.sim.campaign.uff import read_frf, write_frf
from thermospindle.sim.run import Run, as_campaign


def test_campaign_reads_back_bit_for_bit(folder: Path) -> None:
    assert read_campaign(folder) == campaign()
    assert sorted(p.name for p in folder.iterdir()) == ["T20.5_n7200.uff", "T20_n0.uff", "campaign.toml", "modes.csv"]


def test_written_bytes_do_not_depend_on_when(folder: Path) -> None:
    write_campaign(read_campaign(folder), folder.with_name("d"))
    for file in folder.iterdir():
        assert file.read_bytes() == (folder.with_name("d") / file.name).read_bytes()


@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
@pytest.mark.parametrize(
    "frequency",
    [400.0 + np.arange(101), np.fft.rfftfreq(4096, 1 / 51200)[20:200], 400.05 + 0.1 * np.arange(99), np.linspace(1, 2, 77)],
    ids=["whole", "fft", "tenths", "sevenths"],
)
def test_frf_reads_back_bit_for_bit(tmp_path: Path, frequency: np.ndarray, quantity: str) -> None:
    frf = rotor_frf(frequency, quantity)
    corners = frf.value.copy()
    corners[0, 0, 5:8] = [complex(-0.0, 1e-300), complex(-0.0, -0.0), complex(5e-324, -1e308)]  # of double precision
    frf = replace(frf, value=corners)
    write_frf(tmp_path / "a.uff", frf, POINTS, "title", "test")
    assert read_frf(tmp_path / "a.uff", quantity, POINTS) == frf


def test_frf_equality_sees_the_last_bit() -> None:
    frf = rotor_frf()
    value = frf.value.copy()
    value[2, 1, 300] = complex(value[2, 1, 300].real, np.nextafter(value[2, 1, 300].imag, 1))
    assert frf == rotor_frf()
    assert frf != replace(frf, value=value)
    assert frf != replace(frf, sd=None)
    assert frf != replace(frf, reference_nodes=(6, 1))


def test_header_counts_the_bytes_of_the_data(folder: Path) -> None:
    """UC-SDRL: field 5 of the 58b line is the number of binary bytes; pyuff reads without it, other programs do not."""
    line = (folder / "T20_n0.uff").read_bytes().splitlines()[1]
    assert line.split() == [b"58b", b"1", b"2", b"11", str(301 * 16).encode(), b"0", b"0", b"0", b"0"]


@pytest.mark.parametrize("rpm", [0.0, 7200.0, 5400.1, -333.3, 10000 / 3])
def test_speeds_born_in_rpm_come_back(rpm: float) -> None:
    assert in_unit(rpm * RPM, RPM) * RPM == rpm * RPM


def test_existing_folder_is_kept(folder: Path) -> None:
    before = {f.name: f.read_bytes() for f in folder.iterdir()}
    with pytest.raises(BadInput, match="is not empty"):
        write_campaign(campaign(title="other"), folder)
    bad = campaign(tests=(Test("T", 20.0, 0.0, frf=replace(rotor_frf(), value=rotor_frf().value.conj())),))
    with pytest.raises(BadInput, match=re.escape(f"{folder}/T.uff: H(1,1)")):
        write_campaign(bad, folder, replace=True)
    assert {f.name: f.read_bytes() for f in folder.iterdir()} == before
    assert [f.name for f in folder.parent.iterdir()] == ["c"]


def test_replace_takes_only_a_campaign(folder: Path, tmp_path: Path) -> None:
    write_campaign(campaign(title="other", tests=campaign().tests[:1]), folder, replace=True)
    assert read_campaign(folder).title == "other"
    assert sorted(p.name for p in folder.iterdir()) == ["T20_n0.uff", "campaign.toml"]
    (tmp_path / "home").mkdir()
    (tmp_path / "home" / "thesis.txt").write_text("dear")
    with pytest.raises(BadInput, match="is not empty"):
        write_campaign(campaign(), tmp_path / "home", replace=True)


def changed(**changes: object) -> Campaign:
    test = campaign().tests[0]
    assert test.frf is not None
    return campaign(tests=(replace(test, frf=replace(test.frf, **changes)),))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (campaign(points=(replace(POINTS[0], name="hub_top_left"), *POINTS[1:])), "points.1.name = 'hub_top_left'.*10"),
        (
            campaign(points=(replace(POINTS[0], name="Nabenspäß"), *POINTS[1:])),
            "T20_n0.uff: points.1.name = 'Nabenspäß'.*ten bytes",
        ),
        (campaign(points=POINTS[:2]), r"T20_n0.uff: node 6 is no point.*\[1, 3\]"),
        (campaign(points=(replace(POINTS[0], direction=(0.6, 0.0, 0.8)), *POINTS[1:])), "directions along an axis"),
        (campaign(tests=(Test("a/b", 20.0, 0.0, frf=rotor_frf()),)), "tests.a/b.id = 'a/b': must be letters"),
        (campaign(tests=(Test("a", 20.0, 0.0),)), "tests.a: has neither frf nor rows"),
        (campaign(tests=(Test("a", 20.0, 0.0, conditions={"x": object()}, frf=rotor_frf()),)), "conditions: <object"),
        (campaign(quantity="receptance"), "tests.T20_n0: FRFs of mobility in a campaign of receptance"),
        (changed(value=np.full((3, 2, 301), np.nan + 0j)), "T20_n0.uff: FRF: needs finite numbers"),
        (changed(frequency=FREQUENCY[:-1]), r"FRF: needs finite numbers of shape \(3, 2, 300\)"),
        (changed(value=rotor_frf().value.astype(np.complex64)), "would not read back bit for bit"),
    ],
    ids=["name", "bytes", "node", "oblique", "id", "empty", "object", "quantity", "nan", "shape", "single"],
)
def test_writing_refuses(tmp_path: Path, bad: Campaign, words: str) -> None:
    with pytest.raises(BadInput, match=words):
        write_campaign(bad, tmp_path / "c")
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_left_of_a_write_that_fails(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk fills after the first file: the old campaign stays, no partial one appears."""

    def full(*_: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr("thermospindle.sim.campaign.campaign.write_modes", full)
    with pytest.raises(OSError, match="no space"):
        write_campaign(campaign(title="other"), folder, replace=True)
    assert read_campaign(folder) == campaign()
    assert [f.name for f in folder.parent.iterdir()] == ["c"]


def test_old_campaign_comes_back_when_the_new_one_cannot_be_moved(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    move = os.replace

    def refuse_new(path: Path, target: Path) -> None:
        if Path(path).parent.name == NEW:
            raise OSError("moving is refused")
        move(path, target)

    monkeypatch.setattr("thermospindle.model.files.whole.os.replace", refuse_new)
    with pytest.raises(OSError, match="moving"):
        write_campaign(campaign(title="other"), folder, replace=True)
    assert read_campaign(folder) == campaign()
    assert [f.name for f in folder.parent.iterdir()] == ["c"]


def test_a_virtual_test_says_where_its_shafts_have_their_masses(tmp_path: Path) -> None:
    """As the program stepped it, at nodes, if there are shafts; of a machine nothing is said."""
    for k, lumped in enumerate((True, False)):
        write_campaign(replace(campaign(), lumped_shafts=lumped), tmp_path / str(k))
        assert read_campaign(tmp_path / str(k)).lumped_shafts == lumped
        assert ("lumped_shafts = true" in (tmp_path / str(k) / "campaign.toml").read_text(encoding="utf-8")) == lumped
    for scene, lumped in (("five_bearing", True), ("hdd_2003", False)):
        assert as_campaign(Run(load(SCENES / scene), (), ()), "virtual").lumped_shafts == lumped
