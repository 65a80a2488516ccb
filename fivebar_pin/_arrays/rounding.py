"""Round-off written as what it is, and tables as text."""

from __future__ import annotations

import io

import numpy as np

from fivebar_pin._arrays.immutable import Array

ROUND_OFF = 2.0**-40
"""Share of what adds up to a number that round-off may leave of it: 4096 units in the last place, as loops are closed
to some hundred of them and a chain of solved equations adds to that [-]."""

TINY = 1e-300
"""Least divisor: x / max(y, TINY) is huge where y is zero, and no number is none [any unit]."""


def table_text(header: str, body: Array) -> str:
    """Return a table (n, k) as csv text below a header line, every digit kept."""
    text = io.StringIO()
    np.savetxt(text, body, delimiter=",", header=header, comments="", fmt="%.17g")
    return text.getvalue()


def settled(value: float, scale: float) -> float:
    """Return a value, zero where it is only the round-off of what adds up to it.

    Args:
        value: as computed.
        scale: sum of the sizes of what adds up to it, in its unit; 0 when nothing cancels.
    """
    return 0.0 if abs(value) <= ROUND_OFF * scale else float(value)


def figures(value: float, scale: float = 0.0, *, digits: int = 4) -> str:
    """Write a number for people to read, with a few significant digits; round-off is written as 0.

    Args:
        value, scale: as for `settled`.
        digits: significant digits.
    """
    return f"{settled(value, scale):.{digits}g}"
