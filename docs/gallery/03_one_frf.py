"""The exact FRF between two named points, and where it is largest."""

import numpy as np

import thermospindle as ts

frf = ts.frf(ts.point("hdd_2003", 40.0), np.arange(500.0, 3000.0), quantity="accelerance")
driving = frf["hub_top0", "hub_top0"]
largest = np.argmax(abs(driving))
print(f"{abs(driving[largest]):.1f} (m/s2)/N at {frf.frequency[largest]:.0f} Hz")
