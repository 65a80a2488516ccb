"""Closure forces and joint reactions, with what the model leaves open marked as nan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, cross, finite, frozen
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.bodies import Bodies, BodyRates, body_rates, gravity_wrenches
from fivebar_pin.dynamics.elastic import body_wrenches
from fivebar_pin.dynamics.wrenches import moved_to_origin
from fivebar_pin.mechanism.loops import Loops, loops_of
from fivebar_pin.mechanism.rank import Decomposed
from fivebar_pin.mechanism.tree import Poses
from fivebar_pin.trajectory import Trajectory

__all__ = ["Reactions", "determinate", "reactions"]


_OPEN = 1e-9  # force in a joint for a unit force in the closures above which the joint's own is not determinate [-]


@dataclass(frozen=True, slots=True, eq=False)
class Reactions(Immutable):
    """Reactions along a trajectory, world axes.

    Attributes:
        multipliers: closure forces in the rows of J (n, m); of least norm where the closures are redundant.
        determinate_rows: which of them are determinate (n, m).
        closure: wrench by body 1 on body 2 at the closure point (n, closures, 6) [N, N m].
        joint: wrench by the parent on the body of every joint, motor and joint springs included, at the joint origin
            (n, nb, 6).
        closure_local: `closure` in the axes of frame 1.
        joint_local: `joint` in the axes of the joint, that is of the body it carries.
        bodies: momenta of the bodies and their rates.
        gravity, external, sprung: wrench on every body at the world origin; the last by springs (n, nb, 6).
        forces: of the joints, then of the closures, of least norm where they are not determinate
            (n, nb + closures, 3) [N].
        free: forces that the redundant closures could carry besides, in every joint, then every closure, for a basis
            of unit closure forces (n, k, nb + closures, 3) [-].
        mismatch: largest unbalanced joint torque [N m or N]; round-off when the trajectory is consistent.

    Components that the closures do not determine (they depend on which of the redundant rows carries the load) are
    nan, judged in the axes they are given in: in a plane that is tilted in the world, the local axes tell more.
    """

    multipliers: Array
    determinate_rows: npt.NDArray[np.bool_]
    closure: Array
    joint: Array
    closure_local: Array
    joint_local: Array
    bodies: BodyRates
    gravity: Array
    external: Array
    sprung: Array
    forces: Array
    free: Array
    mismatch: float


@finite(open=("closure", "closure_local", "joint", "joint_local"))
def reactions(
    chain: ClosedChain,
    trajectory: Trajectory,
    tree_torque: Array,
    torque: Array,
    external: Mapping[str, Array],
) -> Reactions:
    """Compute all reactions; see `Reactions`."""
    loops = loops_of(chain)
    tree = loops.tree
    poses = tree.poses(trajectory.q)
    rates = tree.rates(trajectory.q, trajectory.v)
    bodies = Bodies.of(chain)
    moving = body_rates(tree, bodies, poses, rates, trajectory.a)
    gravity = gravity_wrenches(bodies, moving.centre, np.array(chain.model.gravity.linear))
    applied = moved_to_origin(chain, poses, external).on_bodies(moving.rate.shape[1])
    sprung = body_wrenches(chain, loops, trajectory.v, poses)
    unbalanced = np.array(tree_torque)
    unbalanced[:, loops.actuated] -= torque
    forces = _closure_forces(loops, poses, unbalanced)
    carried = _carried(chain, loops, moving.rate - gravity - applied - sprung, forces.wrench)
    slack = _carried(chain, loops, np.zeros((*forces.free.shape[:2], *carried.shape[1:])), forces.free)
    unit = np.r_[np.ones(3), np.full(3, chain.length)]
    closure = _seen(forces.wrench, forces.free, forces.point, forces.axes, unit)
    joint = _seen(carried, slack, np.swapaxes(poses.p[1:], 0, 1), np.swapaxes(poses.R[1:], 0, 1), unit)
    return Reactions(
        forces.multipliers,
        forces.determinate_rows,
        closure[0],
        joint[0],
        closure[1],
        joint[1],
        moving,
        gravity,
        applied,
        sprung,
        np.concatenate([carried, forces.wrench], axis=1)[..., :3],
        np.concatenate([slack, forces.free], axis=2)[..., :3],
        forces.mismatch,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _ClosureForces:
    multipliers: Array  # (n, m)
    determinate_rows: npt.NDArray[np.bool_]  # (n, m)
    wrench: Array  # on body 2, at the world origin (n, nc, 6)
    free: Array  # what redundant closures could carry besides, for a basis of unit forces (n, k, nc, 6)
    point: Array  # of the closures (n, nc, 3)
    axes: Array  # of frame 1 (n, nc, 3, 3)
    mismatch: float


def _closure_forces(loops: Loops, poses: Poses, unbalanced: Array) -> _ClosureForces:
    """Solve J^T lambda = unbalanced torque (n, nv), lambda of least norm."""
    n = unbalanced.shape[0]
    if not loops.m:
        none = np.zeros((n, 0, 6))
        mismatch = float(np.abs(unbalanced).max(initial=0.0))
        axes, rows = np.zeros((n, 0, 3, 3)), np.zeros((n, 0), dtype=np.bool_)
        return _ClosureForces(np.zeros((n, 0)), rows, none, none[:, None], none[..., :3], axes, mismatch)
    seen = loops.see(poses.q)
    J = seen.J
    decomposed = Decomposed.of(loops.scaled(J))
    ranks = decomposed.ranks
    multipliers = decomposed.carry(unbalanced * loops.column_scale, ranks) * loops.row_scale
    free_rows = decomposed.left_null(ranks)
    determinate_rows = np.linalg.norm(free_rows, axis=1) <= _OPEN
    determinate_rows.setflags(write=False)
    null = free_rows * loops.row_scale * loops.length  # (n, k, m)
    wrench, free = [], []
    for anchored in loops.anchored:
        T = seen.T[:, anchored.rows]
        wrench.append(np.einsum("nmi,nm->ni", T, multipliers[:, anchored.rows]))
        free.append(np.einsum("nmi,nkm->nki", T, null[:, :, anchored.rows]))
    places = [anchored.place(seen.pair(k)) for k, anchored in enumerate(loops.anchored)]
    return _ClosureForces(
        frozen(multipliers),
        determinate_rows,
        np.stack(wrench, axis=1),
        np.stack(free, axis=2),
        np.stack([point for point, _ in places], axis=1),
        np.stack([axes for _, axes in places], axis=1),
        float(np.abs(unbalanced - np.einsum("nmk,nm->nk", J, multipliers)).max(initial=0.0)),
    )


def determinate(free: Array) -> Array:
    """Return the projections (n, x, 3, 3) of forces onto what redundant closures leave alone.  free (n, k, x, 3)."""
    n, _, x, _ = free.shape
    if not free.any():
        return np.broadcast_to(np.eye(3), (n, x, 3, 3))
    _, size, axes = np.linalg.svd(np.swapaxes(free, 1, 2), full_matrices=False)
    lost = axes * (size > _OPEN)[..., None]
    return np.asarray(np.eye(3) - np.matmul(np.swapaxes(lost, -1, -2), lost))


def _carried(chain: ClosedChain, loops: Loops, bodies: Array, closures: Array) -> Array:
    """Return what every joint passes on (..., nb, 6) from what its bodies need and the closures (..., nc, 6) give."""
    needed = np.array(bodies)
    for k, anchored in enumerate(loops.anchored):
        for j, sign in zip(anchored.joints, (1.0, -1.0), strict=True):
            if j:
                needed[..., j - 1, :] += sign * closures[..., k, :]
    return _subtree(chain, needed)


def _seen(wrench: Array, slack: Array, point: Array, axes: Array, unit: Array) -> tuple[Array, Array]:
    """Move wrenches (n, x, 6) to their points, in world and in local axes; nan where slack (n, k, x, 6) reaches."""
    at, loose = _at_point(wrench, point), _at_point(slack, point[:, None])
    local, loose_local = _turned(at, axes), _turned(loose, axes[:, None])
    for values, free in ((at, loose), (local, loose_local)):
        values[np.linalg.norm(free, axis=1) > _OPEN * unit] = np.nan
    return frozen(at), frozen(local)


def _turned(wrench: Array, axes: Array) -> Array:
    """Return wrenches (..., 6) in the axes R (..., 3, 3)."""
    RT = np.swapaxes(axes, -1, -2)
    parts = [np.matmul(RT, wrench[..., k : k + 3, None])[..., 0] for k in (0, 3)]
    return np.concatenate(parts, axis=-1)


def _subtree(chain: ClosedChain, wrench: Array) -> Array:
    """Sum wrenches (..., nb, 6) at the world origin over everything a joint carries."""
    out = np.array(wrench)
    for j in range(chain.model.njoints - 1, 0, -1):
        parent = int(chain.model.parents[j])
        if parent:
            out[..., parent - 1, :] += out[..., j - 1, :]
    return out


def _at_point(wrench: Array, point: Array) -> Array:
    return np.concatenate([wrench[..., :3], wrench[..., 3:] - cross(point, wrench[..., :3])], axis=-1)
