"""What several modules of tests here look at: a diagnosis and its answer, a comparison, benches and a page of the workbench."""

import signal
from dataclasses import replace

import numpy as np
import pytest
from bokeh.document import Document

from tests.conftest import SCENE
from tests.report.served import started
from tests.report.workbench_session import CAMPAIGN
from thermospindle.diagnosis.compare.compare import compare
from thermospindle.diagnosis.decision.explanations import Candidate
from thermospindle.diagnosis.inference.evidence import evidence
from thermospindle.diagnosis.inference.fit import fit
from thermospindle.diagnosis.inference.hypothesis import Hypothesis
from thermospindle.diagnosis.parameters.mechanism import variants
from thermospindle.diagnosis.prediction.next_test import ModePrediction, NextTest
from thermospindle.model.machine import Condition
from thermospindle.model.units import RPM
from thermospindle.report.page.compare import write_comparison
from thermospindle.report.text.diagnosis.answer import diagnosis_json
from thermospindle.report.workbench import bench as benches
from thermospindle.report.workbench import state
from thermospindle.report.workbench.page import Page
from thermospindle.report.workbench.state import Setting
from thermospindle.sim.campaign.campaign import Campaign, Noise, Test
from thermospindle.sim.effects import by_name
from thermospindle.sim.identification.frf import Frf
from thermospindle.sim.operating import operating_point
from thermospindle.sim.running.runout import runout
from thermospindle.sim.running.waterfall import run_up, waterfall

LINES = np.arange(400.0, 6000.0, 4.0)
SPEED = 7200 * RPM


@pytest.fixture(scope="session")
def told(nothing_missing):
    """A diagnosis as if a hub that lags had been taken for its explanation, and its answer."""
    search, (lag, *_) = nothing_missing.search, variants(by_name("soak_lag"))
    base = search.base
    start = np.concatenate([base.fit.point, np.zeros(len(search.model.tests) + len(lag.shape))])
    fitted = fit(search.model, [lag], start, base.fit.rates, (1.0,))
    hypothesis = Hypothesis(fitted, evidence(search.model, fitted))
    best = Candidate(hypothesis, ("soak_lag",), False, hypothesis.evidence.ln - base.evidence.ln, 0.9)
    one, other = (ModePrediction(*row) for row in ((1000.0, 0.5, 0.01), (1010.0, 0.5, 0.01)))
    test = NextTest(Condition(70.0), ("soak_lag", "<free>"), 1e6, 1, "the mode near 1000 Hz, which differs by 10.0 Hz", ((one,), (other,)))
    verdict = replace(nothing_missing.verdict, word="identified", effects=("soak_lag",), candidates=(best,), accepted=hypothesis)
    found = replace(nothing_missing, verdict=verdict, tests=(test,))
    return found, diagnosis_json(found) | {"campaign": "lag & <haste>"}


@pytest.fixture(scope="session")
def low(spindle):
    """The model's own FRFs with every frequency 1 % low, cold and hot."""
    tests = []
    for t, speed in ((20.0, 0.0), (60.0, 754.0)):
        value = operating_point(spindle, Condition(t, speed)).frf(LINES * 1.01)
        sd = 0.003 * np.abs(value) + 2e-4 * np.abs(value).max()
        error = sd * np.random.default_rng(1).standard_normal((2, *value.shape)) / np.sqrt(2)
        frf = Frf(LINES, value + error[0] + 1j * error[1], tuple(p.node for p in spindle.points), (1, 2), "mobility", sd=sd)
        tests.append(Test(f"T{t:g}", t, speed, frf=frf))
    return Campaign("1 % low & <slow>", spindle.name, "mobility", spindle.points, tuple(tests), Noise(0.003, 2e-4))


@pytest.fixture(scope="session")
def compared(spindle, low):
    return compare(spindle, low)


@pytest.fixture(scope="session")
def compared_folder(spindle, compared, tmp_path_factory):
    path = tmp_path_factory.mktemp("comparison")
    write_comparison(compared, spindle, path, name="campA")
    return path


@pytest.fixture(scope="session")
def quiet(spindle, low):
    """The same tests below their lowest mode."""
    below = LINES < 515.0
    tests = [replace(t, frf=replace(t.frf, frequency=LINES[below], value=t.frf.value[..., below], sd=t.frf.sd[..., below])) for t in low.tests]
    return compare(spindle, replace(low, tests=tuple(tests)))


@pytest.fixture(scope="module")
def bench():
    return benches.open_bench(SCENE, CAMPAIGN)


@pytest.fixture(scope="module")
def alone():
    return benches.open_bench(SCENE)


@pytest.fixture
def page(bench, tmp_path):
    return Page(bench, Document(), tmp_path / "saved")


@pytest.fixture(scope="module")
def changed(bench):
    """A setting off in an effect and a tolerance, with one test left out."""
    s = state.add_effect(Setting(), bench.effect("preload_loss"), {"loss": 0.1})
    return state.leave_out(state.set_deviation(s, "hub mass", 0.004), ["T60_n0"])


@pytest.fixture(scope="session")
def served(tmp_path_factory):
    """What a workbench of the paper's table of modes, in a process of its own, printed when it began."""
    process, told = started(tmp_path_factory.mktemp("served"), SCENE, SCENE / "measured" / "jang_2003")
    yield told
    process.send_signal(signal.SIGINT)
    rest, _ = process.communicate(timeout=20)
    assert process.returncode == 0
    assert rest == "", "one JSON object and nothing else"


@pytest.fixture(scope="session")
def record(spindle):
    """The reference spindle as it runs out at its service speed."""
    return runout(operating_point(spindle, Condition(40.0, SPEED)), 0.25, path="linear")


@pytest.fixture(scope="session")
def spectra(spindle):
    """Its lines over speed."""
    return waterfall(spindle, 40.0, run_up(SPEED))
