"""One function over many items: what the workers return is what this process would have."""

import logging
import os
import subprocess
import sys
import time
from concurrent.futures import Future, InvalidStateError
from functools import partial

import cloudpickle
import numpy as np
import pytest

from tests.conftest import ROOT
from thermospindle.diagnosis.data.observe import observe
from thermospindle.model import parallel
from thermospindle.model.errors import BadInput
from thermospindle.model.machine import Condition
from thermospindle.model.parallel import in_parallel
from thermospindle.sim.campaign.campaign import read_campaign
from thermospindle.sim.operating import operating_point


@pytest.fixture
def at_once(monkeypatch):
    """Workers are started at once, however little there is to do."""
    monkeypatch.setattr(parallel, "START", 0.0)


def modes_at(spindle, celsius):
    point = operating_point(spindle, Condition(celsius))
    return os.getpid(), np.array([m.frequency for m in point.modes]), point.state.bearings[0].stiffness


def test_results_are_those_of_doing_it_here_to_the_last_bit(spindle, at_once):
    """Whole operating points, finite elements and all, in the order of the items."""
    temperatures = [60.0, 20.0, 47.0, 33.0]
    there = in_parallel(partial(modes_at, spindle), temperatures, 2)
    here = [modes_at(spindle, t) for t in temperatures]
    assert os.getpid() not in {pid for pid, *_ in there}
    for a, b in zip(there, here, strict=True):
        assert np.array_equal(a[1], b[1])
        assert np.array_equal(a[2], b[2])


def test_modes_of_measured_frfs_are_the_same(spindle, at_once):
    campaign = read_campaign(spindle.file.parent / "virtual" / "soak_20_60")
    said = []
    there, here = observe(campaign, spindle, said.append, 2), observe(campaign, spindle)
    assert said == [f"{o.test.id}: {len(o.frequency)} modes" for o in here]
    for a, b in zip(there, here, strict=True):
        assert np.array_equal(a.frequency, b.frequency)
        assert np.array_equal(a.covariance, b.covariance)
        assert np.array_equal(a.shape, b.shape)


def test_closures_travel_and_what_they_hold_stays_in_the_worker(at_once):
    held = []

    def count(_):
        held.append(None)
        return os.getpid(), len(held)

    found = in_parallel(count, range(8), 2)
    assert held == []
    for worker in {pid for pid, _ in found}:
        counts = [n for pid, n in found if pid == worker]
        assert counts == list(range(1, len(counts) + 1))  # sent once to each worker, not with every item


def test_what_the_function_holds_does_not_travel_with_every_item(at_once, monkeypatch):
    """A pool sends with every item what it is to call: of ten million bytes that a function holds next to nothing."""
    sent = []

    class Pool:
        def map(self, function, items):
            sent.extend(len(cloudpickle.dumps((function, item))) for item in items)
            return map(function, items)

    monkeypatch.setattr(parallel, "get_reusable_executor", lambda *_, **__: Pool())
    monkeypatch.setattr(parallel, "_last", (0, 0.0))
    held = np.arange(1_250_000.0)
    assert in_parallel(lambda i: held[i], range(5), 2) == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert len(sent) == 5
    assert max(sent) < 1000


def test_little_work_is_done_here():
    if parallel._running(2):
        parallel._last = (0, 0.0)
    assert {pid for pid in in_parallel(lambda _: os.getpid(), range(50), 2)} == {os.getpid()}
    assert in_parallel(lambda x: x, [], 2) == []


def test_much_work_is_handed_over_when_it_shows(monkeypatch):
    """After as much time as starting the workers costs, and in the order of the items."""
    monkeypatch.setattr(parallel, "_last", (0, 0.0))
    monkeypatch.setattr(parallel, "START", 0.3)

    def slow(i):
        time.sleep(0.1)
        return os.getpid(), i

    found = in_parallel(slow, range(8), 2)
    assert [i for _, i in found] == list(range(8))
    here = [pid == os.getpid() for pid, _ in found]
    assert 1 <= sum(here) <= 4
    assert here == sorted(here, reverse=True)


def test_workers_are_used_again(at_once):
    def who(_):
        time.sleep(0.05)
        return os.getpid()

    first = set(in_parallel(who, range(4), 2))
    assert set(in_parallel(who, range(4), 2)) <= first


