"""The command line as tests call it: with an answer, or refused."""

import json
import re

from tests.conftest import SCENE
from thermospindle.cli import main


def answer(capsys, *arguments):
    assert main([str(a) for a in arguments]) == 0
    captured = capsys.readouterr()
    return json.loads(captured.out)


def refused(capsys, *arguments):
    """The one sentence a refused call says."""
    try:
        code = main([str(a) for a in arguments])
    except SystemExit as stop:
        code = stop.code
    captured = capsys.readouterr()
    assert code == 2
    assert captured.out == ""
    assert len(captured.err.strip().splitlines()) == 1
    assert captured.err.startswith("spindle: ")
    return captured.err


def changed_scene(folder, *pairs, count=1):
    """A copy of the scene's file, in `folder`, with some text replaced (pattern, new)."""
    text = (SCENE / "spindle.toml").read_text(encoding="utf-8")
    for old, new in pairs:
        assert re.search(old, text)
        text = re.sub(old, new, text, count=count)
    (folder / "s").mkdir(exist_ok=True)
    (folder / "s" / "spindle.toml").write_text(text, encoding="utf-8")
    return folder / "s"
