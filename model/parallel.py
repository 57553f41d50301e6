"""Work in parallel: one function over many items, on all cores, with the results of doing it here.

Worker processes are started afresh, the same way on Linux, macOS and Windows, and never forked: a fork copies the threads of BLAS and
of MuJoCo in whatever state they are. Functions and items travel by cloudpickle, so that closures and functions of a script or notebook
travel too, and a script needs no `if __name__ == "__main__"`. The workers stay for the next call.
"""

from __future__ import annotations

import logging
import os
import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import InvalidStateError
from contextlib import contextmanager
from functools import lru_cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar
from uuid import uuid4

import cloudpickle
from loky import cpu_count, get_reusable_executor

from thermospindle.model.errors import BadInput

Item = TypeVar("Item")
Result = TypeVar("Result")

START = 2.0
"""s that the workers take to start and to import what they need: measured 1.6 to 3.1 s with two, 0.01 s once they run."""
IDLE = 300.0
"""s after which a worker without work goes."""
ENVIRONMENT = {
    "OPENBLAS_NUM_THREADS": "1",  # the cores are taken by the workers; as the command line has it, so that sums round alike
    "PYTHONSAFEPATH": "1",  # a worker is a `python -m`, which would import from the folder one happens to stand in
    "LOKY_MAX_MEMORY_LEAK_SIZE": "1e9",  # bytes that a worker may grow by until another takes its place: what is kept of a campaign's model takes 0.3e9
}

_last: tuple[int, float] = (0, 0.0)  # how many workers were last at work, until when
_inside = False  # this process is a worker
_watcher: Callable[[int, int], object] | None = None  # who is told how many items are done, and of how many
_keeper: Callable[[int], tuple[list[Any], Callable[[Any], object]]] | None = None  # who keeps results: of so many items those that are known, and what takes a further one


def cores() -> int:
    """Processor cores that this process may use; `BadInput` where the environment tells loky a number that is none."""
    try:
        return int(cpu_count())
    except ValueError:
        raise BadInput(f"LOKY_MAX_CPU_COUNT = {os.environ.get('LOKY_MAX_CPU_COUNT')!r}: must be a whole number, of 1 or more, or not set") from None


def in_parallel(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    workers: int | None = None,
    done: Callable[[Result], object] = lambda result: None,
) -> list[Result]:
    """`[function(item) for item in items]`, by so many processes (as many as there are cores where none are named).

    `done` is called here with every result, in order. The function must neither rely on nor change what is outside it: then the results
    are the same to the last bit. Each worker reads it once, and what it holds lives there as long as it is used, so large
    things belong into it (`functools.partial`) and small ones into the items. Whatever it raises is raised here.

    Workers that do not run yet are started only after as much work has been done here as starting them costs: so little work never
    waits for them, and much work takes at most that time longer than it could (the rule of renting until one should have bought).
    Within a worker nothing is parallel.
    """
    waiting, results = list(items), list[Result]()
    count = len(waiting)
    known, keep = _keeper(count) if _keeper is not None and not _inside else ([], lambda result: None)

    def finished(result: Result) -> None:
        results.append(result)
        done(result)
        tell(len(results), count)

    for result in known:
        finished(result)
    del waiting[: len(known)]
    workers = min(workers or cores(), len(waiting))
    patience = 0.0 if _running(workers) else START
    began = time.perf_counter()
    while waiting and (workers < 2 or _inside or len(waiting) == 1 or time.perf_counter() - began < patience):
        with keeping(None):  # what is parallel within it is so only here
            result = function(waiting.pop(0))
        keep(result)
        finished(result)
    if waiting:
        for result in _sent(function, waiting, workers):
            keep(result)
            finished(result)
    return results


@contextmanager
def keeping(keeper: Callable[[int], tuple[list[Any], Callable[[Any], object]]] | None) -> Iterator[None]:
    """Within it every call of `in_parallel` asks `keeper`, by how many items it has, for the first
    results if they are known, and for what takes each further one, in order."""
    global _keeper
    before, _keeper = _keeper, keeper
    try:
        yield
    finally:
        _keeper = before


