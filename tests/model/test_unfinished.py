"""Long work that was stopped goes on from what it had computed, and to the same result."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT
from thermospindle.model.files import unfinished
from thermospindle.model.parallel import in_parallel


class Stopped(KeyboardInterrupt):
    """As of Ctrl-C."""


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("THERMOSPINDLE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(unfinished, "SOON", -1.0)
    return tmp_path / "cache"


def work(asked: list[int], stop: int | None = None, question: bytes = b"squares", said: list[str] | None = None) -> list[list[int]]:
    """Two calls of `in_parallel` with one within; an item `stop` stops all."""

    def square(k: int) -> int:
        if k == stop:
            raise Stopped
        asked.append(k)
        return sum(in_parallel(lambda i: i, [k * k], 1))

    with unfinished.going_on(question, (said if said is not None else []).append):
        return [in_parallel(square, range(4), 1), in_parallel(square, range(4, 7), 1)]


def test_what_was_computed_is_not_computed_again(cache: Path) -> None:
    asked, said = list[int](), list[str]()
    with pytest.raises(Stopped):
        work(asked, stop=5, said=said)
    assert asked == [0, 1, 2, 3, 4]
    assert said == ["what was computed is kept; the same command goes on from there"]
    assert work(asked, said=said) == [[0, 1, 4, 9], [16, 25, 36]]
    assert asked == [0, 1, 2, 3, 4, 5, 6]
    assert said[1:] == ["goes on from what a run that was stopped has computed"]
    assert not list(cache.glob("unfinished-*"))
    assert work(asked) == [[0, 1, 4, 9], [16, 25, 36]]
    assert len(asked) == 14


def test_another_question_begins_anew(cache: Path) -> None:
    asked = list[int]()
    with pytest.raises(Stopped):
        work(asked, stop=5)
    work(asked, question=b"other squares")
    assert asked == [0, 1, 2, 3, 4, 0, 1, 2, 3, 4, 5, 6]


@pytest.mark.parametrize("damage", ["cut off", "changed"])
def test_a_damaged_record_is_computed_again(cache: Path, damage: str) -> None:
    asked = list[int]()
    with pytest.raises(Stopped):
        work(asked, stop=5)
    [file] = cache.glob("unfinished-*/0001-4")
    content = bytearray(file.read_bytes())
    if damage == "cut off":
        del content[-3:]
    else:
        content[-1] ^= 1
    file.write_bytes(content)
    assert work(asked) == [[0, 1, 4, 9], [16, 25, 36]]
    assert asked == [0, 1, 2, 3, 4, 3, 5, 6]


def test_what_takes_little_time_is_not_kept(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unfinished, "SOON", 60.0)
    asked, said = list[int](), list[str]()
    with pytest.raises(Stopped):
        work(asked, stop=5, said=said)
    assert not said
    assert not list(cache.glob("unfinished-*"))


def test_work_that_ends_in_an_error_keeps_nothing(cache: Path) -> None:
    """It would end in the same again."""
    said = list[str]()

    def fails() -> None:
        with unfinished.going_on(b"squares", said.append):
            in_parallel(lambda k: k * k, range(3), 1)
            raise ValueError("no square")

    with pytest.raises(ValueError, match="no square"):
        fails()
    assert not said
    assert not list(cache.glob("unfinished-*"))


def test_what_was_not_asked_for_longest_goes_first(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(unfinished, "MOST_BYTES", 300)
    for question in (b"one", b"two", b"three"):
        with pytest.raises(Stopped):
            work([], stop=5, question=question)
        assert len(list(cache.glob("unfinished-*"))) <= 2


def test_without_a_cache_nothing_is_kept(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("THERMOSPINDLE_CACHE", "")
    asked = list[int]()
    with pytest.raises(Stopped):
        work(asked, stop=5)
    assert work(asked) == [[0, 1, 4, 9], [16, 25, 36]]
    assert len(asked) == 12


STOPPED = """
import sys
from thermospindle.diagnosis.inference import hypothesis
from thermospindle.model import parallel
from thermospindle.model.files import unfinished

parallel.cores = unfinished.cores = lambda: 1
unfinished.SOON, stop, fitted, count = -1.0, int(sys.argv.pop(1)), hypothesis._fit_one, 0


def counted(*what):
    global count
    count += 1
    if count == stop:
        raise KeyboardInterrupt
    return fitted(*what)


hypothesis._fit_one = counted
from thermospindle.__main__ import main

code = main()
print(count, file=sys.stderr)
sys.exit(code)
"""


@pytest.mark.slow  # half a minute
def test_a_diagnosis_that_was_stopped_says_the_same(cache: Path) -> None:
    """Stopped at its fifth fit, in one process."""
    asked = ["diagnose", str(ROOT / "scenes" / "free_shaft"), str(ROOT / "scenes" / "free_shaft" / "measured" / "modelab"), "--json"]

    def run(stop: int) -> tuple[int, str, list[str]]:
        done = subprocess.run([sys.executable, "-c", STOPPED, str(stop), *asked], capture_output=True, text=True, timeout=600)
        return done.returncode, done.stdout, done.stderr.splitlines()

    code, _, said = run(5)
    assert code == 130
    assert "spindle: what was computed is kept; the same command goes on from there" in said
    (_, resumed, went_on), (_, anew, began) = run(0), run(0)
    assert json.loads(resumed) == json.loads(anew)
    assert int(began[-1]) == int(went_on[-1]) + 4
