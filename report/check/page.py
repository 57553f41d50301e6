"""The page of `check`, and the files of its folder."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Any

from thermospindle.report.check.drawing import drawing
from thermospindle.report.check.words import grids, of_words, sentences
from thermospindle.report.figures.common import save, svg
from thermospindle.report.page.report import page
from thermospindle.report.typeset import figure, micro, minus, prose, table
from thermospindle.sim.operating import OperatingPoint

CAPTION = (
    "Above the axis the section, dashed the solid cylinder of the mass and inertia of each turning body that is not in it, bearings with the load lines of their contact angle at the reference, and measuring points; below it what the "
    "model moves: beams with their nodes, rigid bodies by their centres of mass, joints. Hatched: mass without stiffness."
)


def write_check(point: OperatingPoint, values: Mapping[str, Any], folder: Path) -> None:
    """`check.html`, and the picture as `section.svg` and `section.png`, into a folder that exists."""
    picture = drawing(point)
    odd = "".join(f"<li>{prose(words)}</li>" for words in values["odd"])
    assumed = [[escape(a["key"]), prose(a["what"])] for a in values["assumed"]]
    tables = "".join(
        table([micro(h) for h in head], [[minus(escape(cell)) for cell in row] for row in rows], [k for k, h in enumerate(head) if of_words(rows, k)], escape(title))
        for title, head, rows in grids(values)
    )
    sections = [
        ("What it is", "".join(f"<p>{prose(words)}</p>" for words in sentences(values)) + figure(svg(picture, "check", CAPTION), CAPTION)),
        ("What is odd", f"<ul>{odd}</ul>" if odd else "<p>Nothing.</p>"),
        ("Parts", tables),
        ("What is assumed", table(["key", "what stands for it"], assumed, (0, 1)) if assumed else "<p>Nothing: the scene says it all.</p>"),
    ]
    where = f"{values['reference_temperature_C']:g} °C, at rest"
    (folder / "check.html").write_text(page(point.spindle, where, sections, "Check"), encoding="utf-8")
    save(picture, folder, "section", 130)
