"""The frequencies that the paper measured beside the model: errors in Hz and in standard errors."""

from pathlib import Path

import thermospindle as ts

spindle = ts.load("hdd_2003")
found = ts.compare(spindle, Path(spindle.file).parent / "measured" / "jang_2003")
print(f"rms error {found.rms_residual:.1f} standard errors")
for test in found.tests:
    for mode in test.modes:
        print(f"{test.test.temperature:.0f} C {mode.kind:8} {mode.measured:7.1f} measured, {mode.computed - mode.measured:+6.1f} Hz computed")
