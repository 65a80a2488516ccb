"""Geometry of a moving mechanism, as a viewer needs it: poses, points of each body, plane of motion.

Everything here is in metres, in the axes of the world, and independent of how it is drawn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array, checked
from fivebar_pin.chain import find_frame
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.mechanism.plane import plane_normal
from fivebar_pin.springs import Spring

if TYPE_CHECKING:
    from fivebar_pin.chain import ClosedChain
    from fivebar_pin.trajectory import Trajectory

__all__ = [
    "BodyPaths",
    "JointShape",
    "View",
    "body_points",
    "compute_poses",
    "find_view",
    "joint_shapes",
    "spring_ends",
]

_SAME = 1e-9  # distance of points that are one [of the body, and for its size at least so many m]
_ALONG = 1e-9  # component that counts as none [-]


@dataclass(frozen=True, slots=True, eq=False)
class BodyPaths:
    """Where every body is at every sample.

    Attributes:
        t: times (n,) [s].
        joints: pose of each joint frame, the universe first (n, njoints, 4, 4).
        com: total centre of mass (n, 3) [m]; empty (0, 3) when nothing has mass.
    """

    t: Array
    joints: Array
    com: Array


@dataclass(frozen=True, slots=True, eq=False)
class JointShape:
    """What a joint looks like: "hinge" or "slide" along a unit axis of its own frame, "ball" (axis unused), "free"."""

    kind: str
    axis: Array


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """Axes of the picture.

    Attributes:
        right: unit vector that points right on the screen (3,).
        up: unit vector that points up (3,).
        planar: whether all motion is in the plane of right and up.
    """

    right: Array
    up: Array
    planar: bool

    @property
    def normal(self) -> Array:
        """Unit vector towards the viewer (3,)."""
        return np.asarray(np.cross(self.right, self.up))


def compute_poses(chain: ClosedChain, trajectory: Trajectory) -> BodyPaths:
    """Return the forward kinematics of all samples.

    Raises:
        InvalidInputError: a trajectory that is not one of this chain, or holds no sample.
    """
    t = checked("trajectory.t", trajectory.t, (None,))
    if t.size == 0:
        raise InvalidInputError("trajectory", "no samples", "must hold at least one sample to be shown")
    q = checked("trajectory.q", trajectory.q, (t.size, chain.nq))
    model, data = chain.model, chain.model.createData()
    joints = np.empty((t.size, model.njoints, 4, 4))
    heavy = chain.mass > 0.0
    com = np.empty((t.size if heavy else 0, 3))
    for k, row in enumerate(q):
        pin.forwardKinematics(model, data, np.array(row))
        for j, placement in enumerate(data.oMi):
            joints[k, j] = placement.homogeneous
        if heavy:
            com[k] = pin.centerOfMass(model, data, False)
    return BodyPaths(t, joints, com)


def joint_shapes(chain: ClosedChain, q: Array) -> tuple[JointShape, ...]:
    """Return the shape of every joint (the universe left out) from its motion subspace."""
    model, data = chain.model, chain.model.createData()
    pin.computeJointJacobians(model, data, np.array(q))
    shapes = []
    for j in range(1, model.njoints):
        first, width = model.idx_vs[j], model.nvs[j]
        J = pin.getJointJacobian(model, data, j, pin.ReferenceFrame.LOCAL)
        S = np.reshape(J, (6, model.nv))[:, first : first + width]  # a single column comes back flat
        shapes.append(_shape_of(S))
    return tuple(shapes)


def _shape_of(S: Array) -> JointShape:
    """Return the shape of a joint with motion subspace S (6, nv of the joint), linear before angular."""
    turns, slides = np.linalg.norm(S[3:], axis=0), np.linalg.norm(S[:3], axis=0)
    if S.shape[1] == 1:
        column = S[3:, 0] if turns[0] > 0.0 else S[:3, 0]
        return JointShape("hinge" if turns[0] > 0.0 else "slide", column / np.linalg.norm(column))
    if np.any(slides > 0.0):
        return JointShape("free", np.array([0.0, 0.0, 1.0]))
    return JointShape("ball", np.array([0.0, 0.0, 1.0]))


def body_points(chain: ClosedChain, joint: int) -> Array:
    """Return the points (k, 3) [m] that the body of a joint connects, in its own frame, its own joint first.

    These are the joints it carries and its closure frames; for the last body of a branch the farthest frame
    on it, or its mass centre when there is none. The ends of springs on it come last.
    """
    model = chain.model
    points = [np.zeros(3)]
    points += [np.array(model.jointPlacements[k].translation) for k in model.children[joint]]
    for closure in chain.closures:
        for name in closure.ends:
            frame = find_frame(model, name)
            if frame.parentJoint == joint:
                points.append(np.array(frame.placement.translation))
    if len(points) == 1:
        ends = [np.array(f.placement.translation) for f in model.frames if f.parentJoint == joint]
        ends.append(np.array(model.inertias[joint].lever))
        tip = max(ends, key=lambda p: float(np.linalg.norm(p)))
        points.append(tip)
    held = [f for s in chain.springs if isinstance(s, Spring) for f in (s.frame1, s.frame2)]
    frames = [find_frame(model, name) for name in held]
    points += [np.array(f.placement.translation) for f in frames if f.parentJoint == joint]
    return _distinct(np.array(points))


def spring_ends(chain: ClosedChain, spring: Spring, joints: Array) -> tuple[Array, Array]:
    """Return where the ends of a spring are (n, 3) each [m], from the poses of the joint frames (n, njoints, 4, 4)."""
    frames = (find_frame(chain.model, name) for name in (spring.frame1, spring.frame2))
    first, second = (joints[:, f.parentJoint] @ f.placement.homogeneous for f in frames)
    return first[:, :3, 3], second[:, :3, 3]


def _distinct(points: Array) -> Array:
    """Return the points without repetitions, in their order."""
    kept: list[Array] = []
    tolerance = _SAME * max(float(np.max(np.abs(points))), _SAME)
    for point in points:
        if all(float(np.linalg.norm(point - other)) > tolerance for other in kept):
            kept.append(point)
    return np.array(kept)


def find_view(chain: ClosedChain, q: Array) -> View:
    """Return the axes of the picture: onto the plane of motion when there is one, else the usual upright axes."""
    gravity = np.asarray(chain.model.gravity.linear, dtype=np.float64)
    against = [-gravity / np.linalg.norm(gravity)] if np.linalg.norm(gravity) > 0.0 else []
    normal = plane_normal(loops_of(chain).tree.poses(np.array(q)[None]).S, chain.length)
    x, y, z = np.eye(3)
    if normal is None:
        up = against[0] if against else z
        right = x if abs(up @ x) < 0.9 else y
        right = right - (right @ up) * up
        return View(right / np.linalg.norm(right), up, planar=False)
    # The first of these that lies well within the plane is up: against gravity, then z, then y.
    up = next(u for u in [*against, z, y] if np.linalg.norm(np.cross(u, normal)) > 0.5)
    up = up - (up @ normal) * normal
    up /= np.linalg.norm(up)
    right = np.cross(up, normal)
    # Of the two sides of the plane, look from the one that has x (else y) to the right.
    facing = right[0] if abs(right[0]) > _ALONG else right[1]
    return View(right * np.sign(facing or 1.0), up, planar=True)
