"""Constrained inverse dynamics.

With the open tree's inverse dynamics tau_t = M a + h (Pinocchio's recursive Newton-Euler) and the complement N,

    tau = N^T tau_t                                  the closure forces do no work           [Angeles and Lee 1988]
    J^T lambda = tau_t - S^T tau                     closure forces from the passive rows
    F = -dp/dt,        M_O = -dH_O/dt                shaking force and moment: inertia alone
    F + m g + f_e,     M_O + c x m g + m_e           frame force and moment: weight and applied forces besides

Frame force and moment are all that the mechanism exerts on the frame; motors and springs are internal to it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import checked, finite, frozen
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.elastic import spring_forces
from fivebar_pin.dynamics.loads import Loads
from fivebar_pin.dynamics.losses import friction_torque
from fivebar_pin.dynamics.recursion import hanging_tree
from fivebar_pin.dynamics.wrenches import about_point, checked_wrenches, moved_to_origin
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.trajectory import Trajectory

__all__ = ["inverse_dynamics"]


@finite(open=("N", "torque"))
def inverse_dynamics(
    chain: ClosedChain,
    trajectory: Trajectory,
    *,
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
    external: Mapping[str, npt.ArrayLike] | None = None,
) -> Loads:
    """Compute the actuated torques, what shakes the frame and what it carries along a trajectory.

    Gravity, armature, viscous damping, dry friction and springs are taken from the chain. Springs belong to the
    mechanism: what one that is anchored in the ground pulls there is part of the force on the frame, which is
    -dp/dt + m g with springs as without; they change the torques and the reactions.

    Args:
        chain: the mechanism.
        trajectory: consistent motion, from `drive` or `simulate`.
        about: point (3,) that shaking and frame moment refer to [m], world.
        external: forces applied from outside: frame name -> wrench (n, 6) or (6,), force [N] and moment [N m] in
            world axes at the frame's origin.

    Returns:
        The loads; reactions, energies and centre of mass are computed when asked for.

    Raises:
        InvalidInputError: a trajectory of another mechanism, wrong shapes.
        UnknownNameError: an external force on a frame that does not exist.
        SolverError: a spring whose ends meet has a force of no direction.
    """
    n = len(trajectory)
    trajectory.require_of(chain)
    point = checked("about", about, (3,))
    wrench, tree_torque = hanging_tree(chain).inertia(trajectory.q, trajectory.v, trajectory.a)
    shaking, carried = -wrench, np.zeros_like(wrench)
    gravity = np.array(chain.model.gravity.linear)
    if gravity.any():
        weight, weight_torque = hanging_tree(chain).weight(trajectory.q, gravity)
        carried -= weight
        tree_torque += weight_torque
    tree_torque += friction_torque(chain, trajectory.v)
    applied = checked_wrenches(chain, external, n)
    if chain.springs:
        loops = loops_of(chain)
        poses = loops.tree.poses(trajectory.q)
        tree_torque -= spring_forces(chain, loops, trajectory.q, trajectory.v, poses).force
    if applied:
        tree = loops_of(chain).tree
        poses = tree.poses(trajectory.q)
        acting = moved_to_origin(chain, poses, applied)
        tree_torque -= np.sum(acting.torques(tree, poses), axis=0)
        carried += acting.total
    torque = np.matmul(np.swapaxes(trajectory.N, 1, 2), tree_torque[..., None])[..., 0]
    frame = shaking + carried
    return Loads(
        torque=frozen(torque),
        shaking_force=frozen(shaking[:, :3]),
        shaking_moment=frozen(about_point(point, shaking)),
        frame_force=frozen(frame[:, :3]),
        frame_moment=frozen(about_point(point, frame)),
        about=point,
        chain=chain,
        trajectory=trajectory,
        tree_torque=frozen(tree_torque),
        external=applied,
    )
