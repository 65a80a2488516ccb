"""Configurations that close all loops."""

from __future__ import annotations

import contextlib

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, finite, integer, number, numeric
from fivebar_pin.chain import ClosedChain
from fivebar_pin.engine.tables import unwritten
from fivebar_pin.errors import AssemblyError, SingularityError
from fivebar_pin.kinematics.follow import blocked, require_near
from fivebar_pin.mechanism.closing import CLOSED, closed_enough, most_open, nudged, polish, residual_of, search
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.idle import at_rest
from fivebar_pin.mechanism.loops import Loops, loops_of, open_message
from fivebar_pin.mechanism.mobility import inside_limits
from fivebar_pin.mechanism.prepared import Prepared, prepared_of

__all__ = [
    "assemble",
    "assemble_near",
    "assemble_somewhere",
    "checked_search",
    "closed_from_starts",
    "closure_residual",
]


STARTS = 64  # of a search, unless told otherwise
_FOLLOWED = 1e-8  # closure residual of `near` up to which its assembly mode is followed from there [m or rad]
_TOO_FAR, _BOTH_ENDS = -2, 2  # how a way ended, see `engine.entries.bring`
_MOST_STARTS = 100_000  # random starts of one search; all are held in memory at once
_TURNS = 3.0  # half turns, either way, over which searches start for joints that count their turns


@finite()
def assemble(
    chain: ClosedChain,
    q_actuated: npt.ArrayLike,
    near: npt.ArrayLike | None = None,
    *,
    starts: int = STARTS,
    seed: int = 0,
    tolerance: float = CLOSED,
) -> Array:
    """Find the configuration that closes all loops for given actuated coordinates.

    Args:
        chain: the mechanism.
        q_actuated: actuated coordinates (na,) or (n, na), order of `chain.actuated` [rad or m].
        near: a configuration (nq,). When it is itself closed, its assembly mode is followed from there along the
            straight line of actuated coordinates; otherwise a damped, step-limited search starts at it.
            Without it the model's named configurations (`chain.references`), the neutral and random ones are tried.
        starts: number of random starts when `near` is not given.
        seed: of the random starts.
        tolerance: closure residual to reach [m or rad; relative to the chain's length above 1 m].

    Returns:
        The configuration (nq,) or (n, nq).

    Raises:
        AssemblyError: the loops do not close; names the closure that stays open and by how much.
        SingularityError: the way from `near` is blocked by a singularity.
    """
    chain = at_rest(chain)
    checked_search(chain, starts, seed, tolerance)
    x = numeric("q_actuated", q_actuated)
    if x.ndim == 2:
        each = [assemble(chain, row, near, starts=starts, seed=seed, tolerance=tolerance) for row in x]
        return np.stack(each) if each else np.zeros((0, chain.nq))
    x = checked("q_actuated", x, (chain.na,))
    if near is not None:
        return assemble_near(chain, x, checked("near", near, (chain.nq,)), tolerance)
    return assemble_somewhere(chain, x, starts, seed, tolerance)


def assemble_somewhere(
    chain: ClosedChain, x: Array, starts: int = STARTS, seed: int = 0, tolerance: float = CLOSED
) -> Array:
    """Return a configuration (nq,) at actuated coordinates x (na,), on the branch of a named one that leads there."""
    for reference in chain.references.values():
        with contextlib.suppress(AssemblyError, SingularityError):
            return assemble_near(chain, x, reference, tolerance)
    loops = loops_of(chain)
    q, residual = closed_from_starts(chain, loops, x, starts, seed, tolerance)
    if not q.shape[0]:
        raise open_message(loops, residual, f"at the actuated coordinates {x.tolist()} (best of {starts} starts)")
    return np.asarray(q[int(np.argmax(inside_limits(chain, q)))])  # the first one, where none keeps them


@finite()
def closure_residual(chain: ClosedChain, q: npt.ArrayLike) -> Array:
    """Return every closure row at q: (nq,) -> (m,) or (n, nq) -> (n, m) [m, rad], axes of frame 1."""
    loops = loops_of(chain)
    Q = numeric("q", q)
    single = Q.ndim == 1
    Q = checked("q", np.atleast_2d(Q), (None, chain.nq))
    if not loops.m:
        return np.zeros((0,) if single else (Q.shape[0], 0))
    residual = residual_of(loops, Q)
    return np.asarray(residual[0]) if single else residual


def checked_search(chain: ClosedChain, starts: int, seed: int, tolerance: float) -> Loops:
    """Return the prepared loops once the numbers of a search have been looked at."""
    integer("starts", starts, least=1, most=_MOST_STARTS)
    integer("seed", seed)
    number("tolerance", tolerance, positive=True)
    loops = loops_of(chain)
    loops.require_determined()
    return loops


