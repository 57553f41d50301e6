"""The picture of the workbench in docs/: `python -m tests.report.workbench_picture` drives a browser as a user would."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.conftest import DATA, ROOT, SCENE
from tests.report.browser import Browser


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "thermospindle", "workbench", str(SCENE), str(DATA / "foreign_bond"), "--json", "--no-browser", "--out", "out/mine"]
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        address = json.loads(process.stdout.readline())["address"]
        tab = Browser(Path(folder), 1400, 1480)
        try:
            tab.scheme("light")
            tab.open(address)
            tab.wait("document.body?.dataset.ready === 'yes'")
            for name, value in (("test", "T60_n0"), ("add", "bond_softening")):
                tab.run(f"{tab.model(name)}.value = {json.dumps(value)}")
            tab.wait(f"!!{tab.model('bond_softening.width')}")
            tab.run(f"{tab.model('left_out')}.active = [6]")
            tab.run(f"{tab.model('keep')}.trigger_event(new (Bokeh.require('core/bokeh_events').ButtonClick)()) ?? true")
            tab.click("find(e => e.tagName === 'BUTTON' && e.textContent.startsWith('Fit the ticked'))")
            tab.wait(f"{tab.model('message')}.text.includes('Fitted in')", 90)
            tab.click("find(e => e.tagName === 'BUTTON' && e.textContent === 'Keep as a step')")
            tab.run(f"{tab.model('mode')}.value = '2'")
            tab.click("find(e => e.tagName === 'BUTTON' && e.textContent.startsWith('Tolerances'))")
            tab.run("scrollTo(0, 0) ?? true")
            time.sleep(1.5)
            tab.run("document.activeElement.blur() ?? true")
            tab.picture(ROOT / "docs" / "workbench.png", whole=False)
        finally:
            tab.close()
            process.send_signal(signal.SIGINT)
            process.wait(20)


if __name__ == "__main__":
    main()
