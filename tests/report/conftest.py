"""Benches and a page of the workbench, which several modules of tests here sit at."""

import signal

import pytest
from bokeh.document import Document

from tests.conftest import SCENE
from tests.report.served import started
from tests.report.workbench_session import CAMPAIGN
from thermospindle.report.workbench import bench as benches
from thermospindle.report.workbench import state
from thermospindle.report.workbench.page import Page
from thermospindle.report.workbench.state import Setting


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
