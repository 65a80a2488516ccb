"""The open tree as a file states it: links, joints and the one way they hang together."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import Visual
from fivebar_pin.closures import Coupling
from fivebar_pin.io._xml import UNLIMITED

__all__ = ["UNIVERSE", "UNLIMITED", "JointEntry", "LinkEntry", "TreeEntry", "matrix_to_rpy", "rpy_to_matrix"]


UNIVERSE = "universe"
"""Pinocchio's name for the fixed world."""


@dataclass(frozen=True, slots=True, eq=False)
class LinkEntry:
    """A link: its inertia in link axes (None: massless) and what is drawn on it."""

    name: str
    inertia: pin.Inertia | None = None
    visuals: tuple[Visual, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class JointEntry:
    """A joint of the tree, with per-degree-of-freedom data where the kind has several.

    Attributes:
        kind: "revolute", "continuous", "prismatic", "fixed", "floating", "planar", or a sidecar word.
        placement: pose of the joint in the parent link, homogeneous (4, 4).
        axis: unit axis in the joint's own axes (3,).
        data: limits and losses by name, each a list per coordinate or degree of freedom.
        mimic: the coupling by which the file ties it to another joint, or None.
        offset: pose of the child link in the moved axes of the joint, homogeneous (4, 4).
    """

    name: str
    kind: str
    parent: str
    child: str
    placement: Array
    axis: Array
    data: dict[str, list[float]] = field(default_factory=dict)
    mimic: Coupling | None = None
    offset: Array = field(default_factory=lambda: np.eye(4))


@dataclass(frozen=True, slots=True, eq=False)
class TreeEntry:
    """A tree of links and joints with exactly one root, whose pose in the world is `placement` (4, 4)."""

    name: str
    root: str
    links: dict[str, LinkEntry]
    joints: dict[str, JointEntry]
    placement: Array = field(default_factory=lambda: np.eye(4))


def rpy_to_matrix(rpy: list[float]) -> Array:
    """Return R = Rz(yaw) Ry(pitch) Rx(roll); exactly the identity for zero angles."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def matrix_to_rpy(R: Array) -> list[float]:
    """Return angles that give R back to round-off, at the gimbal singularity too.

    Yaw is taken first and the roll is then read off in the yawed axes, so that near pitch = ±π/2, where the two
    are ill determined one by one, the error of one is made good by the other.
    """
    yaw = float(np.arctan2(R[1, 0], R[0, 0]))
    c, s = float(np.cos(yaw)), float(np.sin(yaw))
    pitch = float(np.arctan2(-R[2, 0], c * R[0, 0] + s * R[1, 0]))
    roll = float(np.arctan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1]))
    return [angle + 0.0 for angle in (roll, pitch, yaw)]
