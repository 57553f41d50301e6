"""A virtual hammer test in the time domain, and the modes identified from its records, with standard errors."""

import thermospindle as ts

test = ts.impact(ts.point("hdd_2003", 20.0), hits=2)
found = ts.modes(test)
for frequency, sd, damping in zip(found.frequency, found.frequency_sd, found.damping, strict=True):
    print(f"{frequency:8.2f} +- {sd:.2f} Hz, damping {100 * damping:.2f} %")
