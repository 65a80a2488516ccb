"""How large variables can be: what bounds and proofs are rigorous within.

Where it is not known of a variable, it follows from linear consequences of its cones, s_0 >= |s_k| and
M_ii t + M_jj / t >= 2 |M_ij|, by intervals.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.solvers import Block

__all__ = ["stated", "tightened"]

_PASSES = 12  # of intervals over the rows; forms that stand on each other are fewer levels high
_WEIGHTS = 4.0 ** np.arange(-6, 7)  # t of the pairs of a matrix


def stated(blocks: Sequence[Block], n: int) -> Array:
    """Return the upper bound on each of n variables that some row states for it alone; infinite where none does."""
    most = np.full(n, np.inf)
    for block in blocks:
        if block.cone not in ("zero", "nonneg"):
            continue
        single = np.count_nonzero(block.G, axis=1) == 1
        for row, offset in zip(block.G[single], block.g[single], strict=True):
            k = int(np.argmax(row != 0.0))
            if row[k] < 0.0 or block.cone == "zero":
                most[k] = min(most[k], max(0.0, -offset / row[k]))
    return most


def tightened(cones: Sequence[Block], low: Array, high: Array) -> Array:
    """Return bounds b (n,) with |y_i| <= b_i that follow from low <= y <= high (n,) in cones."""
    low, high, rows = np.array(low), np.array(high), _consequences(cones)
    for _ in range(_PASSES):
        if np.isfinite(low).all() and np.isfinite(high).all():
            break
        _tighten(rows, low, high)
    return np.asarray(np.maximum(np.abs(low), np.abs(high)))


def _consequences(blocks: Sequence[Block]) -> Array:
    """Return rows [G, g] (k, size + 1) that are not negative in the cones."""
    out = []
    for block in blocks:
        rows = np.column_stack([block.G, block.g])
        if block.cone == "zero":
            out += [rows, -rows]
        elif block.cone == "nonneg":
            out.append(rows)
        elif block.cone == "soc":
            out += [rows[:1], rows[:1] + rows[1:], rows[:1] - rows[1:]]
        else:
            out.append(_of_matrix(rows))
    return np.concatenate(out)


def _of_matrix(rows: Array) -> Array:
    """Return what a semidefinite matrix says of its entries two by two."""
    order = int(np.sqrt(2 * len(rows)))
    diagonal = [rows[j * (j + 3) // 2] for j in range(order)]
    out = list(diagonal)
    for j in range(order):
        for i in range(j):
            twice = np.sqrt(2.0) * rows[j * (j + 1) // 2 + i]
            for t in _WEIGHTS:
                both = t * diagonal[i] + diagonal[j] / t
                out += [both + twice, both - twice]
    return np.array(out)


def _tighten(rows: Array, low: Array, high: Array) -> None:
    """Bound what has no bounds, in place, by rows G y + g >= 0: each variable against the largest of all others."""
    G, g = rows[:, :-1], rows[:, -1]
    for k in np.flatnonzero(np.isinf(low) | np.isinf(high)):
        used = np.abs(G[:, k]) > 0.0
        own, factors = G[used], G[used, k]
        others = np.delete(own, k, axis=1)
        top = np.where(others > 0.0, np.delete(high, k), np.delete(low, k))
        with np.errstate(invalid="ignore"):
            most = np.where(others == 0.0, 0.0, others * top).sum(axis=1) + g[used]
        limit = -most / factors
        low[k] = max(low[k], limit[factors > 0.0].max(initial=-np.inf))
        high[k] = min(high[k], limit[factors < 0.0].min(initial=np.inf))
