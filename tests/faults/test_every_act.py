"""What a SIGKILL would leave at many moments of one run: copies of its folder as it goes, since
what takes minutes cannot be killed a hundred times.

Before every act on its files the run makes one itself (`launch`); between them, amid what compiled libraries
write, it is stopped (SIGSTOP) at random moments while its folder is copied. Both leave what SIGKILL leaves:
all that was written so far, and nothing of what the process still holds. `test_kills` kills.
"""

import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections import Counter

import numpy as np
import pytest

from tests.faults.conftest import COUNTS, SEED
from tests.faults.launch import watch
from tests.faults.test_kills import state
from tests.faults.test_surroundings import LEAST
from tests.faults.verbs import VERBS, Verb, acts, fresh, launched, marked, prepare, surroundings, tree, work_folders
from tests.torture.apart import tried_apart
from thermospindle.cli import main

NEW = next(v for v in VERBS if v.name == "new")
AGAIN, MOST = 2, 100  # copies that a verb is run in once more, and at random moments


def moments(verb: Verb, place, to, cache) -> None:
    """One run of a verb, with copies before its acts beside `place` and, once it writes, at random moments in the folder `to`."""
    rng, count, last = np.random.default_rng(SEED), 0, None
    command = [sys.executable, "-m", "tests.faults.launch", str(place), "-1", str(place.parent / "acts"), *verb.line(place)]
    running = subprocess.Popen(command, env=surroundings(cache), cwd=place, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        while running.poll() is None:
            time.sleep(rng.uniform(0.001, 0.1))
            if count < MOST and work_folders(place) and running.poll() is None:
                running.send_signal(signal.SIGSTOP)
                _, status = os.waitpid(running.pid, os.WUNTRACED)
                if not os.WIFSTOPPED(status):
                    running.returncode = os.waitstatus_to_exitcode(status)
                    break
                now = tuple((p, p.lstat().st_size, p.lstat().st_mtime_ns) for p in sorted(place.rglob("*")))
                if now != last:  # not what was there a moment ago
                    shutil.copytree(place, to / str(count := count + 1))
                    last = now
                running.send_signal(signal.SIGCONT)
    finally:
        running.kill()
    assert running.wait() == 0


def cleared(verb: Verb, place) -> None:
    """Takes away what a verb does not replace."""
    if verb.whole is not marked and verb.name != "study":
        fresh(place / verb.target) if (place / verb.target).is_dir() else (place / verb.target).unlink(missing_ok=True)


@pytest.mark.slow
@pytest.mark.parametrize("verb", VERBS, ids=lambda v: v.name.replace(" ", "_"))
def test_a_kill_at_any_moment_of_one_run(verb, tmp_path, cache):
    first, place = prepare(tmp_path / "first" / "here"), prepare(tmp_path / "here")
    done = launched(first, verb.line(first), cache)
    assert done.returncode == 0, done.stderr
    reference = tree(first / verb.target)
    if verb.whole is marked:
        shutil.copytree(first / verb.target, place / verb.target)  # an older result
    (tmp_path / "stopped").mkdir()
    moments(verb, place, tmp_path / "stopped", cache)
    copies = [*(tmp_path / "acts.copies").iterdir(), *(tmp_path / "stopped").iterdir()]
    assert len(copies) >= acts(place) > 1
    found = {copy: state(verb, copy, reference) for copy in copies}
    COUNTS[f"{verb.name}, copies"] = Counter(f"{'before an act' if 'acts' in copy.parent.name else 'stopped'}, {what}" for copy, what in found.items())
    left = [copy for copy in copies if found[copy] == "moved away"] or [copy for copy in copies if work_folders(copy)] or copies
    for copy in np.random.default_rng(SEED).permutation(np.array(left, object))[:AGAIN]:
        cleared(verb, copy)
        done = launched(copy, verb.line(copy), cache)
        assert done.returncode == 0, done.stderr
        assert state(verb, copy, reference) == "whole"
        assert not work_folders(copy), "left behind by the killed run"
    fresh(tmp_path)


def test_new_killed_before_every_act(tmp_path, capfd):
    """In every run of the tests: the first verb that anybody uses, in forks of this process."""
    import thermospindle.report.verbs.starting  # noqa: F401, once here and not in every fork

    first, place = prepare(tmp_path / "first"), prepare(tmp_path / "here")

    def run(folder, copies=None) -> None:
        def act() -> None:
            os.chdir(folder)
            if copies is not None:
                watch(str(folder), 0, copies)
            assert main(NEW.line(folder)) == 0

        tried_apart(act, ())

    run(first)
    reference = tree(first / NEW.target)
    run(place, tmp_path / "copies")
    assert state(NEW, place, reference) == "whole"
    found = {copy: state(NEW, copy, reference) for copy in (tmp_path / "copies").iterdir()}
    assert set(found.values()) == {"none", "whole"}
    assert any(work_folders(copy) for copy in found)
    for copy in found:
        cleared(NEW, copy)
        run(copy)
        assert state(NEW, copy, reference) == "whole"
        assert not work_folders(copy), "left behind by the killed run"


def test_new_without_room(tmp_path, capfd):
    """As on a full disk: a sentence, nothing left behind, and with room again it works."""
    import thermospindle.report.verbs.starting  # noqa: F401, once here and not in every fork

    place = prepare(tmp_path / "here")
    before = tree(place)

    def act() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (LEAST, LEAST))
        assert main(NEW.line(place)) == 2

    tried_apart(act, ())
    assert "too large" in capfd.readouterr().err
    assert tree(place) == before
    assert not work_folders(place)
    tried_apart(lambda: main(NEW.line(place)), ())
    assert (place / "out" / "spindle.toml").is_file()
