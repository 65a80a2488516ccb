"""Pose and motion of any frame of a mechanism along a trajectory.

With the velocity (v_0, w) and acceleration (a_0, alpha) of the body at the world origin, and the frame's origin p,

    dp/dt = v_0 + w × p,        d2p/dt2 = a_0 + alpha × p + w × dp/dt
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable, cross, finite, frozen
from fivebar_pin.chain import ClosedChain, find_frame
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.trajectory import Trajectory

__all__ = ["FrameMotion", "frame_motion"]


@dataclass(frozen=True, slots=True, eq=False)
class FrameMotion(Immutable):
    """Motion of a frame, n samples, world axes.

    Attributes:
        position: of its origin (n, 3) [m].
        rotation: its axes as columns (n, 3, 3).
        velocity, acceleration: of its origin, first and second derivative of the position (n, 3) [m/s, m/s2].
        angular_velocity, angular_acceleration: of its body (n, 3) [rad/s, rad/s2].
    """

    position: Array
    rotation: Array
    velocity: Array
    acceleration: Array
    angular_velocity: Array
    angular_acceleration: Array


@finite(open=("N",))
def frame_motion(chain: ClosedChain, trajectory: Trajectory, frame: str) -> FrameMotion:
    """Return how a frame moves along a trajectory, for example the tool, or a point whose path matters.

    Args:
        chain: the mechanism.
        trajectory: of this chain, from `drive` or `simulate`.
        frame: its name; links and joints have frames of their own.

    Raises:
        UnknownNameError: there is no such frame.
        InvalidInputError: a trajectory of another mechanism.
    """
    trajectory.require_of(chain)
    found = find_frame(chain.model, frame)
    tree, j = loops_of(chain).tree, int(found.parentJoint)
    poses = tree.poses(trajectory.q)
    rates = tree.rates(trajectory.q, trajectory.v)
    p = poses.p[j] + np.matmul(poses.R[j], np.array(found.placement.translation))
    A = rates.A[j] + np.matmul(poses.S * tree.support[j], trajectory.a[..., None])[..., 0]
    w, alpha = rates.V[j][:, 3:], A[:, 3:]
    v = rates.V[j][:, :3] + cross(w, p)
    return FrameMotion(
        position=frozen(p),
        rotation=frozen(np.matmul(poses.R[j], np.array(found.placement.rotation))),
        velocity=frozen(v),
        acceleration=frozen(A[:, :3] + cross(alpha, p) + cross(w, v)),
        angular_velocity=frozen(w),
        angular_acceleration=frozen(alpha),
    )
