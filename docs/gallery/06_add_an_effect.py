"""A physical effect of the catalogue: a bearing that has lost a third of its preload, and what one would see."""

import thermospindle as ts

spindle = ts.load("hdd_2003")
worn = ts.add(spindle, "preload_loss", loss=0.3)
for a, b in zip(*(ts.modes(ts.point(s, 20), highest_Hz=3000) for s in (spindle, worn)), strict=True):
    print(f"{a.kind:8} {a.frequency:7.1f} -> {b.frequency:7.1f} Hz")
