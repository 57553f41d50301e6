"""Run by `make growth` with the Python of an environment that has sdypy-EMA (MIT licence): poles of
the same FRFs, and what they took. No test runs it.

    python ema_side.py FRFS.npz       frequency (n,) from 0 Hz, value (responses, n), known (modes,) Hz: it is told where to look

Writes {"seconds": processor time, "frequencies": Hz}.
"""

import json
import sys
import time

import numpy as np


def main() -> None:
    from sdypy.EMA import Model  # type: ignore[import-not-found]

    with np.load(sys.argv[1], allow_pickle=False) as told:
        frequency, value, known = told["frequency"], told["value"], told["known"]
    start = time.process_time()
    model = Model(frf=value, freq=frequency, lower=400, upper=3000, pol_order_high=60, frf_form="mobility")
    model.get_poles(method="lscf", show_progress=False)
    model.select_closest_poles(list(known))
    took = time.process_time() - start
    sys.stdout.write("\n" + json.dumps({"seconds": took, "frequencies": [float(f) for f in model.nat_freq]}) + "\n")


if __name__ == "__main__":
    main()
