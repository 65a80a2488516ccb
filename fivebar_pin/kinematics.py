"""Constrained kinematics: assemble, drive, complement.

With the closure rows c(q) = 0, J = dc/dq and the coordinates split into actuated and passive,

    J_a v_a + J_p v_p = 0      =>   v = N v_a,   N = [1; -J_p^+ J_a],   J N = 0
    J a + (dJ/dt) v = 0        =>   a_p = -J_p^+ (J_a a_a + (dJ/dt) v)

N is the natural orthogonal complement written in the joint coordinates of the tree [Angeles and Lee 1988].
"""

from __future__ import annotations

import contextlib
from typing import Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, finite, integer, number, numeric
from fivebar_pin._loops import Loops, PassiveMap, loops_of, open_message
from fivebar_pin._newton import closed_enough, polish, residual_of, search
from fivebar_pin._tracking import SINGULAR, follow, node_at, track
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError
from fivebar_pin.motion import Motion
from fivebar_pin.trajectory import Trajectory

__all__ = ["assemble", "assembly_modes", "closure_residual", "complement", "drive"]

CLOSED = 1e-12  # closure residual that counts as closed [m or rad]
_INDEPENDENT = 1e-7  # scaled closure rate at unit actuated speed above which the motors are in each other's way [-]
_NUDGES, _NUDGE = 8, 0.2  # further starts about a poor one, and how far off [rad, or chain lengths]
_MOST_STARTS = 100_000  # random starts of one search; all are held in memory at once
_BLOCK = 4096  # samples worked on at a time, so that intermediate arrays stay in cache


