"""The reduced model of a flexible shaft beside the whole one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from thermospindle.model.machine import Condition
from thermospindle.model.rotor.chain import Matrices
from thermospindle.model.rotor.modes import modes
from thermospindle.model.rotor.poles import oscillating, poles, poles_below, vectors_below
from thermospindle.model.rotor.reduced import reduced
from thermospindle.model.scene.reading import load
from thermospindle.model.units import HERTZ, RPM
from thermospindle.sim.operating import operating_point

CASES = [
    pytest.param("five_bearing", 0.0, id="five bearings at rest"),
    pytest.param("five_bearing", 12000.0, id="five bearings at 12,000 rpm"),
    pytest.param("mk7702", 0.0, id="mk7702 at rest"),
    pytest.param("mk7702", 12000.0, id="mk7702 at 12,000 rpm"),
    pytest.param("free_shaft", 0.0, id="a shaft that nothing holds"),
]


def _both(scene: str, rpm: float):
    spindle = load(scene)
    point = operating_point(spindle, Condition(30.0, rpm * RPM))
    chain = point.measurement
    rows = np.concatenate([chain.response_rows, chain.reference_rows])
    return spindle, point.linear, chain, reduced(point.linear, rows, HERTZ * spindle.hammer.band[1])


@pytest.mark.parametrize(("scene", "rpm"), CASES)
def test_frfs_of_the_reduced_model_are_off_by_a_hundred_thousandth_of_the_largest(scene: str, rpm: float):
    spindle, whole, chain, small = _both(scene, rpm)
    assert len(small.mass) < len(whole.mass) / 2
    frequency = np.linspace(*spindle.hammer.band, 97)
    s = (2j * np.pi * frequency)[:, None, None]
    exact = chain.response_rows @ np.linalg.solve(s**2 * whole.mass + s * whole.damping + whole.stiffness, chain.reference_rows.T)
    field = np.linalg.solve(s**2 * small.mass + s * small.damping + small.stiffness, (chain.reference_rows @ small.basis).T)
    off = np.abs(chain.response_rows @ small.basis @ field - exact) / np.abs(exact).max(axis=1, keepdims=True)
    assert off.max() < 1.5e-5


@pytest.mark.parametrize(("scene", "rpm"), CASES)
def test_poles_of_the_reduced_model_in_the_band(scene: str, rpm: float):
    spindle, whole, _, small = _both(scene, rpm)
    exact = poles(whole)
    of_small = poles(Matrices(small.mass, small.damping, small.stiffness, ()))
    own = exact.value[oscillating(exact, spindle.hammer.band[1])]
    near = of_small.value[np.abs(of_small.value[None, :] - own[:, None]).argmin(axis=1)]
    assert len(own) >= 4
    np.testing.assert_allclose(np.abs(near), np.abs(own), rtol=3e-5)


@pytest.mark.parametrize(("scene", "rpm"), CASES)
def test_vectors_of_a_coarser_model(scene: str, rpm: float):
    """As many modes as the finer one has, those up to half of the highest asked for to 1e-5; left
    and right vectors belong together, left (2 p M + C) right being one."""
    spindle, whole, _, _ = _both(scene, rpm)
    highest = 2.5 * spindle.hammer.band[1]
    fine, _ = poles_below(whole, highest)
    value, right, left = vectors_below(whole, highest)
    assert len(value) == len(fine)
    half = np.abs(fine) < HERTZ * highest / 2
    np.testing.assert_allclose(value[half], fine[half], rtol=1e-5)
    np.testing.assert_allclose(np.abs(value), np.abs(fine), rtol=1e-4)
    one = np.einsum("kn,nk->k", left, 2 * value * (whole.mass @ right) + whole.damping @ right)
    np.testing.assert_allclose(one[half], 1.0, rtol=1e-4)


def test_a_basis_of_all_modes_is_exact():
    _, whole, chain, _ = _both("five_bearing", 6000.0)
    small = reduced(whole, chain.reference_rows, 1e9)
    assert len(small.mass) == len(whole.mass)
    np.testing.assert_allclose(np.sort_complex(poles(Matrices(small.mass, small.damping, small.stiffness, ())).value.imag).real,
                               np.sort_complex(poles(whole).value.imag).real, rtol=1e-6, atol=1.0)  # fmt: skip


@pytest.mark.parametrize(("scene", "rpm"), CASES)
def test_modes_of_the_band_are_those_of_the_whole_model(scene: str, rpm: float):
    spindle = load(scene)
    point = operating_point(spindle, Condition(30.0, rpm * RPM))
    top = spindle.hammer.band[1]
    few, every = modes(point.chain, highest=top), [m for m in modes(point.chain) if m.frequency <= top]
    assert [(m.kind, m.whirl) for m in few] == [(m.kind, m.whirl) for m in every]
    np.testing.assert_allclose([m.frequency for m in few], [m.frequency for m in every], rtol=5e-9)
    np.testing.assert_allclose([m.damping_ratio for m in few], [m.damping_ratio for m in every], rtol=1e-7)
    for mode in few:  # of a pair at one frequency any combination is a mode
        alike = np.array([m.shape for m in every if abs(m.frequency - mode.frequency) < 1e-6 * mode.frequency]).T
        left = mode.shape - alike @ np.linalg.lstsq(alike, mode.shape, rcond=None)[0]
        assert np.linalg.norm(left) < 1e-4 * np.linalg.norm(mode.shape)
        assert sum(mode.energy.values()) == pytest.approx(1.0)


def test_a_mass_of_nothing_is_refused_in_words():
    """Where a fit takes mass away beyond what is there: no warning of numpy's, and nothing that is not a number."""
    _, whole, chain, _ = _both("mk7702", 0.0)
    mass = whole.mass.copy()
    mass[3, 3] = -1e-6
    with pytest.raises(ValueError, match="a mass of nothing"):
        reduced(replace(whole, mass=mass), chain.response_rows, 1e4)
