"""What a new installation must do, far from any checkout: run by `tests.release_check` with the
environment's own Python, in an empty folder.

    python release_smoke.py SPINDLE [--short]

Prints one JSON object: what was done, and numbers that all environments must agree on. `--short`
leaves out the diagnosis, the time domain and most scenes.
"""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

SPINDLE, SHORT = sys.argv[1], "--short" in sys.argv


def spindle(*arguments: object, code: int = 0) -> str:
    """Standard output of a verb, which must end with `code` and without a traceback."""
    done = subprocess.run([SPINDLE, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode != code or "Traceback" in done.stderr:
        raise SystemExit(f"spindle {' '.join(map(str, arguments))}: exit code {done.returncode}, {done.stderr[-2000:]}")
    return done.stdout if code == 0 else done.stderr


def answer(*arguments: object) -> dict:
    return json.loads(spindle(*arguments, "--json"))


def main() -> dict:
    import thermospindle as ts

    where = Path(ts.__file__).resolve().parent
    done, numbers = [], {}
    assert spindle("--version").strip() == f"spindle {version('thermospindle')}"
    done.append("version")
    shipped = where / "scenes" / "hdd_2003"
    assert (shipped / "measured" / "jang_2003" / "campaign.toml").is_file(), "the shipped scenes are not there"
    for like in ("hdd", "machine-tool", "grinding", "rotor"):
        spindle("new", f"my-{like}", "--like", like)
        assert ts.load(f"my-{like}").points
    answer("check", "my-rotor", "--out", "checked")
    done.append("new of 4 templates, check")
    for scene, temperature in (("hdd_2003", 60), ("mk7702", 20), ("free_shaft", 20))[: 1 if SHORT else 3]:
        numbers[scene] = [m["frequency_Hz"] for m in answer("modes", scene, "--temperature", temperature)["modes"]]
    assert ts.load("five_bearing").bearings
    done.append("shipped scenes by name, modes")
    assert "no scene there" in spindle("modes", "no-such-scene", code=2)
    if not SHORT:
        in_time(numbers, done)
    numbers["rms_pull"] = [answer("compare", "hdd_2003", shipped / "measured" / "jang_2003", "--out", "compared")["rms_pull"]]
    done.append("compare the shipped campaign")
    Path("study.toml").write_text('title = "t"\nkind = "monte-carlo"\nscene = "hdd_2003"\ntemperatures_C = [20]\ndraws = 4\n', encoding="utf-8")
    assert answer("study", "study.toml", "--out", "study")["errors"] == 0
    assert Path("study/results.parquet").is_file()
    assert answer("inspect", "study/study.rrd")["cases"] == 4
    done.append("study, inspect its log")
    code = "import thermospindle.report.workbench.server"
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    done.append("workbench imported")
    if not SHORT:
        diagnosed(shipped, numbers, done)
    return {"where": str(where), "done": done, "numbers": numbers}


def in_time(numbers: dict, done: list) -> None:
    """MuJoCo's time domain, and back from the files of a campaign."""
    answer("simulate", "hdd_2003", "--temperatures", 20, 60, "--hits", 2, "--seed", 1, "--out", "campaign")
    numbers["rms_pull, simulated"] = [answer("compare", "hdd_2003", "campaign", "--out", "simulated")["rms_pull"]]
    assert answer("inspect", next(Path("simulated").glob("*.rrd")))
    done.append("simulate, compare, inspect")


def diagnosed(shipped: Path, numbers: dict, done: list) -> None:
    found = answer("diagnose", "hdd_2003", shipped / "measured" / "jang_2003", "--out", "found")
    numbers["diagnosis"] = [found["error"]["before"]]
    assert list(Path("found").glob("*.html"))
    done.append(f"diagnose the shipped campaign: {found['verdict']}")
    answer("add", "hdd_2003", "bond_softening", "--out", "mine")
    numbers["added"] = [m["frequency_Hz"] for m in answer("modes", "mine", "--temperature", 60)["modes"]]
    done.append("add")


if __name__ == "__main__":
    print(json.dumps(main()))
