"""Closed configurations of a chain whichever joints are driven, and what its closures do there.

Every decision about rank is made in `mechanism.rank`; here its consequences are given names.
"""

from __future__ import annotations

import itertools
import math

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import TINY, Array, block_svd
from fivebar_pin.chain import ClosedChain
from fivebar_pin.mechanism.closing import STEP, closed_enough, iterate, nudged, search
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import Loops, loops_of
from fivebar_pin.mechanism.rank import ranks_of, singular_values, truncated_inverse

__all__ = [
    "SLACK",
    "beyond",
    "close_all",
    "closed_from",
    "determining_sets",
    "first_closed",
    "gap",
    "generic_site",
    "inside_limits",
    "passive_sigma",
    "redundant_combinations",
    "site_at",
    "with_held",
]


_NEWTON = 8  # steps of Newton's method in all coordinates
_NOTHING = 1e-8  # weight of a row in a combination that is round-off, pivots being one [-]
SLACK = 1e-9  # how far beyond a limit a coordinate still lies on it: closing leaves less [rad or m]
_WIDE = 1e3  # limit from which on a coordinate is not drawn between its limits [rad or m]
_STARTS = 48  # random starts when no configuration is given
_WALKERS, _STRIDES = 8, 2  # samples and steps of the walk that finds generic configurations
_ENTRIES = 400_000  # numbers in the Jacobians of all of them at a time
_STRIDE = 0.4  # length of its steps [rad, or chain lengths]
_MANY = 2000  # combinations of joints beyond which only a good one is looked for


def site_at(loops: Loops, q: Array) -> Configurations:
    """Return one configuration q (nq,)."""
    return Configurations(loops, q[None])


def gap(loops: Loops, q: Array) -> Array:
    """Return the largest closure residual at configurations q (n, nq) -> (n,) [m or rad]."""
    return Configurations(loops, q).gap


def close_all(chain: ClosedChain, q: Array, tolerance: float) -> tuple[Array, Array]:
    """Close the loops from starts q (n, nq) with every coordinate free to move.

    Returns:
        Configurations (n, nq) and their largest residual (n,), infinite where a hinge closed back to front.
    """
    loops = loops_of(chain.with_actuated(()))
    if not loops.m or not loops.tree.nv:
        return q, gap(loops, q)
    good = closed_enough(loops, gap(loops, q), tolerance)
    q = np.array(q)
    if not good.all():
        q[~good] = search(loops, q[~good])
    q = iterate(loops, q, _AllCoordinates(good), most=_NEWTON)
    found = Configurations(loops, q)
    return q, np.where(loops.opposed(found.seen), np.inf, found.gap)


class _AllCoordinates:
    """Steps of least length in all coordinates, group by group, of the samples that do not close yet."""

    def __init__(self, good: npt.NDArray[np.bool_]) -> None:
        self._good = good

    def __call__(self, here: Configurations, which: npt.NDArray[np.intp]) -> tuple[Array, npt.NDArray[np.bool_]]:
        loops = here.loops
        residual = here.residual * loops.row_scale
        step = np.zeros((which.size, loops.tree.nv))
        for g, block in zip(loops.independent, here.blocks, strict=True):
            inverse = truncated_inverse(loops.scaled(block, g.rows, g.columns), loops.misfit)
            step[:, g.columns] = -np.matmul(inverse, residual[:, g.rows, None])[..., 0]
        step[self._good[which]] = 0.0
        q = loops.tree.integrate(here.q, np.clip(step, -STEP, STEP) * loops.column_scale)
        return q, np.ones(which.size, dtype=np.bool_)


def first_closed(chain: ClosedChain, seed: int, tolerance: float) -> tuple[Array, float]:
    """Find a closed configuration from the named ones, the neutral one, else from random ones, in this order.

    The first one within the joint limits is taken, else the first one; the best one if none closes.

    Returns:
        The configuration (nq,) and its largest residual [m or rad].
    """
    loops = loops_of(chain)
    neutral = np.array(pin.neutral(chain.model))
    q, sizes = close_all(chain, np.stack([*chain.references.values(), neutral]), tolerance)
    k = _best(chain, loops, q, sizes, tolerance)
    if k is None:
        rng, count = np.random.default_rng(seed), _affordable(_STARTS, loops)
        tangent = rng.uniform(-np.pi, np.pi, (count, loops.tree.nv)) * loops.column_scale
        starts = _within_limits(chain, loops.tree.integrate(np.repeat(neutral[None], count, axis=0), tangent), rng)
        more, further = close_all(chain, starts, tolerance)
        q, sizes = np.concatenate([q, more]), np.concatenate([sizes, further])
        k = _best(chain, loops, q, sizes, tolerance)
    if k is None:  # which of the closed ones is best is round-off
        closed = np.flatnonzero(closed_enough(loops, sizes, tolerance))
        k = int(closed[0] if closed.size else np.argmin(sizes))
    return q[k], float(gap(loops, q[k : k + 1])[0])


