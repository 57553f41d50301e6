"""Fixtures that every test may use."""

from __future__ import annotations

import gc
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does, before numpy loads
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("LOKY_MAX_CPU_COUNT", "1")  # pytest's own workers take the cores: each does its work by itself

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import pytest

if TYPE_CHECKING:  # the process that hands tests out to others loads this file too, and needs none of it
    from thermospindle.diagnosis.verdict import Diagnosis
    from thermospindle.model.machine import Spindle
    from thermospindle.sim.run import Run

ROOT = Path(__file__).parents[1]
SCENE = ROOT / "scenes" / "hdd_2003"
DATA = ROOT / "tests" / "data"
Made = TypeVar("Made")


def pytest_collection_finish() -> None:
    """What is there by now (libraries, thousands of tests) stays to the end and is not looked through again and again for what may go."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(50_000, 20, 20)


@pytest.fixture(scope="session")
def spindle() -> Spindle:
    from thermospindle.model.scene.reading import load

    return load(SCENE)


@pytest.fixture(scope="session")
def stiffly_mounted(spindle) -> Spindle:
    """On a mount of eight times its stiffness, by which an axial mode at 4165 Hz stays while two
    lateral ones of 4497 and 4499 Hz at 20 C fall below it, to 3565 and 3566 Hz at 100 C."""
    mount, *others = spindle.structure.joints
    stiff = replace(mount, stiffness=tuple(8 * k for k in mount.stiffness))
    return replace(spindle, structure=replace(spindle.structure, joints=(stiff, *others)))


@pytest.fixture(scope="session")
def imperfect(spindle) -> Spindle:
    """With imperfections drawn from seed 3."""
    from thermospindle.model.built.drawn import drawn

    return replace(spindle, imperfections=drawn(spindle, 3))


@pytest.fixture(scope="session")
def cold(spindle):
    """Both bearings at the reference temperature, at rest."""
    from thermospindle.model.bearing.pair import solve
    from thermospindle.model.bearing.row import reference_motion
    from thermospindle.model.machine import Condition

    return solve(spindle, Condition(20.0), {b.name: reference_motion(20.0) for b in spindle.bearings})


@pytest.fixture(scope="session")
def hot(spindle):
    """Both bearings at 60 C, at rest."""
    from thermospindle.model.bearing.pair import solve
    from thermospindle.model.machine import Condition
    from thermospindle.thermal.expansion import expand

    return solve(spindle, Condition(60.0), expand(spindle, 60.0))


@pytest.fixture(scope="session")
def run(spindle, tmp_path_factory) -> Run:
    """Two short tests and the scene's own measurement."""
    from tests.small_run import small_run
    from thermospindle.sim.run import measured_campaigns

    return made_once(tmp_path_factory, "run", lambda: small_run(spindle, (20.0, 60.0), measured_campaigns(spindle)))


@pytest.fixture(scope="session")
def nothing_missing(spindle, tmp_path_factory) -> Diagnosis:
    """The diagnosis of three tests of another program's campaign with nothing hidden, beside two effects."""
    from thermospindle.diagnosis.verdict import diagnose
    from thermospindle.sim.campaign.campaign import read_campaign
    from thermospindle.sim.effects import by_name

    effects = tuple(by_name(n) for n in ("soak_lag", "channel_delay"))
    campaign = read_campaign(DATA / "foreign_none")
    campaign = replace(campaign, tests=tuple(t for t in campaign.tests if t.id in ("T20_n0", "T40_n0", "T60_n7200")))
    return made_once(tmp_path_factory, "nothing_missing", lambda: diagnose(spindle, campaign, effects))


@contextmanager
def coarse_warmups() -> Iterator[None]:
    """Warm-ups on meshes of few elements, for what holds on any."""
    from thermospindle.sim import warmup
    from thermospindle.thermal import readout
    from thermospindle.thermal.expansion import influence

    with pytest.MonkeyPatch.context() as patch:
        for module in (warmup, readout):
            patch.setattr(module, "influence", lambda spindle, temperatures=None: influence(spindle, 2e-2, temperatures))
        yield


@pytest.fixture
def undrawn(monkeypatch):
    """Studies without their figures, for tests of their numbers; others have them drawn."""
    for kind in ("monte_carlo", "sweep"):
        monkeypatch.setattr(f"thermospindle.report.figures.study.{kind}", lambda *_: {})


def made_once(folders: pytest.TempPathFactory, name: str, make: Callable[[], Made]) -> Made:
    """What one of pytest's workers has made already, or what `make` makes, left on disk for the others."""
    import cloudpickle

    if "PYTEST_XDIST_WORKER" not in os.environ:
        return make()
    file = folders.getbasetemp().parent / f"{name}.pickle"
    if file.exists():
        return cloudpickle.loads(file.read_bytes())
    made = make()
    own = file.with_suffix(f".{os.getpid()}")
    own.write_bytes(cloudpickle.dumps(made))
    own.replace(file)
    return made
