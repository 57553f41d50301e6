"""Which effect is missing: a virtual campaign of a spindle with a softening bond, asked of two effects of the catalogue."""

import tempfile
from pathlib import Path

import thermospindle as ts
from thermospindle.report.verbs.catalogue import add
from thermospindle.report.verbs.chain import simulate

folder = Path(tempfile.mkdtemp())
add(Path("hdd_2003"), ["bond_softening"], out=folder / "hidden")
simulate(folder / "hidden", temperatures=[20, 40, 60], out=folder / "tests")
found = ts.diagnose("hdd_2003", folder / "tests", effects=["bond_softening", "channel_delay"])
print("missing:", found.verdict.word)
for candidate in ts.answer(found)["candidates"]:  # sizes and standard errors in plain numbers, as `spindle diagnose --json`
    print(candidate["effects"], f"{candidate['probability']:.3f}")
