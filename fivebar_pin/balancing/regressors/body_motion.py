"""Every body's own regressor: momentum, rate of momentum and weight as matrices times its ten parameters.

The formulas stand in `regressors`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable, cross, skew
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.bodies import accelerations
from fivebar_pin.dynamics.elastic import spring_forces
from fivebar_pin.dynamics.losses import friction_torque
from fivebar_pin.mechanism.loops import Loops, loops_of
from fivebar_pin.mechanism.tree import Poses
from fivebar_pin.trajectory import Trajectory

__all__ = [
    "BodyMotion",
    "gravity_of",
    "motion_of_bodies",
    "moved",
    "side_by_side",
    "torque_offset",
    "tree_torque",
    "turned",
]


@dataclass(frozen=True, slots=True, eq=False)
class BodyMotion(Immutable):
    """Motion of all bodies, world axes: R (n, nb, 3, 3), everything else (n, nb, 3) at the joint origins."""

    loops: Loops
    poses: Poses
    R: Array
    p: Array
    u: Array
    w: Array
    a: Array
    alpha: Array

    @staticmethod
    def of(loops: Loops, q: Array, v: Array, a: Array | None = None, poses: Poses | None = None) -> BodyMotion:
        """Compute it from q (n, nq), v, a (n, nv); without a, the accelerations are zero (momentum only)."""
        tree = loops.tree
        poses = tree.poses(q) if poses is None else poses
        rates = tree.rates(q, v)
        R, p, V = np.swapaxes(poses.R[1:], 0, 1), np.swapaxes(poses.p[1:], 0, 1), np.swapaxes(rates.V[1:], 0, 1)
        w = V[..., 3:]
        u = V[..., :3] + cross(w, p)
        if a is None:
            return BodyMotion(loops, poses, R, p, u, w, np.zeros_like(u), np.zeros_like(u))
        A = accelerations(tree, poses, rates, a)
        return BodyMotion(loops, poses, R, p, u, w, A[..., :3] + cross(A[..., 3:], p) + cross(w, u), A[..., 3:])

    def momentum(self) -> Array:
        """Return the momentum of each body at the world origin (n, nb, 6, 10)."""
        local = np.matmul(self.R, _inertia_times(turned(self.R, self.w)))
        return _block(self.u, np.matmul(skew(self.w), self.R), self.R, local, self.p)

    def wrench(self, gravity: Array) -> Array:
        """Return the rate of momentum less gravity of each body at the world origin (n, nb, 6, 10)."""
        w, alpha = turned(self.R, self.w), turned(self.R, self.alpha)
        local = np.matmul(self.R, _inertia_times(alpha) + np.matmul(skew(w), _inertia_times(w)))
        spin = skew(self.w)
        return _block(self.a - gravity, np.matmul(skew(self.alpha) + spin @ spin, self.R), self.R, local, self.p)

    def weight(self, gravity: Array) -> Array:
        """Return minus the gravity wrench of each body at the world origin (n, nb, 6, 10)."""
        zero = np.zeros(3)
        local = np.zeros((*self.R.shape[:2], 3, 6))
        return _block(np.broadcast_to(zero - gravity, self.u.shape), np.zeros_like(self.R), self.R, local, self.p)


def _block(m: Array, h: Array, R: Array, inertia: Array, p: Array) -> Array:
    """Assemble (n, nb, 6, 10): force columns m (.., 3) and h (.., 3, 3), moment R h x m + inertia, all moved by p."""
    Y = np.zeros((*m.shape[:-1], 6, 10))
    Y[..., :3, 0], Y[..., :3, 1:4] = m, h
    Y[..., 3:, 1:4] = -np.matmul(skew(m), R)
    Y[..., 3:, 4:] = inertia
    Y[..., 3:, :4] += np.matmul(skew(p), Y[..., :3, :4])
    return Y


def turned(R: Array, x: Array) -> Array:
    """Return R^T x (..., 3)."""
    return np.asarray(np.matmul(np.swapaxes(R, -1, -2), x[..., None])[..., 0])


def _inertia_times(x: Array) -> Array:
    """Return L (..., 3, 6) with I x = L (I_xx, I_xy, I_yy, I_xz, I_yz, I_zz)."""
    L = np.zeros((*x.shape[:-1], 3, 6))
    L[..., 0, 0] = L[..., 1, 1] = L[..., 2, 3] = x[..., 0]
    L[..., 0, 1] = L[..., 1, 2] = L[..., 2, 4] = x[..., 1]
    L[..., 0, 3] = L[..., 1, 4] = L[..., 2, 5] = x[..., 2]
    return L


def side_by_side(Y: Array) -> Array:
    """(n, nb, r, 10) -> (n, r, 10 nb)."""
    n, nb, r, _ = Y.shape
    return np.asarray(np.swapaxes(Y, 1, 2)).reshape(n, r, 10 * nb)


def motion_of_bodies(chain: ClosedChain, trajectory: Trajectory) -> BodyMotion:
    """Return the motion of all bodies along a trajectory."""
    return BodyMotion.of(loops_of(chain), trajectory.q, trajectory.v, trajectory.a)


def gravity_of(chain: ClosedChain) -> Array:
    """Return the acceleration of gravity (3,) [m/s2]."""
    return np.array(chain.model.gravity.linear)


def moved(Y: Array, about: Array) -> Array:
    """Return the moment rows of wrenches (n, 6, P) about a point."""
    return np.asarray(Y[:, 3:] - np.matmul(skew(about), Y[:, :3]))


def tree_torque(state: BodyMotion, wrench: Array) -> Array:
    """Return S^T wrench (n, nv, 10 nb) for wrenches of the bodies (n, nb, 6, 10) at the world origin."""
    carried = np.repeat(state.loops.tree.support[1:].T, 10, axis=1)  # (nv, 10 nb)
    return np.asarray(np.matmul(np.swapaxes(state.poses.S, 1, 2), side_by_side(wrench)) * carried)


def torque_offset(chain: ClosedChain, trajectory: Trajectory) -> Array:
    """Torque of armature, damping, dry friction and springs in the tree (n, nv)."""
    offset = np.array(chain.model.armature) * trajectory.a + friction_torque(chain, trajectory.v)
    if chain.springs:
        loops, q = loops_of(chain), trajectory.q
        offset = offset - spring_forces(chain, loops, q, trajectory.v, loops.tree.poses(q)).force
    return np.asarray(offset)
