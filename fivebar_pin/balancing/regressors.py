"""Regressors: momentum, forces, torques and energies as matrices times the inertial parameters.

For a body with joint origin p (velocity u, acceleration a_o, both classical), rotation R, angular velocity w and
acceleration alpha, and parameters m, h = m c, I about the joint origin, all sums are linear in (m, h, I):

    p_lin = m u + w x R h                       l_o = R h x u + R I R^T w
    f     = m (a_o - g) + (alpha x + w x w x) R h
    n_o   = R h x (a_o - g) + R (I R^T alpha + R^T w x I R^T w)
    E_kin = (u . p_lin + w . l_o) / 2           E_pot = -g . (m p + R h)

Moments move to another point by the lever times the force. With S_j the joint columns that carry the body and N the
complement, tau = sum N^T S_j^T [f; n] and F = -sum f. Armature, damping and dry friction do not depend on the
parameters: they make the offset.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin import closures as closure_rows
from fivebar_pin._arrays import Array, checked, cross, frozen, skew
from fivebar_pin._bodies import accelerations
from fivebar_pin._loops import RANK_TOLERANCE, Loops, loops_of
from fivebar_pin._tree import Poses
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics import friction_torque, inverse_dynamics
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.trajectory import Trajectory

__all__ = ["QUANTITIES", "Regressor", "regressor"]


@dataclass(frozen=True, slots=True, eq=False)
class Regressor:
    """One quantity as matrix times inertial parameters, plus what does not depend on them.

    Attributes:
        quantity: its name.
        matrix: (n, rows, 10 nb); columns body by body in the order of `chain.inertial_parameters`. Rows that the model
            leaves open (reactions of redundant closures) are nan.
        offset: (n, rows).
    """

    quantity: str
    matrix: Array
    offset: Array

    def __call__(self, parameters: npt.ArrayLike) -> Array:
        """Return the quantity (n, rows) for inertial parameters (nb, 10), or (k, n, rows) for (k, nb, 10)."""
        pi = np.asarray(parameters, dtype=np.float64)
        width = self.matrix.shape[2]
        if pi.ndim not in (2, 3) or pi.shape[-1] != 10 or pi.shape[-2] * 10 != width:
            raise InvalidInputError("shape of parameters", pi.shape, f"must be ({width // 10}, 10) or (k, .., 10)")
        if pi.ndim == 2:
            return np.asarray(self.matrix @ pi.reshape(-1) + self.offset)
        flat = pi.reshape(len(pi), -1)
        return np.asarray(np.einsum("nrp,kp->knr", self.matrix, flat, optimize=True) + self.offset)


@dataclass(frozen=True, slots=True, eq=False)
class State:
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
    def of(loops: Loops, q: Array, v: Array, a: Array | None = None, poses: Poses | None = None) -> State:
        """Compute it from q (n, nq), v, a (n, nv); without a, the accelerations are zero (momentum only)."""
        tree = loops.tree
        poses = tree.poses(q) if poses is None else poses
        rates = tree.rates(q, v, poses)
        R, p, V = np.stack(poses.R[1:], axis=1), np.stack(poses.p[1:], axis=1), np.stack(rates.V[1:], axis=1)
        w = V[..., 3:]
        u = V[..., :3] + cross(w, p)
        if a is None:
            return State(loops, poses, R, p, u, w, np.zeros_like(u), np.zeros_like(u))
        A = accelerations(tree, poses, rates, a)
        return State(loops, poses, R, p, u, w, A[..., :3] + cross(A[..., 3:], p) + cross(w, u), A[..., 3:])

    def momentum(self) -> Array:
        """Return the momentum of each body at the world origin (n, nb, 6, 10)."""
        local = np.matmul(self.R, _inertia_times(_turned(self.R, self.w)))
        return _block(self.u, np.matmul(skew(self.w), self.R), self.R, local, self.p)

    def wrench(self, gravity: Array) -> Array:
        """Return the rate of momentum less gravity of each body at the world origin (n, nb, 6, 10)."""
        w, alpha = _turned(self.R, self.w), _turned(self.R, self.alpha)
        local = np.matmul(self.R, _inertia_times(alpha) + np.matmul(skew(w), _inertia_times(w)))
        spin = skew(self.w)
        return _block(self.a - gravity, np.matmul(skew(self.alpha) + spin @ spin, self.R), self.R, local, self.p)

    def weight(self, gravity: Array) -> Array:
        """Return minus the gravity wrench of each body at the world origin (n, nb, 6, 10)."""
        zero = np.zeros(3)
        local = np.zeros((*self.R.shape[:2], 3, 6))
        return _block(np.broadcast_to(zero - gravity, self.u.shape), np.zeros_like(self.R), self.R, local, self.p)


def regressor(
    chain: ClosedChain,
    trajectory: Trajectory,
    quantity: str,
    *,
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
) -> Regressor:
    """Return the matrix that maps the inertial parameters to a quantity along a trajectory.

    Args:
        chain: the mechanism; its present inertial parameters play no part.
        trajectory: of this chain.
        quantity: one of `QUANTITIES`: linear_momentum, angular_momentum, shaking_force, shaking_moment (3 rows each),
            torque, gravity_torque (na rows), potential_energy, kinetic_energy (1 row), joint_reactions (6 rows per
            body), closure_reactions (6 rows per closure). Signs and axes are those of `inverse_dynamics`.
        about: point that angular momentum and shaking moment refer to (3,) [m], world.

    Raises:
        UnknownNameError: a quantity that does not exist.
        InvalidInputError: a trajectory of another mechanism.
    """
    if quantity not in _BUILDERS:
        raise UnknownNameError("quantity", quantity, QUANTITIES)
    n = len(trajectory)
    if trajectory.q.shape != (n, chain.nq) or trajectory.N.shape != (n, chain.nv, chain.na):
        raise InvalidInputError(
            "trajectory",
            f"q {trajectory.q.shape}, N {trajectory.N.shape}",
            f"must belong to this chain: q ({n}, {chain.nq}), N ({n}, {chain.nv}, {chain.na})",
        )
    matrix, offset = _BUILDERS[quantity](chain, trajectory, checked("about", about, (3,)))
    return Regressor(quantity, frozen(matrix), frozen(offset))


def _block(m: Array, h: Array, R: Array, inertia: Array, p: Array) -> Array:
    """Assemble (n, nb, 6, 10): force columns m (.., 3) and h (.., 3, 3), moment R h x m + inertia, all moved by p."""
    Y = np.zeros((*m.shape[:-1], 6, 10))
    Y[..., :3, 0], Y[..., :3, 1:4] = m, h
    Y[..., 3:, 1:4] = -np.matmul(skew(m), R)
    Y[..., 3:, 4:] = inertia
    Y[..., 3:, :4] += np.matmul(skew(p), Y[..., :3, :4])
    return Y


def _turned(R: Array, x: Array) -> Array:
    return np.asarray(np.matmul(np.swapaxes(R, -1, -2), x[..., None])[..., 0])


def _inertia_times(x: Array) -> Array:
    """Return L (..., 3, 6) with I x = L (I_xx, I_xy, I_yy, I_xz, I_yz, I_zz)."""
    L = np.zeros((*x.shape[:-1], 3, 6))
    L[..., 0, 0] = L[..., 1, 1] = L[..., 2, 3] = x[..., 0]
    L[..., 0, 1] = L[..., 1, 2] = L[..., 2, 4] = x[..., 1]
    L[..., 0, 3] = L[..., 1, 4] = L[..., 2, 5] = x[..., 2]
    return L


def _side_by_side(Y: Array) -> Array:
    """(n, nb, r, 10) -> (n, r, 10 nb)."""
    n, nb, r, _ = Y.shape
    return np.asarray(np.swapaxes(Y, 1, 2)).reshape(n, r, 10 * nb)


def _state(chain: ClosedChain, trajectory: Trajectory) -> State:
    return State.of(loops_of(chain), trajectory.q, trajectory.v, trajectory.a)


def _gravity(chain: ClosedChain) -> Array:
    return np.array(chain.model.gravity.linear)


def _no_offset(matrix: Array) -> tuple[Array, Array]:
    return matrix, np.zeros(matrix.shape[:2])


def _moved(Y: Array, about: Array) -> Array:
    """Return the moment rows of wrenches (n, 6, P) about a point."""
    return np.asarray(Y[:, 3:] - np.matmul(skew(about), Y[:, :3]))


def _linear_momentum(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return _no_offset(_side_by_side(_state(chain, trajectory).momentum())[:, :3])


def _angular_momentum(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return _no_offset(_moved(_side_by_side(_state(chain, trajectory).momentum()), about))


def _shaking_force(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return _no_offset(-_side_by_side(_state(chain, trajectory).wrench(_gravity(chain)))[:, :3])


def _shaking_moment(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return _no_offset(-_moved(_side_by_side(_state(chain, trajectory).wrench(_gravity(chain))), about))


def tree_torque(state: State, wrench: Array) -> Array:
    """Return S^T wrench (n, nv, 10 nb) for wrenches of the bodies (n, nb, 6, 10) at the world origin."""
    carried = np.repeat(state.loops.tree.support[1:].T, 10, axis=1)  # (nv, 10 nb)
    return np.asarray(np.matmul(np.swapaxes(state.poses.S, 1, 2), _side_by_side(wrench)) * carried)


def _torque_offset(chain: ClosedChain, trajectory: Trajectory) -> Array:
    """Torque of armature, damping and dry friction in the tree (n, nv)."""
    return np.asarray(np.array(chain.model.armature) * trajectory.a + friction_torque(chain, trajectory.v))


def _torque(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    state, NT = _state(chain, trajectory), np.swapaxes(trajectory.N, 1, 2)
    offset = np.matmul(NT, _torque_offset(chain, trajectory)[..., None])[..., 0]
    return np.matmul(NT, tree_torque(state, state.wrench(_gravity(chain)))), offset


def _gravity_torque(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    state = _state(chain, trajectory)
    tau = tree_torque(state, state.weight(_gravity(chain)))
    return _no_offset(np.matmul(np.swapaxes(trajectory.N, 1, 2), tau))


def _kinetic_energy(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    state = _state(chain, trajectory)
    twist = np.concatenate([state.u - cross(state.w, state.p), state.w], axis=-1)
    return _no_offset(_side_by_side(0.5 * np.matmul(twist[..., None, :], state.momentum())))


def _potential_energy(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    state, g = _state(chain, trajectory), _gravity(chain)
    Y = np.zeros((*state.p.shape[:2], 1, 10))
    Y[..., 0, 0] = -(state.p @ g)
    Y[..., 0, 1:4] = -_turned(state.R, np.broadcast_to(g, state.p.shape))
    return _no_offset(_side_by_side(Y))


def _reactions(chain: ClosedChain, trajectory: Trajectory) -> tuple[Array, Array]:
    """Return joint (n, nb, 6, 10 nb + 1) and closure (n, nc, 6, 10 nb + 1) reactions; the last column is the offset."""
    loops, state = loops_of(chain), _state(chain, trajectory)
    n, nb = state.p.shape[:2]
    wrench = state.wrench(_gravity(chain))
    tau = np.concatenate([tree_torque(state, wrench), _torque_offset(chain, trajectory)[..., None]], axis=2)
    tau[:, loops.actuated] -= np.matmul(np.swapaxes(trajectory.N, 1, 2), tau)
    joint = np.zeros((n, nb, 6, tau.shape[2]))
    for b in range(nb):
        joint[:, b, :, 10 * b : 10 * (b + 1)] = wrench[:, b]
    closure = np.zeros((n, len(chain.closures), 6, tau.shape[2]))
    if loops.m:
        pairs = loops.pairs(state.poses)
        multipliers = np.matmul(_multiplier_map(loops, loops.jacobian(state.poses, pairs)), tau)
        for k, (anchored, pair) in enumerate(zip(loops.anchored, pairs, strict=True)):
            T = closure_rows.selector(anchored.closure, pair)
            on_second = np.matmul(np.swapaxes(T, 1, 2), multipliers[:, anchored.rows])
            for j, sign in zip(anchored.joints, (1.0, -1.0), strict=True):
                if j:
                    joint[:, j - 1] += sign * on_second
            closure[:, k] = _at(on_second, pair.p2)
    for j in range(nb, 0, -1):
        parent = int(chain.model.parents[j])
        if parent:
            joint[:, parent - 1] += joint[:, j - 1]
    return _at(joint, state.p), closure


def _multiplier_map(loops: Loops, J: Array) -> Array:
    """Return X (n, m, nv): closure forces of least norm = X @ unbalanced torque."""
    U, s, Vt = np.linalg.svd(J * loops.row_scale[:, None] * loops.column_scale, full_matrices=False)
    rank = int(np.min(np.sum(s > RANK_TOLERANCE * np.maximum(s[:, :1], 1e-300), axis=1)))
    inverse = np.where(np.arange(s.shape[1]) < rank, 1.0 / np.where(s > 0.0, s, 1.0), 0.0)
    return np.asarray(np.matmul(U * inverse[:, None, :], Vt) * loops.row_scale[:, None] * loops.column_scale)


def _at(wrench: Array, point: Array) -> Array:
    """Move wrenches (..., 6, P) from the world origin to points (..., 3)."""
    moment = wrench[..., 3:, :] - np.matmul(skew(point), wrench[..., :3, :])
    return np.concatenate([wrench[..., :3, :], moment], axis=-2)


def _marked(reaction: Array, direct: Array) -> tuple[Array, Array]:
    """Flatten reactions, with nan where the direct computation says that the model leaves them open."""
    Y = np.where(np.isnan(direct)[..., None], np.nan, reaction)
    Y = Y.reshape(Y.shape[0], -1, Y.shape[-1])
    return Y[..., :-1], Y[..., -1]


def _joint_reactions(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return _marked(_reactions(chain, trajectory)[0], inverse_dynamics(chain, trajectory).joint_reactions)


def _closure_reactions(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return _marked(_reactions(chain, trajectory)[1], inverse_dynamics(chain, trajectory).closure_reactions)


_BUILDERS: dict[str, Callable[[ClosedChain, Trajectory, Array], tuple[Array, Array]]] = {
    "linear_momentum": _linear_momentum,
    "angular_momentum": _angular_momentum,
    "shaking_force": _shaking_force,
    "shaking_moment": _shaking_moment,
    "torque": _torque,
    "gravity_torque": _gravity_torque,
    "potential_energy": _potential_energy,
    "kinetic_energy": _kinetic_energy,
    "joint_reactions": _joint_reactions,
    "closure_reactions": _closure_reactions,
}
QUANTITIES = tuple(_BUILDERS)
