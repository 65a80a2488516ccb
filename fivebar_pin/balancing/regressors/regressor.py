"""Regressors: momentum, forces, torques and energies as matrices times the inertial parameters.

For a body with joint origin p (velocity u, acceleration a_o, both classical), rotation R, angular velocity w and
acceleration alpha, and parameters m, h = m c, I about the joint origin, all sums are linear in (m, h, I):

    p_lin = m u + w x R h                       l_o = R h x u + R I R^T w
    f     = m (a_o - g) + (alpha x + w x w x) R h
    n_o   = R h x (a_o - g) + R (I R^T alpha + R^T w x I R^T w)          f_0, n_0: the same at g = 0
    E_kin = (u . p_lin + w . l_o) / 2           E_pot = -g . (m p + R h)

Moments move to another point by the lever times the force. With S_j the joint columns that carry the body and N the
complement, tau = sum N^T S_j^T [f; n]; the frame is shaken by -sum f_0 and carries -sum f. Armature, damping, dry
friction and springs do not depend on the parameters: they make the offset.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, checked, cross, finite, frozen, reals
from fivebar_pin.balancing.regressors.bearings import bearing_forces, by_bearing
from fivebar_pin.balancing.regressors.body_motion import (
    gravity_of,
    motion_of_bodies,
    moved,
    side_by_side,
    torque_offset,
    tree_torque,
    turned,
)
from fivebar_pin.balancing.regressors.quantity import Quantity, by_motor, deviation
from fivebar_pin.balancing.regressors.reaction_rows import marked, reaction_matrices
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.trajectory import Trajectory

__all__ = ["MEASURES", "QUANTITIES", "TABLE", "Regressor", "regressor"]


@dataclass(frozen=True, slots=True, eq=False)
class Regressor(Immutable):
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
        pi = reals("parameters", parameters)
        width = self.matrix.shape[2]
        if pi.ndim not in (2, 3) or pi.shape[-1] != 10 or pi.shape[-2] * 10 != width:
            raise InvalidInputError("shape of parameters", pi.shape, f"must be ({width // 10}, 10) or (k, .., 10)")
        if pi.ndim == 2:
            return np.asarray(self.matrix @ pi.reshape(-1) + self.offset)
        flat = pi.reshape(len(pi), -1)
        return np.asarray(np.einsum("nrp,kp->knr", self.matrix, flat, optimize=True) + self.offset)


@finite(open=("matrix", "offset"))
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
        quantity: one of `QUANTITIES`: linear_momentum, angular_momentum, shaking_force, shaking_moment, frame_force,
            frame_moment (3 rows each), torque, gravity_torque (na rows, the weight's alone: springs are in torque),
            potential_energy, kinetic_energy (1 row),
            joint_reactions (6 rows per body), closure_reactions (6 rows per closure). Signs, axes and meaning are
            those of `inverse_dynamics`: the rotors (armature) are in the torque alone.
        about: point that angular momentum, shaking and frame moment refer to (3,) [m], world.

    Raises:
        UnknownNameError: a quantity that does not exist.
        InvalidInputError: a trajectory of another mechanism.
    """
    build = TABLE[quantity].build if quantity in TABLE else None
    if build is None:
        raise UnknownNameError("quantity", quantity, QUANTITIES)
    trajectory.require_of(chain)
    matrix, offset = build(chain, trajectory, checked("about", about, (3,)))
    return Regressor(quantity, frozen(matrix), frozen(offset))


def _no_offset(matrix: Array) -> tuple[Array, Array]:
    return matrix, np.zeros(matrix.shape[:2])


def _rate(chain: ClosedChain, trajectory: Trajectory) -> Array:
    """Return the rate of momentum at the world origin (n, 6, 10 nb)."""
    return side_by_side(motion_of_bodies(chain, trajectory).wrench(np.zeros(3)))


def _linear_momentum(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return _no_offset(side_by_side(motion_of_bodies(chain, trajectory).momentum())[:, :3])


def _angular_momentum(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return _no_offset(moved(side_by_side(motion_of_bodies(chain, trajectory).momentum()), about))


def _shaking_force(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return _no_offset(-_rate(chain, trajectory)[:, :3])


def _shaking_moment(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return _no_offset(-moved(_rate(chain, trajectory), about))


def _frame_force(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return _no_offset(-side_by_side(motion_of_bodies(chain, trajectory).wrench(gravity_of(chain)))[:, :3])


def _frame_moment(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return _no_offset(-moved(side_by_side(motion_of_bodies(chain, trajectory).wrench(gravity_of(chain))), about))


def _torque(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    state, NT = motion_of_bodies(chain, trajectory), np.swapaxes(trajectory.N, 1, 2)
    offset = np.matmul(NT, torque_offset(chain, trajectory)[..., None])[..., 0]
    return np.matmul(NT, tree_torque(state, state.wrench(gravity_of(chain)))), offset


def _gravity_torque(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    state = motion_of_bodies(chain, trajectory)
    tau = tree_torque(state, state.weight(gravity_of(chain)))
    return _no_offset(np.matmul(np.swapaxes(trajectory.N, 1, 2), tau))


def _kinetic_energy(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    state = motion_of_bodies(chain, trajectory)
    twist = np.concatenate([state.u - cross(state.w, state.p), state.w], axis=-1)
    return _no_offset(side_by_side(0.5 * np.matmul(twist[..., None, :], state.momentum())))


def _potential_energy(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    state, g = motion_of_bodies(chain, trajectory), gravity_of(chain)
    Y = np.zeros((*state.p.shape[:2], 1, 10))
    Y[..., 0, 0] = -(state.p @ g)
    Y[..., 0, 1:4] = -turned(state.R, np.broadcast_to(g, state.p.shape))
    return _no_offset(side_by_side(Y))


def _joint_reactions(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return marked(reaction_matrices(chain, trajectory)[0], inverse_dynamics(chain, trajectory).joint_reactions)


def _closure_reactions(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
    return marked(reaction_matrices(chain, trajectory)[1], inverse_dynamics(chain, trajectory).closure_reactions)


TABLE: dict[str, Quantity] = {
    "torque": Quantity(_torque, _torque, by_motor),
    "shaking_force": Quantity(_shaking_force, _shaking_force),
    "shaking_moment": Quantity(_shaking_moment, _shaking_moment),
    "frame_force": Quantity(_frame_force, _frame_force),
    "frame_moment": Quantity(_frame_moment, _frame_moment),
    "bearing_force": Quantity(None, bearing_forces, by_bearing),
    "angular_momentum": Quantity(_angular_momentum, deviation(_angular_momentum)),
    "linear_momentum": Quantity(_linear_momentum),
    "gravity_torque": Quantity(_gravity_torque),
    "potential_energy": Quantity(_potential_energy),
    "kinetic_energy": Quantity(_kinetic_energy),
    "joint_reactions": Quantity(_joint_reactions),
    "closure_reactions": Quantity(_closure_reactions),
}  # a new quantity is one entry here
QUANTITIES = tuple(name for name, quantity in TABLE.items() if quantity.build is not None)
MEASURES = tuple(name for name, quantity in TABLE.items() if quantity.judged is not None)
