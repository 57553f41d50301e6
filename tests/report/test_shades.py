"""Colours of the workbench's map of errors: those of the figures, and on a dark page as easy to read."""

import re

import numpy as np
import pytest
from matplotlib import colormaps

from tests.conftest import ROOT
from thermospindle.report.figures.common import residual_norm
from thermospindle.report.workbench.shades import DARK, INK, PAPER, place, shades

VALUES = [-400.0, -31.0, -8.0, -3.0, -1.2, 0.0, 0.3, 2.9, 3.1, 12.0, 55.0, 400.0]


def rgb(colour: str) -> np.ndarray:
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255


def luminance(colour: str) -> float:
    """Relative, of WCAG 2.2."""
    c = rgb(colour)
    return float((0.2126, 0.7152, 0.0722) @ np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4))


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("largest", [4.0, 30.0, 400.0])
@pytest.mark.parametrize("value", VALUES)
def test_the_scale_is_that_of_the_figures(value: float, largest: float) -> None:
    norm = residual_norm(largest)
    assert (place(value, largest) + 1) / 2 == pytest.approx(float(norm(value)), abs=1e-12)
    if abs(value) <= max(30.0, largest):
        assert rgb(shades(value, largest)[0]) == pytest.approx(np.array(colormaps["RdBu_r"](norm(value))[:3]), abs=0.02)


def test_nothing_is_the_ground_of_its_page() -> None:
    light, ink, dark, dark_ink = shades(0.0, 30.0)
    assert (ink, dark_ink) == (INK, PAPER)
    assert rgb(light).min() > 0.96
    assert np.abs(rgb(dark) - rgb(DARK)).max() < 0.04


@pytest.mark.parametrize("value", np.linspace(-60, 60, 41))
def test_numbers_can_be_read_on_both_pages(value: float) -> None:
    light, ink, dark, dark_ink = shades(value, 60.0)
    assert contrast(light, ink) > 4.0
    assert contrast(dark, dark_ink) > 4.0
    assert contrast(light, ink) == max(contrast(light, other) for other in (INK, PAPER))
    assert contrast(dark, dark_ink) == max(contrast(dark, other) for other in (INK, PAPER))


def test_what_is_large_stands_out_and_keeps_its_hue() -> None:
    for sign in (-1, 1):
        steps = [contrast(shades(sign * v, 60.0)[2], DARK) for v in (0.0, 1.0, 3.0, 10.0, 30.0, 60.0)]
        assert steps == sorted(steps)
        for v in (3.0, 30.0):
            light, _, dark, _ = shades(sign * v, 60.0)
            assert np.argmax(rgb(light)) == np.argmax(rgb(dark)) == (0 if sign > 0 else 2)


def test_the_grounds_are_those_of_the_pages() -> None:
    for page in ("workbench/page.html.j2", "page/report.html.j2"):
        text = (ROOT / "report" / page).read_text(encoding="utf-8")
        [night] = re.findall(r"prefers-color-scheme: dark\) \{\s*:root \{([^}]*)\}", text)
        assert f"--paper: {DARK}" in night