def closed_from(chain: ClosedChain, q: Array, tolerance: float) -> Array:
    """Close the loops from q (nq,), or from places about it where a search that starts there stays; the best found."""
    loops = loops_of(chain)
    found, sizes = close_all(chain, q[None], tolerance)
    if not closed_enough(loops, sizes, tolerance)[0]:
        more, further = close_all(chain, nudged(loops, q[None]), tolerance)
        found, sizes = np.concatenate([found, more]), np.concatenate([sizes, further])
    closed = np.flatnonzero(closed_enough(loops, sizes, tolerance))
    return np.asarray(found[int(closed[0] if closed.size else np.argmin(sizes))])


def _best(chain: ClosedChain, loops: Loops, q: Array, sizes: Array, tolerance: float) -> int | None:
    """Return the first of configurations q (n, nq) that is closed and within the limits."""
    good = np.flatnonzero(closed_enough(loops, sizes, tolerance) & inside_limits(chain, q))
    return int(good[0]) if good.size else None


def inside_limits(chain: ClosedChain, q: Array) -> npt.NDArray[np.bool_]:
    """Return which configurations q (n, nq) keep the joint limits (n,)."""
    outside = beyond(q, np.array(chain.model.lowerPositionLimit), np.array(chain.model.upperPositionLimit))
    return np.asarray(~outside.any(axis=1))


def beyond(q: Array, low: Array, high: Array) -> npt.NDArray[np.bool_]:
    """Return which coordinates of configurations q (..., nq) lie beyond their limits (nq,) by more than `SLACK`."""
    return np.asarray(~((q >= low - SLACK) & (q <= high + SLACK)))  # what is not a number too


def _within_limits(chain: ClosedChain, q: Array, rng: np.random.Generator) -> Array:
    """Return configurations q (n, nq) with coordinates outside their limits drawn again, or put on the nearer one."""
    low, high = np.array(chain.model.lowerPositionLimit), np.array(chain.model.upperPositionLimit)
    single = [j for j in range(1, chain.model.njoints) if chain.model.nqs[j] == 1]
    out = np.array(q)
    for k in (int(chain.model.idx_qs[j]) for j in single):
        outside = (out[:, k] < low[k]) | (out[:, k] > high[k])
        if outside.any():
            narrow = low[k] > -_WIDE and high[k] < _WIDE
            drawn = rng.uniform(low[k], high[k], len(q)) if narrow else np.clip(out[:, k], low[k], high[k])
            out[outside, k] = drawn[outside]
    return out


