"""The page served to this machine alone: on the loopback interface, under an address that holds a random token, and to no other origin."""

from __future__ import annotations

import logging
import secrets
import signal
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bokeh.application import Application
from bokeh.application.handlers.function import FunctionHandler
from bokeh.core.validation import silence
from bokeh.core.validation.warnings import EMPTY_LAYOUT
from bokeh.document import Document
from bokeh.events import ConnectionLost
from bokeh.models import CustomJS
from bokeh.server.server import Server
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from tornado.httputil import HTTPServerRequest
from tornado.routing import Matcher, Rule
from tornado.web import RequestHandler

from thermospindle.model.errors import BadInput
from thermospindle.report.workbench.bench import Bench
from thermospindle.report.workbench.explanations import Explanations
from thermospindle.report.workbench.page import Page
from thermospindle.report.workbench.plots import COMPUTED, MEASURED

HERE = Path(__file__).parent
LOOPBACK = "127.0.0.1"
REFUSAL = "This address needs the token that `spindle workbench` printed when it started.\n"


silence(EMPTY_LAYOUT)  # no effect is added at the beginning


class ElsewhereCalled(Matcher):
    """Requests to a host of another name: of a page elsewhere whose name was turned to this machine (DNS rebinding)."""

    def __init__(self, own: str) -> None:
        self.own = own

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        return None if request.host == self.own else {}


class Refused(RequestHandler):
    """Whatever is not under the token, or not asked of this address."""

    def prepare(self) -> None:
        self.set_status(403)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(REFUSAL)


def server(bench: Bench, out: Path, known: Explanations | None, port: int) -> tuple[Server, str]:
    """A server that is ready to start, and the address of its page; a free port where that is 0. `BadInput` for a port that is taken."""
    secret = secrets.token_hex(24)
    chosen = port or free_port()
    try:
        made = Server(
            Application(FunctionHandler(page_of(bench, out, known))), port=chosen, address=LOOPBACK, prefix=secret,
            allow_websocket_origin=[f"{LOOPBACK}:{chosen}"], ico_path="none", check_unused_sessions_milliseconds=5000, unused_session_lifetime_milliseconds=15000,
        )  # fmt: skip
    except OSError as error:
        raise BadInput(f"--port {chosen}: {error.strerror or error}; another port, or none for a free one, is needed") from None
    router = made._tornado.wildcard_router
    router.add_rules([(r".*", Refused), Rule(ElsewhereCalled(f"{LOOPBACK}:{chosen}"), Refused)])
    router.rules.insert(0, router.rules.pop())
    return made, f"http://{LOOPBACK}:{chosen}/{secret}/"


def free_port() -> int:
    with socket.socket() as found:
        found.bind((LOOPBACK, 0))
        return int(found.getsockname()[1])


def page_of(bench: Bench, out: Path, known: Explanations | None) -> Callable[[Document], None]:
    """What makes the page of one browser tab."""
    template = Environment(loader=FileSystemLoader(str(HERE)), autoescape=True, undefined=StrictUndefined).get_template("page.html.j2")

    def make(document: Document) -> None:
        page = Page(bench, document, out, known)
        for name, model in page.roots().items():
            model.name = name
            document.add_root(model)
        document.js_on_event(ConnectionLost, CustomJS(code="dispatchEvent(new Event('spindle:lost'))"))
        document.title = f"Workbench: {bench.spindle.title}"
        document.template = template
        document.template_variables.update(words(bench))
        document.on_session_destroyed(lambda context: page.work.stop.set())

    return make


def words(bench: Bench) -> dict[str, Any]:
    campaign = bench.campaign
    count = len(bench.shown)
    under = f"{campaign.title}: {count} test{'s' * (count > 1)}" if campaign else "Without tests: the model alone, beside itself as it was opened"
    present = ", ".join(a.effect for a in bench.spindle.effects)
    under += f". Effects in the scene itself: {present}" if present else ""
    labels = Markup((HERE / "labels.js").read_text(encoding="utf-8"))
    return {"heading": bench.spindle.title, "under": under, "measured": campaign is not None, "measured_frfs": campaign is not None and any(t.frf for t in campaign.tests), "labels": labels, "colours": (MEASURED, COMPUTED)}


def serve(made: Server) -> None:
    """Serve until interrupted or told to end."""
    for quiet in ("tornado.access", "bokeh.server.views.ws"):  # who is refused, and that a tab was closed, is not told to the terminal
        logging.getLogger(quiet).setLevel(logging.ERROR)
    loop = made.io_loop
    before = {s: signal.signal(s, lambda *_: loop.add_callback_from_signal(loop.stop)) for s in (signal.SIGINT, signal.SIGTERM)}
    try:
        made.start()
        loop.start()
    finally:
        for s, handler in before.items():
            signal.signal(s, handler)
        made.stop()
