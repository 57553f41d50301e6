"""The Hessian of ball springs against second differences of their energy, of rings that turn as MuJoCo's hinges do."""

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.model.test_loaded import under
from thermospindle.model.bearing.ball_row import respond
from thermospindle.model.bearing.springs import BallSprings, ball_springs, tangent
from thermospindle.model.rotor import mjcf
from thermospindle.model.rotor.chain import matrices, rotor_base

CENTRES = (3e-3, -4e-3)  # m, of the inner and of the outer body


def turned(points, centre, motion):
    """Points of a body moved by (x, y, z, tilt_x, tilt_y) about the axis point at `centre`."""
    about = np.array([0.0, 0.0, centre])
    return (points - about) @ Rotation.from_euler("XY", motion[3:]).as_matrix().T + about + motion[:3]


def energy(springs, motion):
    a, b, c = springs.polynomial.T
    ends = [turned(points, centre, part) for points, centre, part in zip((springs.inner, springs.outer), CENTRES, np.split(motion, 2), strict=True)]
    s = np.linalg.norm(ends[1] - ends[0], axis=1) - springs.rest
    return np.sum(a * s**2 / 2 + b * s**3 / 3 + c * s**4 / 4)


def test_tangent_of_three_balls_that_share_no_symmetry():
    """Around a whole row what a ball adds between tilts about x and y cancels: three balls on one side show it. They are
    stretched far enough for their tension to count."""
    random = np.random.default_rng(1)
    angle = np.array([0.3, 0.9, 1.7])
    circle = np.stack([4e-3 * np.cos(angle), 4e-3 * np.sin(angle), np.zeros(3)], axis=1)
    springs = BallSprings(circle, circle + 4e-4 * random.standard_normal((3, 3)) + [5e-4, 5e-4, 3e-4], 5e-4, np.tile([2e6, 3e9, -1e12], (3, 1)))
    assert np.linalg.norm(springs.outer - springs.inner, axis=1).min() > 5e-4
    h = np.diag([1e-6, 1e-6, 1e-6, 2e-4, 2e-4] * 2)

    def second(i, j):
        return sum(s * t * energy(springs, s * h[i] + t * h[j]) for s in (1, -1) for t in (1, -1)) / (4 * h[i, i] * h[j, j])

    expected = np.array([[second(i, j) for j in range(10)] for i in range(10)])
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert tangent(springs, *CENTRES) / scale == pytest.approx(expected / scale, abs=1e-4)


@pytest.mark.parametrize("newton", [5.0, 70.0], ids=["all pressed", "some loose"])
def test_springs_of_displaced_rings_bear_the_load_and_linearise_to_their_stiffness(spindle, newton):
    """Forces of the springs as they stand are those of the row; MuJoCo's model, held by dead loads, has the row's tangent."""
    pushed, state = under(spindle, (newton, 0.3 * newton), 0.008)
    for b in state.bearings:
        springs, answer = ball_springs(b), respond(b.row, np.array(b.displacement))
        line = springs.outer - springs.inner
        length = np.linalg.norm(line, axis=1)
        x = np.maximum(length - springs.rest, 0.0)
        force = (springs.polynomial * np.stack([x, x**2, x**3], axis=1)).sum(axis=1)
        assert force == pytest.approx(answer.ball_force, rel=1e-9, abs=0.02 * answer.ball_force.max())
        if newton == 5.0:
            assert (force / length) @ line == pytest.approx(answer.force[:3], rel=1e-8)
        else:
            assert (force == 0.0).any() or b.name == "upper"
    chain = rotor_base(pushed, state)
    model = mjcf.spec(pushed, state, "ball-by-ball").compile()
    own, found = matrices(chain), mjcf.linearise(model)
    scale = np.sqrt(np.outer(np.diag(own.stiffness), np.diag(own.stiffness)))
    assert np.abs((found.stiffness - own.stiffness) / scale).max() < 1e-6
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("loaded").id)
    mujoco.mj_forward(model, data)
    assert np.abs(data.qacc[: model.nv]).max() < 1e-6  # it stands where it is
