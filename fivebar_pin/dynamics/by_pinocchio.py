"""Inverse dynamics by Pinocchio's recursive Newton-Euler algorithm on the open tree, over a batch."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fivebar_pin._arrays import Array, finite, frozen
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.elastic import spring_forces
from fivebar_pin.dynamics.loads import Loads
from fivebar_pin.dynamics.losses import friction_torque
from fivebar_pin.dynamics.recursion import hanging_tree
from fivebar_pin.dynamics.wrenches import about_point, moved_to_origin
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.trajectory import Trajectory

__all__ = ["by_pinocchio"]


@finite(open=("N", "torque"))
def by_pinocchio(
    chain: ClosedChain, trajectory: Trajectory, about: Array, external: Mapping[str, Array], threads: int | None
) -> Loads:
    """Return the loads along a trajectory; see `inverse_dynamics`."""
    tree = hanging_tree(chain)
    wrench, tree_torque = tree.inertia(trajectory.q, trajectory.v, trajectory.a, threads)
    shaking, carried = -wrench, np.zeros_like(wrench)
    gravity = np.array(chain.model.gravity.linear)
    if gravity.any():
        weight, weight_torque = tree.weight(trajectory.q, gravity, threads)
        carried -= weight
        tree_torque += weight_torque
    tree_torque += friction_torque(chain, trajectory.v)
    if chain.springs:
        loops = loops_of(chain)
        poses = loops.tree.poses(trajectory.q)
        tree_torque -= spring_forces(chain, loops, trajectory.q, trajectory.v, poses).force
    if external:
        loops = loops_of(chain)
        poses = loops.tree.poses(trajectory.q)
        acting = moved_to_origin(chain, poses, external)
        tree_torque -= np.sum(acting.torques(loops.tree, poses), axis=0)
        carried += acting.total
    torque = np.matmul(np.swapaxes(trajectory.N, 1, 2), tree_torque[..., None])[..., 0]
    frame = shaking + carried
    return Loads(
        torque=frozen(torque),
        shaking_force=frozen(shaking[:, :3]),
        shaking_moment=frozen(about_point(about, shaking)),
        frame_force=frozen(frame[:, :3]),
        frame_moment=frozen(about_point(about, frame)),
        about=about,
        chain=chain,
        trajectory=trajectory,
        tree_torque=frozen(tree_torque),
        external=external,
    )