@finite()
def assemble(
    chain: ClosedChain,
    q_actuated: npt.ArrayLike,
    near: npt.ArrayLike | None = None,
    *,
    starts: int = 64,
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
    loops = _checked_search(chain, starts, seed, tolerance)
    x = numeric("q_actuated", q_actuated)
    if x.ndim == 2:
        each = [assemble(chain, row, near, starts=starts, seed=seed, tolerance=tolerance) for row in x]
        return np.stack(each) if each else np.zeros((0, chain.nq))
    x = checked("q_actuated", x, (chain.na,))
    if near is not None:
        return _assemble_near(loops, x, checked("near", near, (chain.nq,)), tolerance)
    for reference in chain.references.values():
        with contextlib.suppress(AssemblyError, SingularityError):
            return _assemble_near(loops, x, reference, tolerance)
    q, residual = _closed_from_starts(chain, loops, x, starts, seed, tolerance)
    if not q.shape[0]:
        raise open_message(loops, residual, f"at the actuated coordinates {x.tolist()} (best of {starts} starts)")
    return np.asarray(q[0])


@finite()
def assembly_modes(
    chain: ClosedChain,
    q_actuated: npt.ArrayLike,
    *,
    starts: int = 128,
    seed: int = 0,
    tolerance: float = CLOSED,
) -> Array:
    """List the distinct closed configurations found for given actuated coordinates.

    A random search: it finds what its starts lead to, which for the usual planar linkages is every mode.

    Returns:
        Configurations (k, nq), ordered by their coordinates; a five-bar has two. Empty when nothing closes.
    """
    loops = _checked_search(chain, starts, seed, tolerance)
    x = checked("q_actuated", q_actuated, (chain.na,))
    q, _ = _closed_from_starts(chain, loops, x, starts, seed, tolerance)
    modes: list[Array] = []
    for candidate in q:
        poses = loops.tree.poses(candidate[None])
        if not any(_same_pose(loops, poses, mode) for mode in modes):
            modes.append(candidate)
    modes.sort(key=lambda c: np.round(c, 9).tolist())
    return np.stack(modes) if modes else np.zeros((0, chain.nq))


@finite()
def drive(
    chain: ClosedChain,
    motion: Motion,
    near: npt.ArrayLike | None = None,
    *,
    tolerance: float = CLOSED,
    limits: Literal["check", "ignore"] = "check",
) -> Trajectory:
    """Move the whole mechanism from the motion of its actuated joints, on one assembly mode.

    Args:
        chain: the mechanism.
        motion: of the actuated joints, columns in the order of `chain.actuated`.
        near: configuration (nq,) that picks the assembly mode, see `assemble`.
        tolerance: closure residual to reach [m or rad; relative to the chain's length above 1 m].
        limits: whether the joint limits of the model are checked.

    Returns:
        q, v, a of all joints, consistent with each other, the complement N and the closure residual.

    Raises:
        AssemblyError: a sample out of reach; names sample, time, closure and gap.
        BranchError: the motion cannot be followed without changing the assembly mode.
        SingularityError: the motion meets a type 2 singularity; names sample and time.
        InvalidInputError: motion of the wrong width, joint limits passed, motion left undetermined.
    """
    loops = loops_of(chain)
    loops.require_determined()
    if motion.na != chain.na:
        raise InvalidInputError(
            "motion columns", motion.na, f"must be {chain.na}, one for each of {', '.join(chain.actuated)}"
        )
    try:
        q0 = assemble(chain, motion.q[0], near, tolerance=tolerance)
        closed = track(loops, q0, motion.q, tolerance)
    except (AssemblyError, SingularityError) as error:
        raise _with_time(error, motion) from None
    if limits == "check":
        _check_limits(chain, closed.q, motion)
    parts = [
        _consistent(loops, closed.q[k : k + _BLOCK], motion.v[k : k + _BLOCK], motion.a[k : k + _BLOCK])
        for k in range(0, len(motion), _BLOCK)
    ]
    v, a, N = (np.concatenate(x) if len(parts) > 1 else x[0] for x in zip(*parts, strict=True))
    return Trajectory(motion.t, closed.q, v, a, N, closed.residual)


@finite()
def complement(chain: ClosedChain, q: npt.ArrayLike) -> Array:
    """Return the complement N of the closure Jacobian: v = N v_actuated and J N = 0.

    Args:
        chain: the mechanism.
        q: closed configuration (nq,) or (n, nq).

    Returns:
        N (nv, na) or (n, nv, na), rows in Pinocchio's order, columns in the order of `chain.actuated`.

    Raises:
        SingularityError: the actuated joints do not determine the motion at q.
    """
    loops = loops_of(chain)
    loops.require_determined()
    Q = numeric("q", q)
    single = Q.ndim == 1
    Q = checked("q", np.atleast_2d(Q), (None, chain.nq))
    poses = loops.tree.poses(Q)
    blocks = loops.blocks(poses, loops.pairs(poses))
    passive = loops.passive_map(blocks)
    _require_regular(passive.sigma)
    N = _whole_complement(loops, passive, blocks, Q.shape[0])
    return np.asarray(N[0]) if single else N


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


def _checked_search(chain: ClosedChain, starts: int, seed: int, tolerance: float) -> Loops:
    """Return the prepared loops once the numbers of a search have been looked at."""
    integer("starts", starts, least=1, most=_MOST_STARTS)
    integer("seed", seed)
    number("tolerance", tolerance, positive=True)
    loops = loops_of(chain)
    loops.require_determined()
    return loops


def _consistent(loops: Loops, q: Array, va: Array, aa: Array) -> tuple[Array, Array, Array]:
    """Return v, a (n, nv) and N (n, nv, na) from the actuated rates."""
    poses = loops.tree.poses(q)
    pairs = loops.pairs(poses)
    blocks = loops.blocks(poses, pairs)
    passive = loops.passive_map(blocks)
    N = _whole_complement(loops, passive, blocks, q.shape[0])
    v = np.matmul(N, va[..., None])[..., 0]
    a = np.matmul(N, aa[..., None])[..., 0]
    if loops.m:
        a[:, loops.passive] -= passive.solve(loops.drift(pairs, loops.tree.rates(q, v, poses)))
    return v, a, N


def _whole_complement(loops: Loops, passive: PassiveMap, blocks: list[Array], n: int) -> Array:
    """Return N (n, nv, na): ones for the actuated coordinates, -J_p^+ J_a for the passive ones."""
    N = np.zeros((n, loops.tree.nv, loops.actuated.size))
    N[:, loops.actuated, np.arange(loops.actuated.size)] = 1.0
    if loops.m:
        N[:, loops.passive] = passive.complement(blocks)
        for group, J in zip(passive.groups, blocks, strict=True):
            if not group.is_square:
                _require_independent(loops, loops.row_scale[group.rows, None] * J, N[:, group.columns])
    return N


def _require_independent(loops: Loops, J: Array, N: Array) -> None:
    """Raise unless J N = 0: more rows than passive coordinates may ask too much of the actuated ones."""
    left = np.abs(np.matmul(J, N * loops.column_scale[loops.actuated])).max(initial=0.0)
    if left > _INDEPENDENT * max(1.0, float(np.abs(N).max(initial=0.0))):
        raise InvalidInputError(
            "actuated joints",
            f"{loops.actuated.size} for {loops.tree.nv} coordinates",
            "are not independent: the closures tie them to each other",
            "Actuate fewer joints; diagnose(chain) lists the sets that determine the motion.",
        )


def _require_regular(sigma: Array) -> None:
    worst = int(np.argmin(sigma)) if sigma.size else 0
    if sigma.size and sigma[worst] < SINGULAR:
        raise SingularityError(
            f"configuration {worst} is at a type 2 singularity: the actuated joints do not determine the passive ones "
            f"(smallest scaled singular value {sigma[worst]:.2g}, must be above {SINGULAR:g})",
            sigma=float(sigma[worst]),
            sample=worst,
        )


def _assemble_near(loops: Loops, x: Array, near: Array, tolerance: float) -> Array:
    q = np.array(near[None])
    if closed_enough(loops, np.abs(residual_of(loops, q)).max(axis=1, initial=0.0), 1e-8)[0] if loops.m else False:
        at = _actuated_at(loops, q, x)
        node = node_at(loops, q[0], at)
        if node.sigma >= SINGULAR:
            closed = polish(loops, follow(loops, node, x).q[None])
            if not closed_enough(loops, closed.residual, tolerance)[0]:
                raise open_message(loops, residual_of(loops, closed.q)[0], f"at the actuated coordinates {x.tolist()}")
            loops.set_actuated(closed.q, x)
            return np.asarray(closed.q[0])
    loops.set_actuated(q, x)
    if not loops.m:
        return np.asarray(q[0])
    for starts in (q, _nudged(loops, q, x)):  # a search that starts at a saddle stays there: step aside
        found = search(loops, starts)
        closed = polish(loops, found)
        opposed = loops.opposed(loops.pairs(loops.tree.poses(closed.q)))
        good = np.flatnonzero(closed_enough(loops, closed.residual, tolerance) & ~opposed)
        if good.size:
            away = loops.tree.difference(q, closed.q[good]) / loops.column_scale
            return np.asarray(closed.q[good[int(np.argmin(np.abs(away).max(axis=1)))]])
    raise open_message(loops, _smallest(residual_of(loops, found)), f"at the actuated coordinates {x.tolist()}")


def _nudged(loops: Loops, q: Array, x: Array) -> Array:
    """Return starts (k, nq) about q (1, nq)."""
    rng = np.random.default_rng(0)
    tangent = _NUDGE * rng.uniform(-1.0, 1.0, (_NUDGES, loops.tree.nv)) * loops.column_scale
    starts = loops.tree.integrate(np.repeat(q, _NUDGES, axis=0), tangent)
    loops.set_actuated(starts, x)
    return starts


def _actuated_at(loops: Loops, q: Array, x: Array) -> Array:
    """Return the actuated coordinates (na,) of q (1, nq); unbounded joints count from the turn nearest to x."""
    at = loops.actuated_of(q)[0]
    turn = 2.0 * np.pi * np.array([loops.tree.is_cyclic(int(k)) for k in loops.actuated], dtype=np.float64)
    return np.asarray(at + turn * np.round((x - at) / (2.0 * np.pi)))


def _closed_from_starts(
    chain: ClosedChain, loops: Loops, x: Array, starts: int, seed: int, tolerance: float
) -> tuple[Array, Array]:
    """Return the closed configurations (k, nq) reached from several starts, and the smallest residual (m,)."""
    import pinocchio as pin

    rng = np.random.default_rng(seed)
    tangent = rng.uniform(-np.pi, np.pi, (starts, loops.tree.nv)) * loops.column_scale
    tangent[0] = 0.0
    q = loops.tree.integrate(np.repeat(pin.neutral(chain.model)[None], starts, axis=0), tangent)
    loops.set_actuated(q, x)
    if not loops.m:
        return q[:1], np.zeros(0)
    found = search(loops, q)
    closed = polish(loops, found)
    good = closed_enough(loops, closed.residual, tolerance)
    good &= ~loops.opposed(loops.pairs(loops.tree.poses(closed.q)))
    return closed.q[good], _smallest(residual_of(loops, found))


def _smallest(residual: Array) -> Array:
    """Return the residual (m,) of the best of several configurations (k, m)."""
    return np.asarray(residual[int(np.argmin(np.linalg.norm(residual, axis=1)))])


def _same_pose(loops: Loops, poses: object, other: Array) -> bool:
    """Whether two configurations place every body alike (angles that differ by whole turns do)."""
    from fivebar_pin._tree import Poses

    assert isinstance(poses, Poses)
    b = loops.tree.poses(other[None])
    near = 1e-6
    return all(np.abs(r - s).max() < near for r, s in zip(poses.R, b.R, strict=True)) and all(
        np.abs(r - s).max() < near * loops.length for r, s in zip(poses.p, b.p, strict=True)
    )


def _check_limits(chain: ClosedChain, q: Array, motion: Motion) -> None:
    lower, upper = chain.model.lowerPositionLimit, chain.model.upperPositionLimit
    slack = 1e-9
    bad = np.argwhere((q < lower - slack) | (q > upper + slack))
    if bad.size:
        k, i = (int(b) for b in bad[0])
        owner = int(np.searchsorted(np.array(chain.model.idx_qs)[1:], i, side="right"))
        raise InvalidInputError(
            f"joint {chain.model.names[owner]} at sample {k} (t = {motion.t[k]:.6g} s)",
            float(q[k, i]),
            f"must stay within its limits [{lower[i]:.6g}, {upper[i]:.6g}]",
            "Change the motion, or pass limits='ignore'.",
        )


def _with_time(error: AssemblyError | SingularityError, motion: Motion) -> AssemblyError | SingularityError:
    """Say at which sample and time it happened."""
    k = error.sample if error.sample is not None else 0
    error.sample, error.time = k, float(motion.t[k])
    error.args = (f"sample {k} (t = {motion.t[k]:.6g} s): {error.args[0]}",)
    return error