def test_in_a_worker_nothing_is_parallel(at_once):
    def who(_):
        return os.getpid(), set(in_parallel(lambda _: os.getpid(), range(3), 2))

    assert all(inner == {pid} for pid, inner in in_parallel(who, range(4), 2))


def test_what_is_raised_there_is_raised_here(at_once):
    def refuse(i):
        if i == 2:
            raise BadInput("scene.toml: key = 2: must be 1")
        return i

    with pytest.raises(BadInput, match=r"scene\.toml: key = 2: must be 1"):
        in_parallel(refuse, range(4), 2)
    assert in_parallel(lambda i: i + 1, range(4), 2) == [1, 2, 3, 4]


def test_a_script_needs_no_guard(tmp_path):
    """Other than with `multiprocessing`, whose workers run the script again."""
    script = tmp_path / "script.py"
    script.write_text(
        "import os\n"
        "from thermospindle.model import parallel\n"
        "parallel.START = 0.0\n"
        "def square(x):\n"
        "    return os.getpid(), x * x\n"
        "print('once')\n"
        "found = parallel.in_parallel(square, range(4), 2)\n"
        "assert os.getpid() not in {pid for pid, _ in found}\n"
        "assert [y for _, y in found] == [0, 1, 4, 9]\n"
    )  # fmt: skip
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)})
    assert (done.returncode, done.stdout) == (0, "once\n"), done.stderr


def test_nothing_else_makes_processes():
    words = ("multiprocessing", "ProcessPool", "os.fork", "loky", "joblib")
    files = [f for p in ("model", "thermal", "sim", "diagnosis", "report") for f in (ROOT / p).rglob("*.py")]
    found = [f for f in files if any(word in f.read_text(encoding="utf-8") for word in words)]
    assert found == [ROOT / "model" / "parallel.py"]


KILLED = """
import os, time
from pathlib import Path
from thermospindle.model import parallel
parallel.START = 0.0
def work(k):
    Path(f"{os.getpid()}.pid").touch()
    time.sleep(2)
    return bytes(10_000_000)  # more than a pipe holds
parallel.in_parallel(work, range(8), 2, done=lambda result: time.sleep(600))
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows keeps the number of a parent that is gone")
def test_workers_end_with_the_process_that_was_killed(tmp_path):
    """Found by `make faults`: a worker with a large result in hand waited for ever, since nobody
    read the pipe and it held its other end itself."""
    running = subprocess.Popen([sys.executable, "-c", KILLED], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)})
    until = time.monotonic() + 120
    while len(list(tmp_path.glob("*.pid"))) < 2 and time.monotonic() < until:
        time.sleep(0.2)
    workers = [int(file.stem) for file in tmp_path.glob("*.pid")]
    running.kill()
    running.wait()
    assert len(workers) == 2
    assert running.pid not in workers
    until = time.monotonic() + 30
    while (left := [pid for pid in workers if _runs(pid)]) and time.monotonic() < until:
        time.sleep(0.2)
    for pid in left:
        os.kill(pid, 9)
    assert not left


def _runs(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_what_is_begun_meanwhile_is_there_when_it_is_asked_for():
    """By a worker, which is another process; on one core by whoever asks."""
    with parallel.meanwhile(os.getpid, 2) as there, parallel.meanwhile(os.getpid, 1) as here:
        assert there() == there() != os.getpid()
        assert here() == os.getpid()


def test_a_pool_that_is_stopped_tells_no_trace_of_its_own():
    """Work that was cancelled before is told to be so once more as a pool is shut down: a trace of that stood before the sentence."""
    logger = logging.getLogger("concurrent.futures")
    one = Future()
    one.cancel()
    try:
        one.set_exception(ValueError())
    except InvalidStateError:
        record = logger.makeRecord(logger.name, logging.CRITICAL, "", 0, "Exception in executor manager thread:", (), sys.exc_info())
    assert not parallel._no_cancelled_future(record)
    assert parallel._no_cancelled_future(logger.makeRecord(logger.name, logging.CRITICAL, "", 0, "else", (), (ValueError, ValueError(), None)))
    assert parallel._no_cancelled_future(logger.makeRecord(logger.name, logging.CRITICAL, "", 0, "nothing", (), None))
