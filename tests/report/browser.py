"""A headless Chromium, driven over its DevTools protocol: what a user sees and does, for tests and for pictures of docs/.

Tornado, which the workbench's library brings, speaks to it; no driver needs to be installed.
Protocol: https://chromedevtools.github.io/devtools-protocol/
"""

from __future__ import annotations

import asyncio
import base64
import json
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any
from urllib.request import Request, urlopen

from tornado.websocket import websocket_connect

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
FIND = """
function find(test, root = document) {
  for (const e of root.querySelectorAll("*")) {
    if (test(e)) return e
    if (e.shadowRoot) { const found = find(test, e.shadowRoot); if (found) return found }
  }
  return null
}
"""


def installed() -> str | None:
    return next((path for name in NAMES if (path := shutil.which(name))), None)


class Browser:
    """One tab. `run` takes an expression of JavaScript and gives its value; `model` is one of Bokeh's by name."""

    def __init__(self, folder: Path, width: int = 1400, height: int = 1000) -> None:
        command = [installed() or "", "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars", "--no-first-run"]
        command += ["--remote-debugging-port=0", f"--user-data-dir={folder}", f"--window-size={width},{height}", "about:blank"]
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.loop, self.count, self.errors = asyncio.new_event_loop(), 0, list[str]()
        port_file = folder / "DevToolsActivePort"
        until(lambda: port_file.exists() and port_file.read_text().count("\n") >= 1, 30)
        port = port_file.read_text().split()[0]
        with urlopen(Request(f"http://127.0.0.1:{port}/json/new?about:blank", method="PUT")) as answer:
            where = json.load(answer)["webSocketDebuggerUrl"]
        self.socket = self.loop.run_until_complete(_connected(where))
        for domain in ("Page", "Runtime", "Accessibility"):
            self.call(f"{domain}.enable")
        self.size(width, height)

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        return self.loop.run_until_complete(self._call(method, parameters))

    async def _call(self, method: str, parameters: dict[str, Any]) -> dict[str, Any]:
        self.count += 1
        await self.socket.write_message(json.dumps({"id": self.count, "method": method, "params": parameters}))
        while True:
            message = await asyncio.wait_for(self.socket.read_message(), 60)
            assert message is not None, "the browser is gone"
            answer = json.loads(message)
            if answer.get("method") == "Runtime.exceptionThrown":
                self.errors.append(json.dumps(answer["params"]["exceptionDetails"])[:600])
            if answer.get("method") == "Runtime.consoleAPICalled" and answer["params"]["type"] == "error":
                self.errors.append(json.dumps(answer["params"]["args"])[:600])
            if answer.get("id") == self.count:
                assert "error" not in answer, answer
                return answer["result"]

    def open(self, address: str) -> None:
        self.call("Page.navigate", url=address)

    def size(self, width: int, height: int) -> None:
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)

    def scheme(self, name: str) -> None:
        features = [{"name": "prefers-color-scheme", "value": name}, {"name": "prefers-reduced-motion", "value": "reduce"}]
        self.call("Emulation.setEmulatedMedia", features=features)

    def run(self, expression: str) -> Any:
        found = self.call("Runtime.evaluate", expression=f"(() => {{ {FIND} return ({expression}) }})()", returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def model(self, name: str) -> str:
        return f"Bokeh.documents[0].get_model_by_name({json.dumps(name)})"

    def wait(self, expression: str, seconds: float = 60) -> Any:
        """The first true value of an expression."""
        return until(lambda: self.run(expression), seconds, lambda: f"{expression} is still {self.run(expression)!r}; {self.errors}")

    def key(self, name: str, code: int, text: str = "", modifiers: int = 0) -> None:
        more = {"text": text} if text else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=name, code=name, windowsVirtualKeyCode=code, modifiers=modifiers, **more)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=name, code=name, windowsVirtualKeyCode=code, modifiers=modifiers)

    def mouse(self, kind: str, x: float, y: float) -> None:
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=0 if kind == "mouseReleased" else 1, clickCount=1)

    def click(self, expression: str) -> None:
        """Click the middle of an element."""
        self.run(f"({expression}).scrollIntoView({{block: 'center'}}) ?? true")
        x, y = self.run(f"(e => {{ const r = e.getBoundingClientRect(); return [r.x + r.width / 2, r.y + r.height / 2] }})({expression})")
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y)

    def picture(self, file: Path, whole: bool = True) -> None:
        found = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        file.write_bytes(base64.b64decode(found["data"]))

    def close(self) -> None:
        self.process.terminate()
        self.process.wait(20)
        self.loop.close()


async def _connected(where: str) -> Any:
    return await websocket_connect(where, max_message_size=2**28)


def until(asked: Any, seconds: float, says: Any = lambda: "waited in vain") -> Any:
    """The first true answer, asked again for some seconds."""
    end = time.monotonic() + seconds
    while not (found := asked()):
        assert time.monotonic() < end, says()
        time.sleep(0.05)
    return found
