"""Telling, in one line, what a file states and the mechanism goes without."""

from __future__ import annotations

import inspect
import warnings
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from fivebar_pin.errors import LeftOutWarning

__all__ = ["left_out"]


def left_out(path: Path, things: Iterable[str]) -> None:
    """Warn of the things left out of a file, equal ones counted ("camera", "camera": 2 cameras); once, or not at all.

    Args:
        path: the file.
        things: what each one is, in the singular.
    """
    counted = [thing if n == 1 else f"{n} {thing}s" for thing, n in Counter(things).items()]
    if counted:
        text = f"{path}: left out: {', '.join(counted)}"
        warnings.warn(text, LeftOutWarning, stacklevel=_caller())


def _caller() -> int:
    """Return how many calls back the one from outside of the library is, which the warning is shown at."""
    frame, level = inspect.currentframe(), 0
    while (
        frame is not None and str(frame.f_globals.get("__name__", "")).partition(".")[0] == __name__.partition(".")[0]
    ):
        frame, level = frame.f_back, level + 1
    return level
