"""The workbench served: who is let in and who is refused, over real HTTP and websocket."""

import asyncio
import logging
import os
import re
from pathlib import Path
from types import SimpleNamespace
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from tests.conftest import SCENE
from tests.test_site import ANSWERS
from thermospindle.cli import main
from thermospindle.report.workbench.server import serve


def status(address, method="GET", **headers):
    try:
        with urlopen(Request(address, headers=headers, method=method)) as answer:
            return answer.status, answer.read().decode(errors="replace")
    except HTTPError as error:
        return error.code, error.read().decode()


def upgraded(address, origin):
    """The status with which a websocket is refused, 101 where it is not."""

    async def ask():
        try:
            socket = await websocket_connect(HTTPRequest(address, headers={"Origin": origin} if origin else {}), subprotocols=["bokeh", "x"])
        except HTTPClientError as error:
            return error.code
        socket.close()
        return 101

    return asyncio.run(ask())


def test_it_tells_address_token_and_process(served):
    assert set(served) == {*ANSWERS["workbench"], "warnings"}
    assert re.fullmatch(rf"http://127\.0\.0\.1:\d+/{served['token']}/", served["address"])
    assert len(served["token"]) == 48
    os.kill(served["pid"], 0)


def test_with_the_token_the_page_comes_and_needs_no_other_host(served):
    code, text = status(served["address"])
    assert code == 200
    assert "<title>Workbench: HDD spindle" in text
    hosts = set(re.findall(r"(?:src|href)=[\"'](https?://[^/\"']+)", text))
    assert hosts <= {served["address"].split("/" + served["token"])[0]}


@pytest.mark.parametrize("path", ["", "ws", "static/js/bokeh.min.js", "0" * 48 + "/", "favicon.ico", "autoload.js"])
def test_without_the_token_nothing_is_served(served, path):
    base = served["address"].removesuffix(served["token"] + "/")
    code, text = status(base + path)
    assert code == (404 if path == "favicon.ico" else 403)
    assert path == "favicon.ico" or "needs the token that `spindle workbench` printed" in text
    assert served["token"] not in text


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE"])
def test_whatever_the_method(served, method):
    assert status(served["address"].removesuffix(served["token"] + "/") + "x", method)[0] == 403


def test_the_websocket_wants_the_token_and_the_own_origin(served):
    base, own = served["address"].replace("http", "ws"), served["address"].split("/" + served["token"])[0]
    assert upgraded(base.replace(served["token"], "0" * 48) + "ws", own) == 403
    assert upgraded(base + "ws", "http://evil.example") == 403
    assert upgraded(base + "ws", "null") == 403


@pytest.mark.parametrize("host", ["evil.example", "evil.example:{port}", "localhost:{port}", "127.0.0.1", "127.0.0.1:{port}.evil.example", ""])
def test_another_name_for_this_machine_is_refused(served, host):
    """A page elsewhere may turn its own name to 127.0.0.1 (DNS rebinding): then the token alone would not do."""
    port = re.search(r":(\d+)/", served["address"]).group(1)
    code, text = status(served["address"], Host=host.format(port=port))
    assert code in (400, 403)
    assert "Workbench" not in text
    assert status(served["address"], Host=f"127.0.0.1:{port}")[0] == 200


def test_it_listens_on_the_loopback_interface_alone(served):
    """By the kernel's own table of sockets, where there is one."""
    table = Path("/proc/net/tcp")
    if not table.exists():
        pytest.skip("no /proc/net/tcp on this system")
    port = int(re.search(r":(\d+)/", served["address"]).group(1))
    listening = [row.split()[1] for row in table.read_text().splitlines()[1:] if row.split()[3] == "0A"]
    assert [a for a in listening if a.endswith(f":{port:04X}")] == [f"0100007F:{port:04X}"]


def test_a_port_that_is_taken_is_said(served, capsys):
    port = re.search(r":(\d+)/", served["address"]).group(1)
    assert main(["workbench", str(SCENE), "--port", port, "--no-browser"]) == 2
    assert re.match(rf"spindle: --port {port}: Address already in use; another port, or none for a free one", capsys.readouterr().err)


@pytest.mark.parametrize("port", ["0", "70000", "http"])
def test_a_port_that_is_none_is_refused(port, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["workbench", str(SCENE), "--port", port])
    assert ended.value.code == 2
    assert "is not a port, 1 to 65535" in capsys.readouterr().err


def test_a_tab_that_is_closed_is_not_told_to_the_terminal(caplog):
    """Bokeh's server warns of a message that finds nobody: a tab closed while an answer was on its way."""
    serve(SimpleNamespace(io_loop=SimpleNamespace(start=lambda: logging.getLogger("bokeh.server.views.ws").warning("Failed sending message")), start=lambda: None, stop=lambda: None))
    assert not caplog.records
