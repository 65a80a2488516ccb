"""How large the variables of a problem can be: what bounds and proofs are rigorous within.

The mass of a piece is at most its bound. With R the radius about the origin that holds its region in the mean square,
|h| <= R m, and second moments and inertias are at most R^2 m; what is taken from a body is no more than the body. Other
variables follow from linear consequences of their cones, s_0 >= |s_k| and M_ii t + M_jj / t >= 2 |M_ij|, by intervals.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.solvers import Block
from fivebar_pin.balancing.variables.material import Material

__all__ = ["extents"]

_PASSES = 12  # of intervals over the rows; forms that stand on each other are fewer levels high
_WEIGHTS = 4.0 ** np.arange(-6, 7)  # t of the pairs of a matrix


def extents(materials: Sequence[Material], gone: Sequence[bool], blocks: Sequence[Block], n: int) -> Array:
    """Return bounds b (n,) with |y_i| <= b_i for all designs; infinite where none was found."""
    heaviest = np.full(n, np.inf)
    for block in blocks:
        if block.cone not in ("zero", "nonneg"):
            continue
        single = np.count_nonzero(block.G, axis=1) == 1
        for row, offset in zip(block.G[single], block.g[single], strict=True):
            k = int(np.argmax(row != 0.0))
            if row[k] < 0.0 or block.cone == "zero":
                heaviest[k] = min(heaviest[k], max(0.0, -offset / row[k]))
    parts = [np.zeros(m.size) if g else _own(m, heaviest[m.start]) for m, g in zip(materials, gone, strict=True)]
    return np.concatenate(parts) if parts else np.zeros(0)


def _own(m: Material, heaviest: float) -> Array:
    """Return the bounds on the variables (size,) of one piece."""
    low, high = np.full(m.size, -np.inf), np.full(m.size, np.inf)
    most = heaviest * _radius(m) ** np.concatenate([[0.0], np.ones(m.width - 1)])
    most[m.inertias] = heaviest * _radius(m) ** 2
    if m.bounds.taken_from is not None:  # entries of a matrix between zero and the body's
        most = np.minimum(np.append(most, np.full(10 - m.width, np.inf)), float(np.trace(m.bounds.taken_from)))
    low[: most.size], high[: most.size] = -most, most
    low[0] = 0.0
    rows = _consequences(m.own)
    for _ in range(_PASSES):
        if np.isfinite(low).all() and np.isfinite(high).all():
            break
        _tighten(rows, low, high)
    return np.asarray(np.maximum(np.abs(low), np.abs(high)))


def _radius(m: Material) -> float:
    shape = m.bounds.shape
    if shape is None:
        return np.inf
    spread = np.linalg.norm(shape.semi_axes) if shape.kind == "box" else shape.semi_axes.max()
    return float(np.linalg.norm(shape.center) + spread)


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
