"""A laboratory's CSV made into a campaign: what the file does not tell stands in a mapping."""

import tempfile
from pathlib import Path

import numpy as np

import thermospindle as ts
from thermospindle.report.verbs.importing import bring

folder = Path(tempfile.mkdtemp())
frf = ts.frf(ts.point("hdd_2003", 40.0), np.arange(600.0, 2600.0, 2.0), quantity="accelerance")
h = frf["hub_top0", "hub_top0"]
rows = np.c_[frf.frequency, h.real / 9.80665, h.imag / 9.80665]
np.savetxt(folder / "warm.csv", rows, delimiter=",", header="Frequency [Hz],H(1,1) real [g/N],H(1,1) imag [g/N]", comments="")
(folder / "mapping.toml").write_text('[[tests]]\nid = "warm"\ntemperature_C = 40.0\nspeed_rpm = 0.0\n')
bring([folder / "warm.csv"], mapping=folder / "mapping.toml", scene=Path("hdd_2003"), out=folder / "campaign")
print(f"rms error {ts.compare('hdd_2003', folder / 'campaign').rms_residual:.2f} standard errors")
