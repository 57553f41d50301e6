"""Which element each mode bends: what has to change for the mode to move."""

import thermospindle as ts

for mode in ts.modes(ts.point("hdd_2003", 20), highest_Hz=6000):
    most = sorted(mode.energy.items(), key=lambda e: -e[1])[:2]
    print(f"{mode.frequency:7.1f} Hz {mode.kind:8}", ", ".join(f"{name} {share:.0%}" for name, share in most))