def assemble_near(chain: ClosedChain, x: Array, near: Array, tolerance: float) -> Array:
    """Return the configuration (nq,) at actuated coordinates x (na,) that a configuration (nq,) picks."""
    loops, q = loops_of(chain), np.array(near[None])
    if loops.m and not _opposed(loops, q):
        found = _brought(loops, prepared_of(chain), q, x, tolerance)
        if found is not None:
            return found
    loops.set_actuated(q, x)
    if not loops.m:
        return np.asarray(q[0])
    return _searched_near(loops, q, x, tolerance)


def _brought(loops: Loops, ready: Prepared, q: Array, x: Array, tolerance: float) -> Array | None:
    """Follow the branch of q (1, nq) to x (na,), in place; None, and nothing done, where q is open, or singular."""
    from fivebar_pin.engine.entries import bring

    I, W, gap = ready.I, ready.memory(), np.empty(1)
    reached = bring(I, W, ready.turns, unwritten(x[None]), most_open(loops, _FOLLOWED), q, gap)
    if reached == _BOTH_ENDS:
        if max(gap[0], ready.left) <= most_open(loops, tolerance):
            return np.asarray(q[0])
        raise open_message(loops, residual_of(loops, q)[0], f"at the actuated coordinates {x.tolist()}")
    at = loops.actuated_of(q)[0]
    if reached == _TOO_FAR:
        require_near(loops, np.array([at, x]))
    if reached >= 0:
        error = blocked(loops, I, W, x if reached else None)
        if reached or not isinstance(error, SingularityError):
            raise error
        if np.array_equal(at, x) and closed_enough(loops, Configurations(loops, q).gap, tolerance)[0]:
            return np.asarray(q[0])  # a search would not find it again: it converges badly at a singular place
    return None


def _opposed(loops: Loops, q: Array) -> bool:
    """Tell whether a hinge of q (1, nq) is closed with its axes against each other."""
    return loops.may_oppose and bool(loops.opposed(loops.see(q))[0])


def _searched_near(loops: Loops, q: Array, x: Array, tolerance: float) -> Array:
    """Return the closed configuration (nq,) nearest to q (1, nq) that searches from there lead to."""
    about = nudged(loops, q)
    loops.set_actuated(about, x)
    for starts in (q, about):
        found = search(loops, starts)
        closed = polish(loops, found)
        opposed = loops.opposed(loops.see(closed.q))
        good = np.flatnonzero(closed_enough(loops, closed.residual, tolerance) & ~opposed)
        if good.size:
            away = loops.tree.difference(q, closed.q[good]) / loops.column_scale
            return np.asarray(closed.q[good[int(np.argmin(np.abs(away).max(axis=1)))]])
    raise open_message(loops, _smallest(residual_of(loops, found)), f"at the actuated coordinates {x.tolist()}")


def closed_from_starts(
    chain: ClosedChain, loops: Loops, x: Array, starts: int, seed: int, tolerance: float
) -> tuple[Array, Array]:
    """Return the closed configurations (k, nq) reached from several starts, and the smallest residual (m,)."""
    import pinocchio as pin

    rng = np.random.default_rng(seed)
    tangent = rng.uniform(-np.pi, np.pi, (starts, loops.tree.nv)) * loops.column_scale
    tangent[:, _counted(chain)] *= _TURNS  # wheels of 5 to 2 stand as before after two turns only
    tangent[0] = 0.0
    q = loops.tree.integrate(np.repeat(pin.neutral(chain.model)[None], starts, axis=0), tangent)
    loops.set_actuated(q, x)
    if not loops.m:
        return q[:1], np.zeros(0)
    found = search(loops, q)
    closed = polish(loops, found)
    lost = ~np.isfinite(closed.residual)  # by Newton's method, where loops are folded
    q, sizes = (
        np.where(lost[:, None], found, closed.q),
        np.where(lost, Configurations(loops, found).gap, closed.residual),
    )
    good = closed_enough(loops, sizes, tolerance)
    good &= ~loops.opposed(loops.see(q))
    return q[good], _smallest(residual_of(loops, found))


def _counted(chain: ClosedChain) -> list[int]:
    """Return the columns of the joints whose turns a closure counts."""
    names = {name for closure in chain.closures for name in closure.counted}
    return [int(chain.model.idx_vs[chain.model.getJointId(name)]) for name in sorted(names)]


def _smallest(residual: Array) -> Array:
    """Return the residual (m,) of the best of several configurations (k, m)."""
    return np.asarray(residual[int(np.argmin(np.linalg.norm(residual, axis=1)))])
