"""A session on the workbench without a browser: what its server and a user would do next."""

import time

from bokeh.events import ButtonClick
from bokeh.server.callbacks import PeriodicCallback

from tests.conftest import SCENE

CAMPAIGN = SCENE / "virtual" / "soak_20_60"


def turn(page):
    """What the server's loop would do next."""
    for callback in list(page.document.session_callbacks):
        if isinstance(callback, PeriodicCallback):
            continue
        page.document.callbacks.remove_session_callback(callback)
        callback.callback()


def finish(page, seconds=60):
    end = time.monotonic() + seconds
    while page.work.name:
        assert time.monotonic() < end, page.message.text
        turn(page)
        time.sleep(0.01)


def click(button):
    return ButtonClick(button)
