"""Benches and a page of the workbench, which several modules of tests here sit at."""


import pytest
from bokeh.document import Document

from tests.conftest import SCENE
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
