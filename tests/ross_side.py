"""Run by `make bench` with the Python of an environment that has ROSS (petrobras/ross, Apache-2.0):
the same rotor, its frequencies, FRF and times.

Reads {"lengths": m, "outer": m, "bore": m, "youngs_modulus", "poisson", "density", "bearings": [[node,
N/m]], "speeds": rad/s, "frequencies": Hz} and writes {"import_s", "build_s", "modes_s", "modes_cpu_s" (of a
second time), "modes": Hz by speed, "frf": [real, imaginary] at node 0 along x by speed}. No test runs it.
"""

import json
import sys
import time

import numpy as np


def main() -> None:
    asked = json.loads(sys.stdin.read())
    start = time.perf_counter()
    import ross  # type: ignore[import-not-found]

    imported = time.perf_counter()
    e, nu = asked["youngs_modulus"], asked["poisson"]
    steel = ross.Material(name="shaft", rho=asked["density"], E=e, G_s=e / (2 * (1 + nu)))
    shaft = [
        ross.ShaftElement(L=length, idl=bore, odl=outer, material=steel, shear_effects=True, rotary_inertia=True, gyroscopic=True)
        for length, outer, bore in zip(asked["lengths"], asked["outer"], asked["bore"], strict=True)
    ]
    bearings = [ross.BearingElement(n=node, kxx=k, kyy=k, cxx=0.0, cyy=0.0) for node, k in asked["bearings"]]
    rotor = ross.Rotor(shaft, [], bearings)
    built = time.perf_counter()
    found = [sorted(float(f) for f in rotor.run_modal(speed, num_modes=28).wn / (2 * np.pi)) for speed in asked["speeds"]]
    done, busy = time.perf_counter(), time.process_time()
    for speed in asked["speeds"]:  # all is loaded now; other speeds, as ROSS remembers what it was asked
        rotor.run_modal(speed + 1.0, num_modes=28)
    busy = time.process_time() - busy
    frf = []
    for speed in asked["speeds"]:
        m, k, c, g = rotor.M(0.0), rotor.K(0.0), rotor.C(0.0), rotor.G()
        omega = 2 * np.pi * np.array(asked["frequencies"])[:, None, None]
        dynamic = k - omega**2 * m + 1j * omega * (c + speed * g)
        force = np.zeros(len(m))
        force[0] = 1.0
        own = np.linalg.solve(dynamic, np.broadcast_to(force, (len(omega), len(m)))[..., None])[:, 0, 0]
        frf.append([own.real.tolist(), own.imag.tolist()])
    sys.stdout.write(json.dumps({"import_s": imported - start, "build_s": built - imported, "modes_s": done - built, "modes_cpu_s": busy, "modes": found, "frf": frf, "version": ross.__version__}))


if __name__ == "__main__":
    main()