def _affordable(count: int, loops: Loops) -> int:
    """Return how many configurations to work on at a time: fewer where each takes a large matrix."""
    return max(1, min(count, _ENTRIES // max(1, loops.m * loops.tree.nv)))


def generic_site(chain: ClosedChain, site: Configurations, seed: int, tolerance: float) -> Configurations:
    """Walk away from a closed configuration along what the closures allow; return the most regular site met there.

    The rank of the closures is highest at almost every configuration and drops at singular ones, where branches of
    different character may meet: those that the actuated joints can drive come first.
    """
    loops = loops_of(chain)
    if not loops.m or not site.free.shape[2]:
        return site
    rng = np.random.default_rng(seed)
    best, score = site, _score(loops, site)
    walkers = _affordable(_WALKERS, loops)
    here = [site] * walkers
    for _ in range(_STRIDES):
        steps = [s.free[0] @ rng.normal(size=s.free.shape[2]) for s in here]
        tangent = np.stack([_STRIDE * d / max(float(np.abs(d).max()), TINY) for d in steps]) * loops.column_scale
        start = loops.tree.integrate(np.concatenate([s.q for s in here]), tangent)
        q, residual = close_all(chain, start, tolerance)
        closed = closed_enough(loops, residual, tolerance)
        here = [site_at(loops, q[k]) if closed[k] else here[k] for k in range(walkers)]
        for candidate in here:
            new = _score(loops, candidate)
            if candidate is not site and (new > score or (best is site and new[:2] == score[:2])):
                best, score = candidate, new
    return best


def _score(loops: Loops, site: Configurations) -> tuple[int, int, float]:
    """Return the rank, the rank with the actuated joints held, and the smallest singular value that counts."""
    s = site.whole.s[0]
    return site.rank, loops.rank(with_held(site.J[0], loops.actuated)), float(s[site.rank - 1]) if site.rank else 0.0


def with_held(J: Array, joints: npt.NDArray[np.intp]) -> Array:
    """Return the closure Jacobian (m, nv) with the given velocity coordinates held."""
    out = np.array(J)
    out[:, joints] = 0.0
    return out


def redundant_combinations(loops: Loops, site: Configurations) -> tuple[Array, Array]:
    """Return the row combinations that vanish at every configuration, and those that vanish at this site besides.

    Each (k, m), over the scaled rows, in echelon form: every row has a one at its own pivot.
    """
    if not loops.m:
        return np.zeros((0, 0)), np.zeros((0, 0))
    kept = loops.reduce / loops.row_scale  # orthonormal rows
    always = _complement_rows(kept, loops.m - loops.r)
    null = site.whole.left_null(site.rank)[0]
    extra = null.shape[0] - always.shape[0]
    outside = null - null @ always.T @ always
    here = block_svd(outside)[2][:extra] if extra > 0 else np.zeros((0, null.shape[1]))
    return _echelon(always), _echelon(here)


def _complement_rows(kept: Array, count: int) -> Array:
    m = kept.shape[1]
    return block_svd(kept)[2][m - count :] if count else np.zeros((0, m))


def _echelon(rows: Array) -> Array:
    """Reduce by Gauss and Jordan with complete pivoting; round-off is set to zero."""
    out = np.array(rows)
    done: list[int] = []
    for i in range(out.shape[0]):
        rest = np.abs(out[i:])
        rest[:, done] = 0.0
        at = np.unravel_index(int(np.argmax(np.round(rest, 9))), rest.shape)
        pivot_row, pivot = i + int(at[0]), int(at[1])
        out[[i, pivot_row]] = out[[pivot_row, i]]
        out[i] /= out[i, pivot]
        for k in range(out.shape[0]):
            if k != i:
                out[k] -= out[k, pivot] * out[i]
        done.append(pivot)
    out[np.abs(out) < _NOTHING] = 0.0
    return out


def passive_sigma(loops: Loops, J: Array, actuated: npt.NDArray[np.intp]) -> float:
    """Return the smallest singular value of the scaled passive columns of J, 0 where they lack rank [-]."""
    passive = np.setdiff1d(np.arange(loops.tree.nv), actuated)
    if not passive.size:
        return 1.0
    s = singular_values(loops.scaled(with_held(J, actuated)))
    return float(s[passive.size - 1]) if ranks_of(s, loops.misfit) == passive.size else 0.0


def determining_sets(chain: ClosedChain, site: Configurations, most: int) -> list[tuple[tuple[str, ...], float]]:
    """List sets of one-degree-of-freedom joints that determine the motion at a site, the best conditioned first."""
    loops, model = loops_of(chain), chain.model
    mobility = chain.nv - site.rank
    single = [j for j in range(1, model.njoints) if model.joints[j].nv == 1]
    if not mobility or mobility > len(single):
        return []
    columns = {j: int(model.idx_vs[j]) for j in single}
    if math.comb(len(single), mobility) <= _MANY:
        combinations = list(itertools.combinations(single, mobility))
    else:
        combinations = [_greedy(site.free[0], columns)]
    out = []
    for joints in combinations:
        sigma = passive_sigma(loops, site.J[0], np.array([columns[j] for j in joints]))
        if sigma > 0.0:
            out.append((tuple(model.names[j] for j in joints), sigma))
    out.sort(key=lambda item: -round(item[1], 12))
    return out[:most]


def _greedy(free: Array, columns: dict[int, int]) -> tuple[int, ...]:
    """Pick one set by pivoting: at each turn the joint that moves most while the chosen ones are held."""
    basis, chosen = np.array(free), []
    left = dict(columns)
    for _ in range(free.shape[1]):
        joint = max(left, key=lambda j: float(np.linalg.norm(basis[left[j]])))
        row = basis[left.pop(joint)]
        size = float(row @ row)
        if size > 0.0:
            basis = basis - np.outer(basis @ row, row) / size
        chosen.append(joint)
    return tuple(sorted(chosen))
