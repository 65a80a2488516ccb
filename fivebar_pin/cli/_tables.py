"""Numbers and tables for the terminal."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fivebar_pin._arrays import Array

if TYPE_CHECKING:
    from rich.console import Console


def console() -> Console:
    """Return the console that tables go to; it prints names as they are, whatever brackets and colons they hold."""
    from rich.console import Console

    class Terminal(Console):
        def on_broken_pipe(self) -> None:
            """Leave it to `main`, which knows what it means that the reader has gone."""
            raise BrokenPipeError

    return Terminal(highlight=False, soft_wrap=False, markup=False, emoji=False)


def progress() -> Console:
    """Return the console that tells of work under way: the error stream, which leaves the results alone."""
    from rich.console import Console

    return Console(stderr=True, quiet=not sys.stderr.isatty())


def table(console: Console, title: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table, first column to the left, the others to the right; no number is cut on a narrow terminal."""
    from rich import box
    from rich.measure import Measurement
    from rich.table import Table

    made = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1), show_header=any(headings))
    for k, heading in enumerate(headings):
        made.add_column(heading, justify="right" if k else "left", no_wrap=True)
    for row in rows:
        made.add_row(*row)
    console.print(f"\n{title}", soft_wrap=True)
    whole = Measurement.get(console, console.options.update(max_width=10_000), made).maximum
    usual = console.width
    console.width = max(usual, whole)
    console.print(made, crop=False)
    console.width = usual


def written(console: Console, files: Sequence[Path]) -> None:
    """Tell which files have been written."""
    for file in files:
        console.print(f"  {file}", soft_wrap=True)


def announce(text: str) -> None:
    """Print at once, before anything that waits."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


def peak(x: Array) -> float:
    """Return the largest magnitude: of vectors (n, k), of numbers (n,)."""
    size = np.linalg.norm(x, axis=1) if x.ndim == 2 else np.abs(x)
    return float(size.max())


def rms(x: Array) -> float:
    """Return the root mean square over the samples, as the rms_ terms of a design: of vectors (n, k), numbers (n,)."""
    square = np.sum(x * x, axis=1) if x.ndim == 2 else x * x
    return float(np.sqrt(np.mean(square)))
