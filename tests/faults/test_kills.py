"""kill -9 at any moment of every verb that writes: what was there stays whole, or what is new is;
the next run works and leaves nothing lying about."""

import os
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter

import numpy as np
import pyarrow.parquet as pq
import pytest

from tests.faults.conftest import COUNTS, KILLS, SEED
from tests.faults.verbs import QUICKEST, VERBS, Verb, acts, fresh, launched, marked, prepare, surroundings, tree, work_folders

SHARE = sum(v.weight for v in VERBS)


def state(verb: Verb, place, reference) -> str:
    """What stands at the place of a verb's result; an assertion where it is neither an older result nor a new one."""
    target = place / verb.target
    if verb.name == "study":
        for part in (target / "parts").glob("part-*.parquet"):
            assert pq.read_table(part).num_rows, "a part of a study is not whole"
        return "whole" if (target / "summary.json").exists() and without_log(tree(target)) == without_log(reference) else "begun"
    if target.exists():
        assert verb.whole(target, reference), f"{verb.name}: {sorted(tree(target))} is neither the old result nor the new one"
        return "whole"
    kept = [old for work in work_folders(place) for old in (work / "old").glob("*")]
    assert not kept or verb.whole(kept[0], reference), f"{verb.name}: what was moved away is not whole"
    return "moved away" if kept else "none"


def without_log(files):
    """A log holds when it was written."""
    return {name: value for name, value in files.items() if not name.endswith(".rrd")}


def killed_by_time(verb, place, cache, seconds) -> int:
    command = [sys.executable, "-m", "thermospindle", *verb.line(place)]
    running = subprocess.Popen(command, env=surroundings(cache), cwd=place, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        running.wait(seconds)
    except subprocess.TimeoutExpired:
        running.send_signal(signal.SIGKILL)
    return running.wait()


def survives(verb: Verb, times: int, tmp_path, cache) -> Counter:
    place, rng, count = prepare(tmp_path / "here"), np.random.default_rng([SEED, len(verb.name), times]), Counter()
    first = prepare(tmp_path / "first" / "here")
    start = time.perf_counter()
    done = launched(first, verb.line(first), cache)
    took = time.perf_counter() - start
    assert done.returncode == 0, done.stderr
    last, reference = acts(first), tree(first / verb.target)
    assert last > 1
    replaces = verb.whole is marked
    if replaces:
        shutil.copytree(first / verb.target, place / verb.target)  # an older result
    for k in range(times):
        if verb.name == "save" or k % 4 != 3:
            code = launched(place, verb.line(place), cache, kill_at=int(rng.integers(1, last + 1))).returncode
        else:
            code = killed_by_time(verb, place, cache, took * rng.uniform(0.2, 1.0))
        found = state(verb, place, reference)
        assert code in (-signal.SIGKILL, 0), code
        count[f"killed, {found}" if code else "too late"] += 1
        if not replaces and found == "whole":
            fresh(place / verb.target) if (place / verb.target).is_dir() else (place / verb.target).unlink()
    done = launched(place, verb.line(place), cache)
    assert done.returncode == 0, done.stderr
    assert state(verb, place, reference) == "whole"
    assert not work_folders(place), "left behind by killed runs"
    fresh(tmp_path)
    return count


@pytest.mark.slow
@pytest.mark.parametrize("verb", VERBS, ids=lambda v: v.name.replace(" ", "_"))
def test_killed_at_any_moment(verb, tmp_path, cache):
    times = max(2, round(KILLS * verb.weight / SHARE))
    COUNTS[verb.name] = survives(verb, times, tmp_path, cache)


def test_killed_at_three_moments(tmp_path, cache):
    """The quick guard in every run of the tests."""
    count = survives(QUICKEST, 3, tmp_path, cache)
    assert sum(count.values()) == 3


@pytest.mark.slow
def test_workers_do_not_outlive_a_killed_run(tmp_path, cache):
    """loky's processes end with the one that started them."""
    place = prepare(tmp_path / "here")
    (place / "study.toml").write_text('title = "t"\nkind = "monte-carlo"\nscene = "hdd_2003"\ntemperatures_C = [20]\ndraws = 2000\nchunk = 5\n', encoding="utf-8")
    command = [sys.executable, "-m", "thermospindle", "study", str(place / "study.toml"), "--out", str(place / "out")]
    running = subprocess.Popen(command, env=surroundings(cache), cwd=place, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)

    def children() -> list[int]:
        return [int(p) for p in os.listdir("/proc") if p.isdigit() and _session(p) == running.pid and int(p) != running.pid]

    until = time.monotonic() + 120
    while len([p for p in children() if b"LokyProcess" in _command(p)]) < 2 and time.monotonic() < until:
        time.sleep(0.1)
    running.send_signal(signal.SIGKILL)
    running.wait()
    until = time.monotonic() + 300  # a worker ends what it has in hand, and on a busy machine it may still be starting
    while children() and time.monotonic() < until:
        time.sleep(0.2)
    left = [_command(p) for p in children()]
    for p in children():
        os.kill(p, signal.SIGKILL)
    assert not left, left


def _session(process: str) -> int:
    try:
        with open(f"/proc/{process}/stat") as stream:
            return int(stream.read().rpartition(")")[2].split()[3])
    except OSError:
        return -1


def _command(process: int) -> bytes:
    try:
        with open(f"/proc/{process}/cmdline", "rb") as stream:
            return stream.read()
    except OSError:
        return b""
