"""The typical size of a term along motions."""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.regressors.rows import Rows

__all__ = ["typical"]

_BALANCED = 1e-3  # share of what adds up to a quantity below which the present value is no measure of it [-]


def typical(rows: Rows, value: float, present: Array) -> float:
    """Return the present value of a term, or, where that is next to nothing, the largest share that adds up to it.

    Args:
        rows: the quantity.
        value: of the term at the present parameters.
        present: parameters (10 nb,).
    """
    without = float(np.abs(rows.F * np.abs(present)).max(initial=0.0))
    return value if value > _BALANCED * without else (without or 1.0)
