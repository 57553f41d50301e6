"""The ladder as a section of the report, and the files of its output folder."""

from __future__ import annotations

from html import escape
from pathlib import Path

from thermospindle.diagnosis.ladder.ladder import Ladder
from thermospindle.report.figures import ladder as ladder_plots
from thermospindle.report.figures.common import save, svg
from thermospindle.report.text.ladder import sentences
from thermospindle.report.text.ladder_table import COLUMNS, LEGEND, cells
from thermospindle.report.typeset import figure, prose, table


def section(found: Ladder) -> tuple[str, str]:
    """Title and HTML for `report.page.report.write_report`."""
    grid = table(COLUMNS, [[prose(c) for c in cells(r)] for r in found.steps], caption=prose(LEGEND))
    caption = f"Above: the error at every step, of all data and of the {found.left_out} predicted by fits that have not seen them. Below: residuals of every mode "
    caption += f"in every test at the first step and at '{escape(found.top.name)}'."
    drawn = figure(svg(ladder_plots.figure(found), "ladder", "Error at every step of the ladder, and residuals on the first and the last"), caption)
    words = "".join(f"<p>{prose(s)}</p>" for s in sentences(found))
    return f"The ladder: {found.campaign.title}", drawn + grid + words


def write_ladder(found: Ladder, folder: Path) -> None:
    """`ladder.png` and `ladder.svg`, `ladder.rrd` and `report.html` into an existing folder."""
    from thermospindle.report.log.ladder import write_ladder_log
    from thermospindle.report.log.ladder_content import shown
    from thermospindle.report.page.report import write_page

    save(ladder_plots.figure(found), folder, "ladder", 130)
    write_page(folder, found.spindle, len(found.model.tests), found.campaign.title, [section(found)], "Ladder", found.campaign.name)
    write_ladder_log(shown(found), folder / "ladder.rrd")
