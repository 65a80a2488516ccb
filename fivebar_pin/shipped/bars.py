"""Building blocks of the mechanisms that ship: aluminium bars on revolute and prismatic joints."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain, Visual
from fivebar_pin.closures import Closure

__all__ = ["Mechanism", "dyad", "universal_angles", "wrapped"]

ALUMINIUM = 2700.0
"""Density [kg/m3]."""
WIDE = 1e4
"""Joint limit of a joint that may turn many times [rad]."""
_COLOURS = (
    (0.16, 0.44, 0.70, 1.0),
    (0.90, 0.62, 0.10, 1.0),
    (0.34, 0.62, 0.32, 1.0),
    (0.76, 0.30, 0.28, 1.0),
    (0.50, 0.36, 0.66, 1.0),
    (0.36, 0.56, 0.60, 1.0),
)


class Mechanism:
    """An open tree under construction; `chain` closes it."""

    def __init__(self, name: str, *, gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)) -> None:
        self.model = pin.Model()
        self.model.name = name
        self.model.gravity.linear = np.array(gravity)
        self.visuals: list[Visual] = []
        self.model.addBodyFrame("ground", 0, pin.SE3.Identity(), 0)

    def joint(
        self,
        name: str,
        parent: str = "",
        *,
        at: npt.ArrayLike = (0.0, 0.0, 0.0),
        axes: npt.ArrayLike | None = None,
        kind: object = None,
        limit: float = WIDE,
    ) -> None:
        """Add a joint, and a massless link named after it, on another joint's link.

        Args:
            name: of the joint; its link is `name`_link.
            parent: joint whose link carries it; "" is the ground.
            at: position (3,) in the parent's axes [m].
            axes: rotation matrix (3, 3) of the joint's axes in the parent's.
            kind: Pinocchio's joint; about z when None.
            limit: bound of the coordinate, on both sides [rad or m].
        """
        model = self.model
        R = np.eye(3) if axes is None else np.array(axes, dtype=np.float64)
        placement = pin.SE3(R, np.array(at, dtype=np.float64))
        j = model.addJoint(model.getJointId(parent) if parent else 0, kind or pin.JointModelRZ(), placement, name)
        model.lowerPositionLimit[model.idx_qs[j]], model.upperPositionLimit[model.idx_qs[j]] = -limit, limit
        model.addJointFrame(j, -1)
        model.addBodyFrame(f"{name}_link", j, pin.SE3.Identity(), -1)

    def box(self, joint: str, start: npt.ArrayLike, end: npt.ArrayLike, *, width: float, thickness: float) -> None:
        """Add a bar of aluminium between two points of a joint's link, as a mass and as a visual."""
        a, b = np.array(start, dtype=np.float64), np.array(end, dtype=np.float64)
        length = float(np.linalg.norm(b - a))
        size = (length, width, thickness)
        inertia = pin.Inertia.FromBox(ALUMINIUM * length * width * thickness, *size)
        placement = pin.SE3(_along((b - a) / length), 0.5 * (a + b))
        self.model.appendBodyToJoint(self.model.getJointId(joint), inertia, placement)
        self.draw(joint, "box", size, np.array(placement.homogeneous))

    def draw(self, joint: str, shape: str, size: tuple[float, ...], placement: Array) -> None:
        """Add a visual to a joint's link, in the joint's own colour."""
        colour = _COLOURS[(self.model.getJointId(joint) - 1) % len(_COLOURS)]
        self.visuals.append(Visual(f"{joint}_link", shape, size, placement, colour))

    def bar(self, name: str, parent: str, at: npt.ArrayLike, length: float, *, width: float = 0.02) -> None:
        """Add a bar that turns about z at one end, and reaches along x to the other."""
        self.joint(name, parent, at=at)
        self.box(name, (0.0, 0.0, 0.0), (length, 0.0, 0.0), width=width, thickness=0.5 * width)

    def point(self, name: str, joint: str, at: npt.ArrayLike) -> None:
        """Name a point of a joint's link; joint "" is the ground."""
        j = self.model.getJointId(joint) if joint else 0
        placement = pin.SE3(np.eye(3), np.array(at, dtype=np.float64))
        self.model.addFrame(pin.Frame(name, j, 0, placement, pin.FrameType.OP_FRAME), False)

    def chain(
        self, closures: list[tuple[str, str, str]], actuated: tuple[str, ...], home: dict[str, float]
    ) -> ClosedChain:
        """Return the closed chain.

        Args:
            closures: name and the two points of each 3d closure.
            actuated: driven joints.
            home: coordinate of every joint in an assembled configuration, kept as the reference configuration "home".
        """
        model = self.model
        model.referenceConfigurations["home"] = np.array([wrapped(home[name]) for name in list(model.names)[1:]])
        loops = tuple(Closure((first, second), name=name) for name, first, second in closures)
        return ClosedChain(model, loops, actuated, visuals=tuple(self.visuals))


def wrapped(angle: float) -> float:
    """Return the same angle between -π and π; values in there (lengths too) stay as they are."""
    return angle if abs(angle) <= np.pi else float(np.angle(np.exp(1j * angle)))


def dyad(start: complex, end: complex, first: float, second: float, side: float) -> tuple[float, float]:
    """Return the absolute angles of two bars that join two points of the plane.

    The first bar goes from `start` to the knee, the second from `end` to the knee.

    Args:
        start, end: the points [m].
        first, second: lengths of the bars [m].
        side: +1 for the knee to the left of the ray from start to end, -1 to the right.
    """
    ray = end - start
    d = abs(ray)
    x = (d * d + first * first - second * second) / (2.0 * d)
    knee = start + ray / d * complex(x, side * np.sqrt(first * first - x * x))
    return float(np.angle(knee - start)), float(np.angle(knee - end))


def universal_angles(direction: Array) -> tuple[float, float]:
    """Return the angles about y, then z, that turn the x axis into a unit direction."""
    return float(np.arctan2(-direction[2], direction[0])), float(np.arcsin(direction[1]))


def _along(x: Array) -> Array:
    """Return axes whose first is x and whose second is as near to y as can be (z when x is along y)."""
    helper = np.array([0.0, 0.0, 1.0]) if abs(x[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    y = np.cross(helper, x)
    y /= np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)
