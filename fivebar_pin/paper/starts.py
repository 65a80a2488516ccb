"""Where to start looking for the optimum: balanced linkages spread over the whole feasible set."""

from __future__ import annotations

from itertools import product

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import InfeasibleError
from fivebar_pin.paper.polar import Problem
from fivebar_pin.paper.positions import CArray
from fivebar_pin.paper.rings import common_points

__all__ = ["balanced_points", "mixtures", "only_point"]

_OUTSIDE = 1e-12  # violation of the bounds, in mu rho or in mu, that is round-off [-]
_SLACK = 1e-9  # the same of a start, which the search clips to the bounds [-]
_CLOSEST = 1e-3  # distance of the first grid point from a centre [of the spread of the grid]
_ALONE = 3e-8  # common points this close together [spread of the centres] are one: a touching point is a double root


def only_point(problem: Problem, mu: Array) -> list[Array]:
    """Return the one balanced linkage that the bounds leave, in all its spellings, best first; else nothing.

    (rho, alpha) and (-rho, alpha + pi) are the same link.
    """
    corners, _ = common_points(*_rings(problem, mu))
    if not len(corners) or np.abs(corners - corners[0]).max() > _ALONE * float(np.ptp(_shift(mu))):
        return []
    return _spelled(problem, mu, corners, each=1)


def balanced_points(problem: Problem, mu: Array, *, each: int) -> list[Array]:
    """Return good balanced points for each choice of the side of every joint, best first."""
    low, high = problem.low[4:8], problem.high[4:8]
    rings = _rings(problem, mu)
    corners, violation = common_points(*rings)
    if violation > _OUTSIDE:
        raise InfeasibleError(
            f"No balanced linkage has rho between {low.tolist()} and {high.tolist()} with the mass ratios "
            f"{np.round(mu, 6).tolist()}: the bounds would have to give way by {violation:.3g} in mu rho. "
            "Widen rho_bounds or change the masses."
        )
    return _spelled(problem, mu, np.concatenate([corners, _grid(_shift(mu)), _ring_grid(*rings)]), each=each)


def _shift(mu: Array) -> Array:
    """Return the shifts of mu_i l_i = s + shift_i (4,), where s = mu2 l2 is the free complex number."""
    return np.array([-mu[1], 0.0, mu[2], mu[2] + mu[3]])


def _rings(problem: Problem, mu: Array) -> tuple[Array, Array, Array]:
    """Return centres, inner and outer radii of the rings for s that the bounds on rho_i = |l_i| make."""
    low, high = problem.low[4:8], problem.high[4:8]
    inner = np.where((low <= 0.0) & (high >= 0.0), 0.0, np.minimum(np.abs(low), np.abs(high)))
    return -_shift(mu), mu * inner, mu * np.maximum(np.abs(low), np.abs(high))


def _spelled(problem: Problem, mu: Array, s: CArray, *, each: int) -> list[Array]:
    """Return the best of the points s, up to `each` for every choice of the sides, as (alpha, rho, mu), best first."""
    shift, low, high = _shift(mu), problem.low[4:8], problem.high[4:8]
    l = (s[:, None] + shift) / mu
    starts: list[tuple[float, Array]] = []
    for sides in product((0.0, np.pi), repeat=4):
        alpha = np.angle(l * np.exp(1j * np.array(sides)))
        rho = (l * np.exp(-1j * alpha)).real
        inside = np.all((rho >= low - _SLACK) & (rho <= high + _SLACK), axis=1)
        value = problem.weights[0] * np.sum(alpha**2, axis=1) + problem.weights[1] * np.sum((rho - 0.5) ** 2, axis=1)
        for k in _apart(np.where(inside, value, np.inf), s, 0.1 * float(np.ptp(shift)), each):
            starts.append((float(value[k]), np.concatenate([alpha[k], rho[k], mu])))
    return [x for _, x in sorted(starts, key=lambda pair: pair[0])]


def _apart(value: Array, s: CArray, distance: float, count: int) -> list[int]:
    """Return the indices of the best points that keep a distance from each other."""
    left = value.copy()
    found: list[int] = []
    while len(found) < count and np.isfinite(left.min()):
        found.append(int(np.argmin(left)))
        left[np.abs(s - s[found[-1]]) < distance] = np.inf
    return found


def _grid(shift: Array) -> CArray:
    """Return points around the centres where single l_i vanish, closer where they lie."""
    span = 2.0 * float(np.ptp(shift))
    x = np.concatenate([-np.geomspace(_CLOSEST, 1.0, 16)[::-1], [0.0], np.geomspace(_CLOSEST, 1.0, 16)]) * span
    around = (x[:, None] + 1j * x[None, :]).ravel()
    return np.asarray((around[None, :] - shift[:, None]).ravel())


def _ring_grid(centres: Array, inner: Array, outer: Array) -> CArray:
    """Return points of the smallest ring, none if no ring is bounded."""
    k = int(np.argmin(outer))
    if not np.isfinite(outer[k]):
        return np.empty(0, dtype=np.complex128)
    radius = np.linspace(inner[k], outer[k], 41)
    return np.asarray((centres[k] + radius[:, None] * np.exp(1j * np.linspace(-np.pi, np.pi, 145))).ravel())


def mixtures(low: Array, high: Array) -> list[Array]:
    """Return mass ratios within the bounds that add up to one: pushed towards each bound, and in the middle."""
    found = []
    for lean in product((0.0, 0.5, 1.0), repeat=4):
        wish = low + np.array(lean) * (high - low)
        short = 1.0 - wish.sum()
        room = (high - wish) if short > 0.0 else (wish - low)
        if abs(short) <= _OUTSIDE:
            found.append(wish)
        elif room.sum() >= abs(short) - _OUTSIDE:
            found.append(wish + short * room / room.sum())
    rows = {tuple(np.round(mu, 9)): mu for mu in found}
    return list(rows.values())[:: max(1, len(rows) // 12)]
