"""Hammer records in files, made once."""

from __future__ import annotations

import numpy as np
import pytest

from tests.sim.importing.recorded import RATE, hit


@pytest.fixture(scope="session")
def hammered(tmp_path_factory):
    """Six hits on each point, one record a point; of point 1 the second hit is double and the third is clipped."""
    folder = tmp_path_factory.mktemp("records")
    random = np.random.default_rng(3)
    for q in (0, 1):
        forces, answers = [], []
        for k in range(6):
            force, answer = hit(random, doubled=q == 0 and k == 1)
            own = 1e3 * answer[:, q] + 2e-3 * random.standard_normal((2, len(force)))
            if q == 0 and k == 2:
                own[1] = np.clip(own[1], -0.6 * own[1].max(), 0.6 * own[1].max())
            forces.append(force + 0.01 * random.standard_normal(len(force)))
            answers.append(own)
        force, answer = np.concatenate(forces), np.concatenate(answers, axis=1)
        head = f"Time [s],force {q + 1} [N],velocity 1 [mm/s],velocity 2 [mm/s]"
        np.savetxt(folder / f"hammer{q + 1}.csv", np.c_[np.arange(len(force)) / RATE, force, answer.T], delimiter=",", header=head, comments="", fmt="%.9g")
    return folder
