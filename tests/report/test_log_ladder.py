"""Pictures of a ladder's log from plain numbers: steps are named, numbers are plain, no panel is left empty."""

from __future__ import annotations

import numpy as np
import pytest

from thermospindle.report.log.ladder import ShownLadder, ShownStep, Track, errors, residuals, responses

WARM = np.array([20.0, 60.0])


@pytest.fixture(scope="module")
def content() -> ShownLadder:
    steps = tuple(
        ShownStep(name, (name, "", "", ""), error, 1.1 * error, np.array([[error, -error], [1.0, np.nan]]), (),
                  tuple(Track(f"{k} axial", WARM, 10 * WARM, 10 * WARM + error) for k in range(5)))
        for name, error in (("fixed stiffness", 45.0), ("as drawn: tolerances fitted", 1.2))
    )  # fmt: skip
    return ShownLadder({}, "made up", ("1 axial", "2 rocking"), ("20 °C, 0 rpm", "60 °C, 0 rpm"), "dB", steps, 1, (), (), "temperatures")


def test_the_error_axis_names_its_steps_and_has_plain_numbers(content):
    figure = errors(content, 0)
    figure.canvas.draw()
    axes = figure.axes[0]
    assert [t.get_text().replace("\n", " ") for t in axes.get_xticklabels()] == ["fixed stiffness", "as drawn: tolerances fitted"]
    assert {"1", "2", "5", "10", "20", "50"} <= {t.get_text() for t in axes.get_yticklabels()}


def test_every_mode_has_a_panel_with_the_same_axes_on_every_step(content):
    first, last = (responses(content, step) for step in content.steps)
    assert [a.axison for a in first.axes] == [True] * 5 + [False]
    assert [a.get_ylim() for a in first.axes[:5]] == [a.get_ylim() for a in last.axes[:5]]


def test_residuals_stand_in_their_cells(content):
    texts = [t.get_text() for t in residuals(content, content.steps[0]).axes[0].texts]
    assert texts == ["+45", "−45", "+1.0"]
