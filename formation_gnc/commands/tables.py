"""Tables that no terminal cuts."""

from collections.abc import Sequence

from rich.console import Console
from rich.markup import escape
from rich.table import Table

FRAME = 3
"""Characters of a column besides its text."""


def print_table(console: Console, columns: Sequence[Sequence[str]], title: str = "") -> None:
    """Print columns of text, each with its heading first; those that do not fit come as a further table below.

    The first column names the rows, and begins every table.
    """
    first, *others = columns
    widths = [max(len(line) for text in column for line in text.split("\n")) + FRAME for column in columns]
    while others:
        width, count = 1 + widths[0] + widths[len(columns) - len(others)], 1
        while count < len(others) and width + widths[len(columns) - len(others) + count] <= console.width:
            width += widths[len(columns) - len(others) + count]
            count += 1
        part, others = others[:count], others[count:]
        table = Table(title=escape(title) or None, title_justify="left")
        for number, column in enumerate((first, *part)):
            table.add_column(escape(column[0]), justify="right" if number else "left", no_wrap=True)
        for row in zip(*(column[1:] for column in (first, *part)), strict=True):
            table.add_row(*map(escape, row))
        usual, console.width = console.width, max(width, console.width)
        console.print(table)
        console.width = usual
        title = ""
