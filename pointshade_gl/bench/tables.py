"""What the tables of `pointshade bench` have in common. They go to stdout."""

from __future__ import annotations

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

PLAIN_WIDTH = 150  # columns of a table in a file


def wide_console() -> Console:
    """A console on stdout: as wide as the terminal, or wide enough for every table if the output is a file."""
    console = Console()
    return console if console.is_terminal else Console(width=PLAIN_WIDTH)


def new_table(title: str, first: str, *numbers: str) -> Table:
    """A table of a column of names, and columns of numbers."""
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD)
    table.add_column(first, no_wrap=True)
    for name in numbers:
        table.add_column(name, justify="right")
    return table


def bold(method: str) -> str | None:
    return "bold" if method == "auto" else None


def brief(value: float | None) -> str:
    """Two digits, whole numbers from 100 on; a dash for None."""
    return "-" if value is None else f"{value:.0f}" if value >= 100 else f"{value:.2g}"
