"""How many examples are tried, and what became of them: a few in every run of the tests, the same each time; as many as
TORTURE_EXAMPLES says under `make torture`, others each time."""

import os
import signal
from collections import Counter
from contextlib import contextmanager

import pytest
from hypothesis import HealthCheck, Phase, settings

from tests.counted import in_other_processes
from tests.torture.apart import SECONDS, Hangs
from thermospindle.model.errors import BadInput, NoEquilibrium, NotConverged, OutsideRange

if os.name == "nt":  # alarms, pipes and limits of memory are not there
    collect_ignore_glob = ["test_*.py"]
EXAMPLES = int(os.environ.get("TORTURE_EXAMPLES", "0"))
FEW, WAIT, BYTES = 6, 300, 16 << 30  # of addresses: a fine mesh's factors reserve 11 GB and use 2
NAMED = (BadInput, NoEquilibrium, NotConverged, OutsideRange)
COUNTS: dict[str, Counter] = {}

settings.register_profile(
    "torture",
    max_examples=EXAMPLES or FEW,
    derandomize=not EXAMPLES,
    deadline=None,
    database=None,
    print_blob=True,
    phases=(Phase.explicit, Phase.generate),  # an example as it is: to shrink one that takes long takes too long
    suppress_health_check=list(HealthCheck),
)
settings.load_profile("torture")


@contextmanager
def outcome(what: str):
    """Counts how the block ends; only well, or with a named error of one sentence, is let pass."""
    count = COUNTS.setdefault(what, Counter())

    def stop(number: int, frame: object) -> None:
        raise Hangs(f"{what}: still running after {SECONDS} s of the processor's time, or {WAIT} s")

    before = {number: signal.signal(number, stop) for number in (signal.SIGALRM, signal.SIGPROF)}
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    signal.alarm(WAIT)
    try:
        yield
    except NAMED as error:
        if not 0 < len(str(error).strip()) < 4000:
            raise AssertionError("a named error says what is wrong, in a sentence") from error
        count[type(error).__name__] += 1
    except BaseException:
        count["other"] += 1
        raise
    else:
        count["result"] += 1
    finally:
        signal.alarm(0)
        signal.setitimer(signal.ITIMER_PROF, 0)
        for number, handler in before.items():
            signal.signal(number, handler)


@pytest.fixture(scope="session")
def cache(tmp_path_factory):
    return str(tmp_path_factory.mktemp("cache"))


@pytest.fixture(scope="module", autouse=True)
def bounded(cache):
    """Nothing may ask for all memory there is; what is computed of random machines does not fill the user's cache."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    if EXAMPLES:
        resource.setrlimit(resource.RLIMIT_AS, (BYTES, hard))
    kept = os.environ.get("THERMOSPINDLE_CACHE")
    os.environ["THERMOSPINDLE_CACHE"] = cache
    yield
    os.environ.pop("THERMOSPINDLE_CACHE")
    if kept is not None:
        os.environ["THERMOSPINDLE_CACHE"] = kept
    if EXAMPLES:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def pytest_terminal_summary(terminalreporter):
    if not EXAMPLES:
        return
    terminalreporter.section("torture")
    if in_other_processes(terminalreporter):
        return
    for what, count in sorted(COUNTS.items()):
        told = ", ".join(f"{number} {name}" for name, number in count.most_common())
        terminalreporter.write_line(f"{what:26} {sum(count.values()):7} examples: {told}")
    terminalreporter.write_line(f"{'all':26} {sum(sum(c.values()) for c in COUNTS.values()):7} examples")
