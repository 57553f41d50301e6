"""What all blueprints are made of: paths of entities, views and their axes, and the window that holds them."""

from __future__ import annotations

from typing import Any

import rerun as rr
import rerun.blueprint as rrb

DARK = (13, 13, 15)
"""The viewer's own ground."""

Point = tuple[float, float, float]


def at(*parts: str) -> str:
    """The path of an entity from its parts, which may hold any characters."""
    return rr.new_entity_path(list(parts))


def window(contents: rrb.View | rrb.Container, timeline: str, **pace: float) -> rrb.Blueprint:
    """A blueprint that fills the window with its contents; where a `pace` is given, fps or playback_speed, it plays over and over."""
    playing: dict[str, Any] = {**pace, "play_state": "playing", "loop_mode": "all"} if pace else {}
    return rrb.Blueprint(
        contents,
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
        rrb.TimePanel(state="collapsed", timeline=timeline, **playing),
        auto_views=False,
        auto_layout=False,
    )


def scene(origin: str, name: str, eye: Point, target: Point) -> rrb.Spatial3DView:
    """Bodies, z up, as an `eye` sees them that looks at a `target` (mm)."""
    controls = rrb.EyeControls3D(position=eye, look_target=target, eye_up=(0, 0, 1))
    return rrb.Spatial3DView(origin=origin, name=name, eye_controls=controls, line_grid=False, background=DARK)


def axis(unit: str, begin: float, end: float) -> rrb.TimeAxis:
    """A fixed part of a timeline, in its `unit`: seconds or seq."""
    return rrb.TimeAxis(view_range=rr.TimeRange(*(rr.TimeRangeBoundary.absolute(**{unit: place}) for place in (begin, end))))


def summary_view() -> rrb.TextDocumentView:
    return rrb.TextDocumentView(origin="summary", name="Summary")
