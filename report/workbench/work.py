"""Work beside the page: one task at a time in a thread of its own, that tells its progress, can be
stopped, and never leaves the page waiting."""

from __future__ import annotations

import threading
import time
import traceback
from collections.abc import Callable
from typing import Any

from bokeh.document import Document
from bokeh.models import Button

from thermospindle.diagnosis.forward.model import FAILED

TICK = 1000  # ms between looks at the clock


class Stopped(Exception):
    """A user, or the end of the page, stopped work in the background."""


class Work:
    """What is at work (`name`, "" for nothing), and how it is stopped; `say` shows a sentence,
    `halt` is the button that is there meanwhile."""

    def __init__(self, document: Document, halt: Button, say: Callable[..., None]) -> None:
        self.document, self.halt, self.say = document, halt, say
        self.stop = threading.Event()
        self.name, self.last, self.began = "", "", 0.0

    def begin(self, name: str, task: Callable[[Callable[[str], None]], Any], done: Callable[[Any], None]) -> None:
        """Run `task` beside the page; it is given what to tell its progress, and `done` what it found."""
        if self.name:
            self.say(f"{self.name} is still at work; stop it first.")
            return
        self.name, self.halt.visible, self.last, self.began = name, True, "", time.monotonic()
        self.stop.clear()
        self._tell()
        clock = self.document.add_periodic_callback(self._tell, TICK)

        def progress(text: str) -> None:
            if self.stop.is_set():
                raise Stopped
            self.last = f": {text}"
            self.document.add_next_tick_callback(self._tell)

        def ended(found: Any, problem: str) -> None:
            self.document.remove_periodic_callback(clock)
            self.name, self.halt.visible = "", False
            self.say(problem, bad=True) if problem else done(found)

        def run() -> None:
            found, problem = None, ""
            try:
                found = task(progress)
            except Stopped:
                problem = f"{name} was stopped."
            except (*FAILED, OSError) as error:
                problem = f"{name}: {error}"
            except Exception as error:  # the page must not wait for ever; the terminal has the rest
                traceback.print_exc()
                problem = f"{name} failed: {type(error).__name__}: {error}"
            self.document.add_next_tick_callback(lambda: ended(found, problem))

        threading.Thread(target=run, name=name, daemon=True).start()

    def _tell(self) -> None:
        if self.name:
            self.say(f"{self.name}{self.last} ({time.monotonic() - self.began:.0f} s) ...")
