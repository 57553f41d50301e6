"""A turning spindle: the rocking pair splits into forward and backward whirl."""

import thermospindle as ts

for speed in (0, 3600, 7200, 15000):
    rocking = [m for m in ts.modes(ts.point("hdd_2003", 20, speed_rpm=speed), highest_Hz=2500) if m.kind == "rocking"]
    print(f"{speed:6} rpm:", ", ".join(f"{m.frequency:.1f} Hz {m.whirl}" for m in rocking))
