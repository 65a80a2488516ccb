"""Telling, in one line, what a file states and the mechanism goes without."""

from __future__ import annotations

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
        text = f"{path}: left out, as it does not move the mechanism: {', '.join(counted)}"
        warnings.warn(text, LeftOutWarning, stacklevel=2)
