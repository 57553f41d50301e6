"""Where the work of a study is done: this machine's cores, or the workers of a Dask cluster.

An executor is a function of (function, numbers, done): it calls `done(k, function(k))` here for every number k, each exactly once. What
it computes depends on k alone, so all executors give the same results.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from importlib.util import find_spec
from itertools import islice
from typing import Any

from thermospindle.model import parallel
from thermospindle.model.errors import BadInput

Executor = Callable[[Callable[[int], Any], Sequence[int], Callable[[int, Any], None]], None]
AHEAD = 4
"""Numbers a worker is given at once: it never waits for the next one, and what is on its way stays little."""
PATIENCE = 10  # s for a scheduler to answer


def on_this_machine(function: Callable[[int], Any], numbers: Sequence[int], done: Callable[[int, Any], None]) -> None:
    """All cores of this machine (`model.parallel`)."""
    for some in _batched(numbers, AHEAD * parallel.cores()):
        parallel.in_parallel(partial(_numbered, function), some, done=lambda result: done(*result))


def _batched(numbers: Sequence[int], size: int) -> Iterator[list[int]]:
    rest = iter(numbers)
    while some := list(islice(rest, size)):
        yield some


def _numbered(function: Callable[[int], Any], k: int) -> tuple[int, Any]:
    return k, function(k)


@contextmanager
def on_cluster(address: str, versions: Callable[[], dict[str, str]]) -> Iterator[Executor]:
    """The workers of the Dask scheduler at `address`, which must have the versions that this process has.

    A worker that dies has its work done by another. Raises `BadInput` without Dask, without an answer, and for other versions.
    """
    if find_spec("distributed") is None:
        raise BadInput(f"--cluster {address}: needs Dask, which is not installed: pip install 'thermospindle[cluster]'")
    from distributed import Client, as_completed

    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        raise BadInput(f"--cluster {address}: no Dask scheduler answers there ({' '.join(str(error).split())})") from None
    with client:
        here = versions()
        for worker, there in client.run(versions).items():
            for name in here:
                if there[name] != here[name]:
                    raise BadInput(f"--cluster {address}: worker {worker} has {name} {there[name]}, and here it is {here[name]}; the same numbers need the same")

        def run(function: Callable[[int], Any], numbers: Sequence[int], done: Callable[[int, Any], None]) -> None:
            waiting = iter(numbers)
            sent = client.submit(_handed, function, pure=False)  # a task, which is done again where the worker that holds its result dies; scattered data would be lost
            room = AHEAD * max(1, sum(client.nthreads().values()))
            asked = [client.submit(_there, sent, k, pure=False) for k in islice(waiting, room)]
            coming = as_completed(asked, loop=client.loop)
            for future in coming:
                done(*future.result())
                future.release()
                if (k := next(waiting, None)) is not None:
                    coming.add(client.submit(_there, sent, k, pure=False))

        yield run


def _handed(function: Callable[[int], Any]) -> Callable[[int], Any]:
    return function


def _there(function: Callable[[int], Any], k: int) -> tuple[int, Any]:
    """In a worker of the cluster, which is one of many: nothing is parallel in it."""
    parallel.alone()
    return k, function(k)
