"""Closure forces and joint reactions, with what the model leaves open marked as nan."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fivebar_pin import _bodies
from fivebar_pin import closures as rows
from fivebar_pin._arrays import Array, cross, frozen
from fivebar_pin._loops import RANK_TOLERANCE, Loops, loops_of
from fivebar_pin.chain import ClosedChain
from fivebar_pin.trajectory import Trajectory


@dataclass(frozen=True, slots=True, eq=False)
class Reactions:
    """Reactions along a trajectory, world axes.

    Attributes:
        multipliers: closure forces in the rows of J (n, m); of least norm where the closures are redundant.
        closure: wrench by body 1 on body 2 at the closure point (n, closures, 6) [N, N m].
        joint: wrench by the parent on the body of every joint, motor included, at the joint origin (n, nb, 6).
        bodies: momenta of the bodies and their rates.
        gravity, external: wrench on every body at the world origin (n, nb, 6).
        mismatch: largest unbalanced joint torque [N m or N]; round-off when the trajectory is consistent.

    Components of `closure` and `joint` that the closures do not determine (they depend on which of the redundant
    rows carries the load) are nan.
    """

    multipliers: Array
    closure: Array
    joint: Array
    bodies: _bodies.BodyRates
    gravity: Array
    external: Array
    mismatch: float


def reactions(
    chain: ClosedChain, trajectory: Trajectory, tree_torque: Array, torque: Array, external: Mapping[str, Array]
) -> Reactions:
    """Compute all reactions; see `Reactions`."""
    loops = loops_of(chain)
    tree, n = loops.tree, len(trajectory)
    poses = tree.poses(trajectory.q)
    rates = tree.rates(trajectory.q, trajectory.v, poses)
    bodies = _bodies.Bodies.of(chain)
    moving = _bodies.body_rates(tree, bodies, poses, rates, trajectory.a)
    gravity = _bodies.gravity_wrenches(bodies, moving.centre, np.array(chain.model.gravity.linear))
    applied = np.zeros_like(moving.rate)
    for name, wrench in external.items():
        frame = chain.model.frames[chain.model.getFrameId(name)]
        j = int(frame.parentJoint)
        if j:
            point = poses.p[j] + np.matmul(poses.R[j], np.array(frame.placement.translation))
            applied[:, j - 1] += _at_origin(wrench, point)
    unbalanced = np.array(tree_torque)
    unbalanced[:, loops.actuated] -= torque
    multipliers, wrenches, free = _closure_forces(loops, poses, unbalanced)
    left = moving.rate - gravity - applied
    closure, joint, mismatch = np.zeros((n, len(chain.closures), 6)), np.array(left), 0.0
    open_closure, open_joint = np.zeros_like(closure), np.zeros_like(joint)
    if loops.m:
        pairs = loops.pairs(poses)
        points = [pair.p2 for pair in pairs]
        for k, w in enumerate(wrenches):
            closure[:, k] = _at_point(w, points[k])
            open_closure[:, k] = np.linalg.norm(_at_point(free[k], points[k][:, None]), axis=1)
        mismatch = float(np.abs(unbalanced - np.einsum("nmk,nm->nk", loops.jacobian(poses, pairs), multipliers)).max())
    for k, anchored in enumerate(loops.anchored):
        for j, sign in zip(anchored.joints, (1.0, -1.0), strict=True):
            if j:
                joint[:, j - 1] += sign * wrenches[k]
    joint = _subtree(chain, joint)
    if loops.m and free[0].shape[1]:
        slack = np.zeros((n, free[0].shape[1], joint.shape[1], 6))
        for k, anchored in enumerate(loops.anchored):
            for j, sign in zip(anchored.joints, (1.0, -1.0), strict=True):
                if j:
                    slack[:, :, j - 1] += sign * free[k]
        slack = _subtree(chain, slack)
        origin = np.stack(poses.p[1:], axis=1)
        open_joint = np.linalg.norm(_at_point(slack, origin[:, None]), axis=1)
    joint = _at_point(joint, np.stack(poses.p[1:], axis=1))
    unit = np.r_[np.ones(3), np.full(3, chain.length)]
    closure[open_closure > 1e-9 * unit] = np.nan
    joint[open_joint > 1e-9 * unit] = np.nan
    return Reactions(frozen(multipliers), frozen(closure), frozen(joint), moving, gravity, applied, mismatch)


def _closure_forces(loops: Loops, poses: object, unbalanced: Array) -> tuple[Array, list[Array], list[Array]]:
    """Solve J^T lambda = unbalanced torque.

    Returns:
        lambda (n, m), the wrench on body 2 of every closure at the world origin (n, 6), and the wrenches (n, k, 6)
        that redundant closures could carry besides, for a basis of unit forces.
    """
    from fivebar_pin._tree import Poses

    assert isinstance(poses, Poses)
    n = unbalanced.shape[0]
    if not loops.m:
        return np.zeros((n, 0)), [], []
    pairs = loops.pairs(poses)
    J = loops.jacobian(poses, pairs) * loops.row_scale[:, None]
    U, s, Vt = np.linalg.svd(J * loops.column_scale, full_matrices=True)
    rank = int(np.min(np.sum(s > RANK_TOLERANCE * np.maximum(s[:, :1], 1e-300), axis=1)))
    inv = np.where(np.arange(s.shape[1]) < rank, 1.0 / np.where(s > 0.0, s, 1.0), 0.0)
    k = s.shape[1]
    loaded = np.matmul(Vt[:, :k], (unbalanced * loops.column_scale)[..., None])[..., 0] * inv
    multipliers = np.matmul(U[:, :, :k], loaded[..., None])[..., 0] * loops.row_scale
    null = np.swapaxes(U[:, :, rank:], 1, 2) * loops.row_scale * loops.length  # (n, k, m)
    wrenches, free = [], []
    for anchored, pair in zip(loops.anchored, pairs, strict=True):
        T = rows.selector(anchored.closure, pair)
        wrenches.append(np.einsum("nmi,nm->ni", T, multipliers[:, anchored.rows]))
        free.append(np.einsum("nmi,nkm->nki", T, null[:, :, anchored.rows]))
    return multipliers, wrenches, free


def _subtree(chain: ClosedChain, wrench: Array) -> Array:
    """Sum wrenches (..., nb, 6) at the world origin over everything a joint carries."""
    out = np.array(wrench)
    for j in range(chain.model.njoints - 1, 0, -1):
        parent = int(chain.model.parents[j])
        if parent:
            out[..., parent - 1, :] += out[..., j - 1, :]
    return out


def _at_origin(wrench: Array, point: Array) -> Array:
    return np.concatenate([wrench[..., :3], wrench[..., 3:] + cross(point, wrench[..., :3])], axis=-1)


def _at_point(wrench: Array, point: Array) -> Array:
    return np.concatenate([wrench[..., :3], wrench[..., 3:] - cross(point, wrench[..., :3])], axis=-1)
