"""What is being done, on standard error and never on standard output: a bar in a terminal, elsewhere
now and then a plain line, so that long work in a pipe or a job's file is told from work that hangs."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from thermospindle.model.errors import visible
from thermospindle.model.files import unfinished
from thermospindle.model.parallel import packed, watched

FIRST, EVERY = 10.0, 30.0
"""s before the first plain line, and between one and the next: short work says nothing."""
TELLS = 0.1
"""Of all work, done, from which it tells how long the rest takes: first steps are often unlike the others."""


@contextmanager
def progress_bar(steps: int | Sequence[float]) -> Iterator[Callable[[str], None]]:
    """A function that takes what has been done, and counts it as one of so many steps, or the next
    of those that take as long as told, in any unit."""
    takes = [1.0] * steps if isinstance(steps, int) else list(steps)
    console = Console(stderr=True, markup=False)
    if not console.is_terminal:
        with plain_lines(takes) as told:
            yield told
        return
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True) as bar:
        task, left, last = bar.add_task("starting", total=sum(takes)), iter(takes), "starting"

        def told(what: str) -> None:
            nonlocal last
            last = what
            bar.update(task, advance=next(left, 0.0), description=what)

        with watched(lambda done, of: bar.update(task, description=last + _at_hand((done, of)))):
            yield told


def hint(words: str) -> None:
    """Says before long work what is quicker."""
    say(f"hint: {words}")


def going_on(asked: Mapping[str, Any], *read: object) -> AbstractContextManager[None]:
    """Within it what is computed in parallel of long work is kept as it comes: the same `asked` of
    a verb, of what it has `read`, goes on from where it was stopped."""
    effects = [Path(file).read_bytes() for file in asked["effect_files"]]
    options = sorted((key, repr(value)) for key, value in asked.items() if key not in ("effect_files", "out", "verbose"))
    return unfinished.going_on(packed((read, effects, options)), say)


def say(words: str) -> None:
    """A line on standard error."""
    if sys.stderr is not None:
        with suppress(OSError, ValueError):
            print(f"spindle: {visible(words)}", file=sys.stderr, flush=True)


@contextmanager
def plain_lines(takes: Sequence[float] | None = None) -> Iterator[Callable[[str], None]]:
    """The same in lines, told at their times however long a step takes; without what they take where nobody knows how many there will be."""
    began, done, last = time.monotonic(), 0, "starting"
    needed = 0.0  # for what has been done
    at_hand = 0, 0
    ended = threading.Event()

    def told(what: str) -> None:
        nonlocal done, last, needed, at_hand
        done, last, needed, at_hand = done + 1, what, time.monotonic() - began, (0, 0)

    def within(part: int, of: int) -> None:
        nonlocal at_hand
        at_hand = part, of

    def tell() -> None:
        wait = FIRST
        while not ended.wait(wait) and sys.stderr is not None:  # closed by the caller: `print` would take standard output
            with suppress(OSError, ValueError):  # whoever read it has gone
                print(_line(time.monotonic() - began, needed, done, takes, last) + _at_hand(at_hand), file=sys.stderr, flush=True)
            wait = EVERY

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        with watched(within):
            yield told
    finally:
        ended.set()
        teller.join()


def _line(seconds: float, needed: float, done: int, takes: Sequence[float] | None, last: str) -> str:
    """What has been done after `seconds`, of which the steps that have ended `needed` so many; a
    step that takes longer than those foretell leaves at least what they foretell of the others."""
    if takes is None:
        return f"{_duration(seconds)}: {visible(last)}"
    left, steps = "", len(takes)
    if 0 < done < steps and sum(takes[:done]) >= TELLS * sum(takes):
        unit, late = needed / sum(takes[:done]), seconds - needed
        this, others = unit * takes[done], unit * sum(takes[done + 1 :])
        left = f", about {_duration(others + this - late)} left" if late < this else f", more than {_duration(others)} left" if others >= 1 else ""
    return f"{_duration(seconds)}: {min(done, steps)} of {steps} steps done{left}; last: {visible(last)}"


def _at_hand(parts: tuple[int, int]) -> str:
    """How far the pieces are that a step is made of, all of one kind: a long step is seen to go on."""
    done, of = parts
    return f"; at hand: {done} of {of}" if 0 < done < of else ""


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 119.5 else f"{round(seconds) // 60}:{round(seconds) % 60:02d} min"
