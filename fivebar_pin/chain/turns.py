"""Whole turns of joints in a configuration that was stored as cosines and sines.

Cosine and sine of a wheel do not say which of its turns it is in, and a coupling needs to know. Where some whole turns
n_k of the joints make all couplings of a configuration hold, sum_k c_k (q_k + 2 pi n_k) = offset, the fewest are taken.
They are found as an integer program.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fivebar_pin._arrays import Array

__all__ = ["Tie", "with_turns"]

Tie = tuple[Array, float]
"""Coefficients of a coupling in the coordinates q (nq,), and what their sum with q is."""

_MOST = 1000  # turns that a joint is thought to have made
_NODES = 100  # nodes of the search after which no turns are said to be found
_HELD = 1e-6  # gap of a coupling that is that of numbers with six digits: share of its largest term over a turn [-]


def with_turns(q: Array, ties: Sequence[Tie], turning: Sequence[int]) -> Array:
    """Return a configuration with the fewest whole turns added that make the ties hold; as it is where none do.

    Args:
        q: configuration (nq,), angles between -pi and pi.
        ties: the couplings.
        turning: places in q of the joints whose turns are not known.
    """
    touched = [(c, offset) for c, offset in ties if c[turning].any()]
    if not touched:
        return q
    scale = np.array([2.0 * np.pi * np.abs(c).max() for c, _ in touched])
    C = np.array([c for c, _ in touched]) / scale[:, None]
    gap = np.array([offset for _, offset in touched]) / scale - C @ q
    if np.abs(gap).max() <= _HELD:  # no need to wake the solver
        return q
    n = _fewest(2.0 * np.pi * C[:, turning], gap)
    if n is None:
        return q
    turned = np.array(q)
    turned[turning] += 2.0 * np.pi * n
    return turned


def _fewest(A: Array, b: Array) -> Array | None:
    """Return the integers n of least sum |n_k| with A n = b, or None."""
    from scipy.optimize import Bounds, LinearConstraint, milp

    k = A.shape[1]
    rows = LinearConstraint(np.hstack([A, -A]), b - _HELD, b + _HELD)
    bounds, cost = Bounds(0.0, _MOST), np.ones(2 * k)
    found = milp(cost, integrality=cost, bounds=bounds, constraints=rows, options={"node_limit": _NODES})
    if found.x is None:
        return None
    n = np.round(found.x)
    return np.asarray(n[:k] - n[k:])
