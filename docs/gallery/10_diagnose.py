"""Which effect is missing: a virtual campaign of a spindle with a softening bond, asked of two effects of the catalogue."""

import tempfile
from pathlib import Path

import thermospindle as ts
from thermospindle.report.verbs.chain import simulate

spindle = ts.load("hdd_2003")
tests = Path(tempfile.mkdtemp()) / "tests"
simulate(Path("hdd_2003"), temperatures=[20, 40, 60], out=tests)
found = ts.diagnose(spindle, tests, effects=["soak_lag", "channel_delay"])
print("missing:", found.verdict.word)
for candidate in ts.answer(found)["candidates"]:  # sizes and standard errors in plain numbers, as `spindle diagnose --json`
    print(candidate["effects"], f"{candidate['probability']:.3f}")
