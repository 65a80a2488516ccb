"""Reactions of joints and closures as matrices times the inertial parameters.

What the motors do not carry of S^T f, the closures do: forces of least norm, from the pseudo-inverse of their
Jacobian. A joint carries its own body and all that hang on it. Components that the model leaves open are nan.
"""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import Array, skew
from fivebar_pin.balancing.regressors.body_motion import gravity_of, motion_of_bodies, torque_offset, tree_torque
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.elastic import body_wrenches
from fivebar_pin.mechanism.idle import at_rest, carried_by_rests
from fivebar_pin.mechanism.loops import Loops, loops_of
from fivebar_pin.mechanism.rank import Decomposed
from fivebar_pin.trajectory import Trajectory

__all__ = ["marked", "reaction_matrices"]


def reaction_matrices(chain: ClosedChain, trajectory: Trajectory) -> tuple[Array, Array]:
    """Return joint (n, nb, 6, 10 nb + 1) and closure (n, nc, 6, 10 nb + 1) reactions; the last column is the offset."""
    own, chain = len(chain.closures), at_rest(chain)
    loops, state = loops_of(chain), motion_of_bodies(chain, trajectory)
    n, nb = state.p.shape[:2]
    wrench = state.wrench(gravity_of(chain))
    tau = np.concatenate([tree_torque(state, wrench), torque_offset(chain, trajectory)[..., None]], axis=2)
    tau[:, loops.actuated] -= np.matmul(np.swapaxes(trajectory.N, 1, 2), tau)
    joint = np.zeros((n, nb, 6, tau.shape[2]))
    for b in range(nb):
        joint[:, b, :, 10 * b : 10 * (b + 1)] = wrench[:, b]
    if chain.springs:
        joint[..., -1] -= body_wrenches(chain, loops, trajectory.v, state.poses)
    closure = np.zeros((n, len(chain.closures), 6, tau.shape[2]))
    if loops.m:
        seen = loops.see(state.poses.q)
        multipliers = np.matmul(_multiplier_map(loops, seen.J), tau)
        for k, anchored in enumerate(loops.anchored):
            on_second = np.matmul(np.swapaxes(seen.T[:, anchored.rows], 1, 2), multipliers[:, anchored.rows])
            for j, sign in zip(anchored.joints, (1.0, -1.0), strict=True):
                if j:
                    joint[:, j - 1] += sign * on_second
            closure[:, k] = _at(on_second, anchored.place(seen.pair(k))[0])
    for j in range(nb, 0, -1):
        parent = int(chain.model.parents[j])
        if parent:
            joint[:, parent - 1] += joint[:, j - 1]
    joint = _at(joint, state.p)
    for k, j in carried_by_rests(chain):
        joint[:, j - 1] += closure[:, k]
    return joint, closure[:, :own]


def _multiplier_map(loops: Loops, J: Array) -> Array:
    """Return X (n, m, nv): closure forces of least norm = X @ unbalanced torque."""
    decomposed = Decomposed.of(loops.scaled(J), loops.misfit)
    return loops.scaled(decomposed.carrier(decomposed.ranks))


def _at(wrench: Array, point: Array) -> Array:
    """Move wrenches (..., 6, P) from the world origin to points (..., 3)."""
    moment = wrench[..., 3:, :] - np.matmul(skew(point), wrench[..., :3, :])
    return np.concatenate([wrench[..., :3, :], moment], axis=-2)


def marked(reaction: Array, direct: Array) -> tuple[Array, Array]:
    """Flatten reactions, with nan where the direct computation says that the model leaves them open."""
    Y = np.where(np.isnan(direct)[..., None], np.nan, reaction)
    Y = Y.reshape(Y.shape[0], -1, Y.shape[-1])
    return Y[..., :-1], Y[..., -1]
