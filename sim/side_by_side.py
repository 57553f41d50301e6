"""MuJoCo models stepped side by side in C, as many at a time as there are cores, each in data of its own.

`mujoco.rollout` shares data between models of one size only, and does not check it: the same spindle at another temperature
may have an entry more in a tendon, where rounding has left no exact zero, and then writes past the end of data made for its
neighbour. A thread a model, each with its own data, costs nothing beside that: the stepping leaves Python's lock alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType

import mujoco
import numpy as np
from mujoco.rollout import Rollout

from thermospindle.model.errors import NotConverged
from thermospindle.model.parallel import cores
from thermospindle.model.types import Array

UNBOUNDED = (mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQVEL, mujoco.mjtWarning.mjWARN_BADQACC)


class SideBySide:
    """Models that are run piece by piece, from where the last piece ended; a context manager, which ends its threads."""

    def __init__(self, models: Sequence[mujoco.MjModel]) -> None:
        self.models = list(models)
        self.data = [mujoco.MjData(model) for model in self.models]
        self.threads = ThreadPoolExecutor(min(cores(), len(self.models)))

    def __enter__(self) -> SideBySide:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.threads.shutdown(cancel_futures=True)

    def step(self, start: Array, control: Array, spec: mujoco.mjtState = mujoco.mjtState.mjSTATE_CTRL) -> tuple[Array, Array]:
        """States (models, steps, nstate) and sensors (models, steps, nsensordata) after each step.

        `start` (models, nstate) are MuJoCo's full physics states, `control` (models, steps, n) is held over each step: what `spec`
        says it is. NotConverged where a motion grew beyond all bounds: MuJoCo itself would set such a model back to rest and go on.
        """

        def run(k: int) -> tuple[Array, Array]:
            with Rollout(nthread=0) as here:
                states, sensors = here.rollout(self.models[k], self.data[k], start[k : k + 1], control[k : k + 1], control_spec=int(spec))
            return states[0], sensors[0]

        found = list(self.threads.map(run, range(len(self.models))))
        for model, data in zip(self.models, self.data, strict=True):
            if any(data.warning[kind].number for kind in UNBOUNDED):
                raise NotConverged(
                    f"a motion grew beyond all bounds in steps of {1e6 * model.opt.timestep:.3g} us; a shorter hammer_test.step_us may hold it, or a "
                    "lighter hit where bearings are taken ball by ball"
                )
        return np.array([states for states, _ in found]), np.array([sensors for _, sensors in found])
