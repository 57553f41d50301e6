"""Influence over temperature from a reduced basis: against whole solutions, at a fraction of their cost, in a cache that ends."""

import os
from dataclasses import replace

import numpy as np
import pytest

from thermospindle.model.files import kept
from thermospindle.model.material import Law
from thermospindle.thermal import influence as module
from thermospindle.thermal.elastic import Solid
from thermospindle.thermal.expansion import expand
from thermospindle.thermal.influence import elasticity, gains, influence
from thermospindle.thermal.refine import largest_motion

ROUGH = 1e-2  # of the mesh: the space is compared with solutions on its own mesh, so a coarse one serves


@pytest.fixture(scope="module")
def softening(spindle):
    """Aluminium that loses a tenth of its modulus, steel a fifteenth."""
    laws = {"aluminium": Law((-20.0, 20.0, 150.0), (71.4e9, 70e9, 63e9)), "steel": Law((-50.0, 20.0, 200.0), (211e9, 208e9, 195e9))}
    changed = {name: replace(spindle.materials[name], youngs_modulus=law) for name, law in laws.items()}
    return replace(spindle, materials={**spindle.materials, **changed})


@pytest.mark.parametrize("apart", [0.0, 60.0], ids=["uniform", "a region each"])
@pytest.mark.parametrize("part", ["stationary", "rotating"])
def test_against_whole_solutions(softening, part, apart):
    """1e-5 of the largest motion or better, where the moduli change it by 2e-4 at least; pictures, whose error is of first order, 1e-4."""
    random = np.random.default_rng(4)
    means = {g.name: 47.3 + apart * random.uniform(-1, 1) for g in softening.regions}
    found = influence(softening, ROUGH, means).responses[part]
    whole, _ = Solid(found.section, elasticity(softening, means)).respond(found.races)
    cold = influence(softening, ROUGH).responses[part]
    scale = largest_motion(whole.gain)
    assert largest_motion(found.gain - whole.gain) < 1e-5 * scale
    assert largest_motion(cold.gain - whole.gain) > 2e-4 * scale
    height = found.section.mesh.p[1][found.section.mesh.t].mean(axis=0)  # a strain that rises along the axis, in every region
    uneven = [np.einsum("ieq,e->i", r.density, height / height.max()) for r in (found, whole)]
    assert np.abs(uneven[0] - uneven[1]).max() < 1e-5 * scale
    assert np.abs(found.shape - whole.shape).max() < 1e-4 * np.abs(whole.shape).max()
    assert np.abs(found.stiffening - whole.stiffening).max() < 1e-4 * np.abs(whole.stiffening).max()
    quick = next(g for g in gains(softening, ROUGH, means) if g.races == found.races)
    assert quick.value == pytest.approx(found.gain, rel=1e-12, abs=1e-12 * scale)


def test_a_new_temperature_solves_nothing(softening, monkeypatch):
    """No finite elements, nothing on disk: temperature by temperature for nothing."""
    expand(softening, 60.0, ROUGH)
    before = set(kept.folder().iterdir())
    monkeypatch.setattr(Solid, "_solve", lambda self, loads: pytest.fail("a whole solution"))
    motions = [expand(softening, t, ROUGH)["upper"].outer_z for t in np.linspace(21.0, 59.0, 20)]
    assert np.all(np.diff(motions) > 0)
    assert set(kept.folder().iterdir()) == before


def test_kept_on_disk(softening, monkeypatch):
    first = expand(softening, 50.0, ROUGH)
    module._space.cache_clear()
    monkeypatch.setattr(module, "reduced", lambda *_: pytest.fail("made again"))
    assert expand(softening, 50.0, ROUGH) == first
    cold, warm = (influence(softening, ROUGH, t).sections for t in (None, dict.fromkeys((g.name for g in softening.regions), 50.0)))
    assert all(cold[part].mesh is warm[part].mesh for part in cold)  # by which nodal temperatures are read without looking for points: 16 s a part


def test_the_cache_ends(tmp_path, monkeypatch):
    """The files that were not asked for longest go first."""
    monkeypatch.setattr(kept, "MOST_BYTES", 2500)
    for k in range(4):
        file = tmp_path / f"influence-{k}.npz"
        file.write_bytes(b"x" * 1000)
        os.utime(file, (k, k))
    os.utime(tmp_path / "influence-0.npz", (9, 9))  # read just now
    (tmp_path / "other.txt").write_bytes(b"x" * 9000)
    kept._make_room(tmp_path)
    assert sorted(f.name for f in tmp_path.iterdir()) == ["influence-0.npz", "influence-3.npz", "other.txt"]
