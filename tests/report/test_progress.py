"""Progress where standard error is no terminal."""

from __future__ import annotations

import json
import re
import time
from typing import Any

import pytest

from tests.conftest import ROOT
from thermospindle.cli import main
from thermospindle.diagnosis.data.observe import observe
from thermospindle.diagnosis.verdict import STEPS
from thermospindle.model.parallel import in_parallel
from thermospindle.report import progress
from thermospindle.report.verbs import compare


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "FIRST", 0.05)
    monkeypatch.setattr(progress, "EVERY", 0.05)


def test_long_work_tells_plain_lines_and_short_work_none(impatient: None, capsys: pytest.CaptureFixture[str]):
    """However long a step takes: that one runs is told before any has ended, and what is left once one has."""
    with progress.progress_bar(4) as done:
        time.sleep(0.2)
        done("first\x1b[31m done")
        time.sleep(0.2)
    told = capsys.readouterr()
    assert told.out == ""
    lines = told.err.splitlines()
    assert lines[0] == "0 s: 0 of 4 steps done; last: starting"
    assert re.fullmatch(r"0 s: 1 of 4 steps done(, about \d s left)?; last: first\\x1b\[31m done", lines[-1])
    assert 4 <= len(lines) <= 9
    with progress.progress_bar(4) as done:
        done("all")
    time.sleep(0.1)
    assert capsys.readouterr().err == ""


def test_a_long_step_is_seen_to_go_on(impatient: None, capsys: pytest.CaptureFixture[str]):
    """How many of its pieces are done, until the step is."""

    def piece(k: int) -> int:
        time.sleep(0.15)
        return k

    with progress.progress_bar(2) as done:
        assert in_parallel(piece, range(3), workers=1) == [0, 1, 2]
        done("first")
        time.sleep(0.15)
    lines = capsys.readouterr().err.splitlines()
    assert "0 s: 0 of 2 steps done; last: starting; at hand: 1 of 3" in lines
    assert "0 s: 0 of 2 steps done; last: starting; at hand: 2 of 3" in lines
    assert "at hand" not in lines[-1]
    in_parallel(piece, range(2), workers=1)
    assert capsys.readouterr().err == ""


def test_the_time_that_is_left_does_not_grow_while_a_step_takes_long():
    """Of four steps the first took 10 s and the second goes on: its own 10 s run down, then the other two are what is left at least."""
    told = [progress._line(seconds, 10.0, 1, [1.0] * 4, "first") for seconds in (10.0, 18.0, 19.0, 60.0, 600.0)]
    assert [line.split(", ", 1)[1].split(" left")[0] for line in told] == ["about 30 s", "about 22 s", "about 21 s", "more than 20 s", "more than 20 s"]
    assert "3 of 4 steps done; last: third" in progress._line(600.0, 30.0, 3, [1.0] * 4, "third")
    assert "about 5 s left" in progress._line(35.0, 30.0, 3, [1.0] * 4, "third")


def test_a_first_step_that_takes_long_foretells_nothing_of_eighty():
    """Its one of 82 steps took 40 s, and 12 minutes were told to be left of one."""
    assert "left" not in progress._line(40.0, 40.0, 4, [1.0] * 82, "warmed up")
    assert "about 20 s left" in progress._line(60.0, 60.0, 60, [1.0] * 80, "modes")


def test_steps_that_take_longer_are_told_to_do_so():
    """Eight tests are read in 8 s; what fits effects takes eighteen times as long as one of these."""
    takes = [*[1.0] * 8, *STEPS]
    assert f"about {sum(STEPS):.0f} s left" in progress._line(8.0, 8.0, 8, takes, "read")
    assert "8 of 16 steps done" in progress._line(8.0, 8.0, 8, takes, "read")


@pytest.mark.parametrize("verb", ["compare", pytest.param("ladder", marks=pytest.mark.slow)])
def test_a_verb_in_a_pipe_is_told_from_one_that_hangs(verb: str, impatient: None, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch):
    """On standard error alone: the answer stays one JSON object. The ladder's lines have its last step."""

    def slowly(*asked: Any) -> Any:
        time.sleep(0.3)
        return observe(*asked)

    monkeypatch.setattr(compare, "observe", slowly)  # whose modes another test may have had worked out
    scene = ROOT / "scenes" / "hdd_2003"
    chosen = ["--effects", "bond_softening"] if verb == "ladder" else []
    assert main([verb, str(scene), str(scene / "measured" / "jang_2003"), *chosen, "--json"]) == 0
    told = capsys.readouterr()
    json.loads(told.out)
    words = r"\d+ s: step \d \(.*\) done, error [\d.]+ s\.e\.; now: fitting .*" if verb == "ladder" else r"\d+ s: \d of 4 steps done.*; last: .*"
    assert any(re.fullmatch(words, line) for line in told.err.splitlines()), told.err
