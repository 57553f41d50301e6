"""Figures of matplotlib as pictures in a log: turned dark like the viewer, and places in them for what moves over them."""

from __future__ import annotations

import io
from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imsave
from numpy.typing import NDArray

from thermospindle.model.types import Array
from thermospindle.report.figures.common import DRAWN, laid_out
from thermospindle.report.log.views import DARK

DOTS = 180  # per inch: of a figure that is an inch for every 90 points of its view, sharp where a point has two dots

Pixels = NDArray[np.uint8]


def pixels(figure: Figure) -> Pixels:
    """The figure (height, width, 3) with light and dark exchanged and hues kept: white becomes `DARK`."""
    with rc_context(DRAWN):
        figure.set_dpi(DOTS)
        figure.patch.set_facecolor("white")
        canvas = FigureCanvasAgg(laid_out(figure))
        canvas.draw()
    light = np.asarray(canvas.buffer_rgba())[..., :3]
    # in HSL, lightness l = (max + min) / 2 becomes 1 - l when every channel moves by 1 - 2 l: by 255 - max - min, and none leaves its byte
    red, green, blue = (light[..., k] for k in range(3))
    largest, smallest = (which(which(red, green), blue) for which in (np.maximum, np.minimum))
    turned = light + (255 - largest - smallest)[..., None]  # of bytes, modulo 256
    ground, steps = np.array(DARK), np.arange(256)[:, None]
    return np.asarray(ground + steps * (1 - ground / 255), np.uint8)[turned, range(3)]


def for_dark(colour: Sequence[int] | NDArray[np.uint8]) -> tuple[float, float, float]:
    """The colour (3,) of a figure, 0 to 1, that `pixels` turns into this one of the viewer, 0 to 255."""
    light = np.array(colour, float)
    red, green, blue = (light + 255 - light.max() - light.min()) / 255
    return float(red), float(green), float(blue)


def png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    imsave(buffer, pixels(figure), format="png")
    return buffer.getvalue()


def log_figure(recording: rr.RecordingStream, entity: str, figure: Figure, static: bool = True) -> None:
    """A figure that every timeline shows or, not `static`, one that stands from the recording's present time on."""
    recording.log(entity, rr.EncodedImage(contents=png(figure), media_type="image/png"), static=static)


def log_figures(recording: rr.RecordingStream, entity: str, times: rr.TimeColumn, figures: Sequence[Figure]) -> None:
    """One figure at each of the `times`; all of one size."""
    recording.log(entity, rr.EncodedImage.from_fields(media_type="image/png"), static=True)
    recording.send_columns(entity, [times], rr.EncodedImage.columns(blob=[png(f) for f in figures]))


def place(axes: Axes, x: Sequence[float], y: Sequence[float]) -> Array:
    """Pixels (n, 2) of points on the axes of a figure that was logged, y down; for what moves over the picture."""
    figure = axes.figure
    assert isinstance(figure, Figure)
    across, up = axes.transData.transform(np.stack([x, y], axis=1)).T
    return np.stack([across, figure.bbox.height - up], axis=1)


def view(origin: str, name: str | None, size: tuple[float, float]) -> rrb.View:
    """A view of a picture of `size` (width, height) in inches, all of it."""
    bounds = rrb.VisualBounds2D(x_range=(0, DOTS * size[0]), y_range=(0, DOTS * size[1]))
    return rrb.Spatial2DView(origin=origin, name=name, titlebar=name is not None, visual_bounds=bounds, background=DARK)
