"""Natural frequencies of the paper's spindle, cold and hot: the modes that live on the bearings fall."""

import thermospindle as ts

spindle = ts.load("hdd_2003")
cold, hot = (ts.modes(ts.point(spindle, t), highest_Hz=3000) for t in (20, 60))
for a, b in zip(cold, hot, strict=True):
    print(f"{a.kind:8} {a.frequency:7.1f} Hz at 20 C  {b.frequency - a.frequency:+6.1f} Hz to 60 C")
