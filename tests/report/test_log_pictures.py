"""Pictures of a Rerun log: dark with their hues kept, keys and small charts that hold all there is."""

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure

from thermospindle.report.figures import run as figures
from thermospindle.report.log import content as log_content
from thermospindle.report.log import pictures


def test_pictures_are_dark_with_their_hues_kept() -> None:
    """White paper becomes the viewer's ground, black ink white, a red stays red; a place on the axes is where the picture has it."""
    figure = Figure(figsize=(2.0, 1.0))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0, 2), ylim=(0, 1))
    axes.set_axis_off()
    axes.fill_between([0.0, 0.5], 0.0, 0.5, color="black", lw=0)
    axes.fill_between([1.0, 2.0], 0.5, 1.0, color="#c01010", lw=0)
    seen = pictures.pixels(figure)
    assert seen.shape == (pictures.DOTS, 2 * pictures.DOTS, 3)

    def at(x: float, y: float) -> tuple[int, ...]:
        across, down = pictures.place(axes, [x], [y])[0].astype(int)
        return tuple(seen[down, across].tolist())

    assert at(0.75, 0.75) == pictures.DARK
    assert at(0.25, 0.25) == (255, 255, 255)
    red = at(1.5, 0.75)
    assert red[0] > 200 > 100 > red[1]
    assert abs(red[1] - red[2]) < 4  # the ground is a little blue
    wanted = (90, 200, 255)
    assert np.array(pictures.for_dark(wanted)) * 255 == pytest.approx(np.array(wanted) + 255 - 255 - 90)


def test_key_and_small_charts_hold_all_there_is() -> None:
    """Every temperature and source in the key, close modes under one label; a chart for every quantity, with its own curves."""
    made = figures.key([("20 °C", "k"), ("60 °C", "r")], [("measured 60 °C", "g", "^")], [1000.0, 1790.0, 1820.0], (400.0, 3000.0), (6, 1))
    assert [t.get_text() for t in made.legends[0].get_texts()] == ["20 °C", "60 °C", "measured 60 °C"]
    assert [t.get_text() for t in made.axes[0].texts] == ["mode 1", "2 3"]
    many = figures.key([("20 °C", "k")], [], [486.0, 543.0, 621.0, 640.0, 743.0, 1363.0, 1498.0, 1514.0], (400.0, 3000.0), (6, 1))
    many.canvas.draw()
    boxes = [t.get_window_extent() for t in many.axes[0].texts]
    assert all(a.x1 < b.x0 for a, b in pairwise(boxes))
    made.canvas.draw()
    box = made.legends[0].get_window_extent()
    assert box.x0 >= 0
    assert box.x1 <= made.bbox.width
    x = np.array([20.0, 60.0])
    made = figures.panels({f"q{k}": [(x, k * x, "k"), (x, x, "r")] for k in range(4)}, 3, (4, 3), "°C", {"front": "k", "rear": "r"})
    assert [t.get_text() for t in made.legends[0].get_texts()] == ["front", "rear"]
    assert [len(a.lines) for a in made.axes] == [2, 2, 2, 2, 0, 0]
    assert [a.get_xlabel() for a in made.axes] == ["", "°C", "°C", "°C", "", ""]


@pytest.mark.parametrize(("highest", "top"), [(-20.4, -10.0), (-23.5, -20.0), (-29.9, -20.0)])
def test_the_highest_peak_has_room_for_its_mark(highest, top):
    assert log_content.level_ends(np.linspace(-58.0, highest, 1000)) == (-65.0, top)