@contextmanager
def watched(told: Callable[[int, int], object]) -> Iterator[None]:
    """Within it `told` is called with how many items `in_parallel` has done, and of how many, after each."""
    global _watcher
    before, _watcher = _watcher, told
    try:
        yield
    finally:
        _watcher = before


def tell(done: int, of: int) -> None:
    """Whoever watches how many parts of a long step are done, and of how many."""
    if _watcher is not None:
        _watcher(done, of)


@contextmanager
def meanwhile(function: Callable[[], Result], workers: int | None = None) -> Iterator[Callable[[], Result]]:
    """What asks for `function()`, which a worker has begun on while much else is done here; on a single core, or within a worker,
    it is done when it is asked for. For long work that is to be done in parallel later anyway: the workers are started with it."""
    workers = workers or cores()
    if workers < 2 or _inside:
        yield function
        return
    with _pool(workers) as pool:
        yield pool.submit(function).result


@contextmanager
def _pool(workers: int) -> Iterator[Any]:
    """The pool of workers, which whoever interrupts what is done with them ends."""
    global _last
    workers = _last[0] if _running(workers) else workers  # a pool that is larger is not made smaller
    warnings.filterwarnings("ignore", "A worker was restarted", UserWarning)  # which loses nothing, and is no news to whoever waits
    pool = get_reusable_executor(workers, timeout=IDLE, initializer=_begin, initargs=(os.getpid(),), env=ENVIRONMENT)
    _last = workers, time.monotonic()
    try:
        yield pool
    except KeyboardInterrupt:
        logging.getLogger("concurrent.futures").addFilter(_no_cancelled_future)
        pool.shutdown(kill_workers=True)
        raise
    _last = _last[0], time.monotonic()


def _no_cancelled_future(record: logging.LogRecord) -> bool:
    """Not the trace of a pool that, stopped, would tell its waiting work so, which has been cancelled before."""
    return record.exc_info is None or not isinstance(record.exc_info[1], InvalidStateError)


def _sent(function: Callable[[Item], Result], items: list[Item], workers: int) -> Iterator[Result]:
    with _pool(workers) as pool, TemporaryDirectory(prefix="thermospindle-") as folder:  # a pool sends with every item what it is to call
        sent = Path(folder) / uuid4().hex
        sent.write_bytes(packed(function))
        yield from pool.map(partial(_call, sent), items)


def _running(workers: int) -> bool:
    """Whether that many workers are at hand; half the idle time is left to them, lest they go while they are counted on."""
    there, until = _last
    return workers <= there and time.monotonic() - until < IDLE / 2


def packed(what: Any) -> bytes:
    """An object for another process or another day of the same user, closures and all."""
    return bytes(cloudpickle.dumps(what))


def unpacked(kept: bytes) -> Any:
    """What was packed. It runs what is in it: nothing that a file of data holds comes here."""
    return cloudpickle.loads(kept)


# ---------------------------------------------------------------- in a worker


def alone() -> None:
    """From here on this process is a worker among many, started by somebody else: nothing is parallel within it."""
    global _inside
    _inside = True


def _begin(parent: int) -> None:
    alone()
    threading.Thread(target=_leave_with, args=(parent,), daemon=True).start()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process that started this one says when to stop


def _leave_with(parent: int) -> None:
    """Ends this worker when the process that started it is gone, killed for instance: one that has a
    large result to hand over would wait for ever, since it holds the other end of the pipe itself."""
    while os.getppid() == parent:
        time.sleep(1.0)
    os._exit(1)


@lru_cache(maxsize=2)
def _function(sent: Path) -> Callable[[Any], Any]:
    return unpacked(sent.read_bytes())


def _call(sent: Path, item: Any) -> Any:
    return _function(sent)(item)
