"""Tables of the terminal, in as many pieces as its width asks for: nothing is cut off, at 80 columns and in a pipe neither."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

OF_LINES = "fi, fo: turning frequencies of the inner and the outer ring; fc: of the cage; fb: of a ball or roller about its own axis, seen from the cage"
"""Key of the names of lines."""
APART = 2  # columns of the terminal between two columns of a table
WORDS = 24  # columns of the terminal left to words before they wrap


def grid(title: str, columns: Iterable[str], words: Collection[str] = ()) -> Table:
    """An empty table; the columns `words` stand to the left and may wrap, numbers to the right and whole."""
    table = Table(
        title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, show_edge=False, pad_edge=False, collapse_padding=True
    )
    for column in columns:
        left = column in words
        table.add_column(column, justify="left" if left else "right", no_wrap=not left, overflow="fold")
    return table


def show_grid(
    console: Console, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], words: Collection[str] = (), keys: int = 1
) -> None:
    """Print a table; where it is too wide for the console, in pieces one below the other, the first `keys` columns in each."""
    widths = [_width(cells, cells[0] in words) for cells in zip(columns, *rows, strict=True)]
    pieces, room = [list(range(keys, keys + 1))], console.width - sum(widths[:keys]) - APART * keys
    left = room - widths[keys]
    for k in range(keys + 1, len(columns)):
        left -= widths[k] + APART
        if left < 0:
            pieces.append([])
            left = room - widths[k]
        pieces[-1].append(k)
    for number, piece in enumerate(pieces):
        shown = [*range(keys), *piece]
        console.print(title if number == 0 else f"{title}, continued", style="bold", markup=False, highlight=False)
        table = grid("", [columns[k] for k in shown], words)
        for row in rows:
            table.add_row(*(row[k] for k in shown))
        console.print(table)


def _width(cells: Sequence[str], words: bool) -> int:
    widest = max(len(line) for cell in cells for line in (cell.splitlines() or [""]))
    return min(widest, WORDS) if words else widest
