"""Building mechanisms joint by joint, in space too: what the mechanisms that ship are made with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, checked, number
from fivebar_pin.chain import ClosedChain, Visual
from fivebar_pin.chain.bodies import axes_along
from fivebar_pin.closures import Closure
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["TreeBuilder", "dyad", "universal_angles", "wrapped"]

ALUMINIUM = 2700.0
"""Density [kg/m3]."""
WIDE = 1e4
"""Joint limit of a joint that may turn many times [rad]."""
_ROTATION = 1e-9
"""How far axes may be from a rotation: that of numbers with nine digits [-]."""
_COLOURS = (
    (0.16, 0.44, 0.70, 1.0),
    (0.90, 0.62, 0.10, 1.0),
    (0.34, 0.62, 0.32, 1.0),
    (0.76, 0.30, 0.28, 1.0),
    (0.50, 0.36, 0.66, 1.0),
    (0.36, 0.56, 0.60, 1.0),
)


class TreeBuilder:
    """An open tree under construction, in the plane or in space; `chain` closes it.

    A spatial four-bar, its crank about z and its rocker about the y axis of the world, 0.3 m away:

        m = TreeBuilder("rssr", gravity=(0, 0, -9.81))
        m.bar("crank", "", (0, 0, 0), 0.1)
        m.joint("rod_y", "crank", at=(0.1, 0, 0), kind=pin.JointModelRY())
        m.joint("rod_z", "rod_y")
        m.box("rod_z", (0, 0, 0), (0.35, 0, 0), width=0.015, thickness=0.015)
        m.joint("rocker", at=(0.3, 0, 0), axes=[[1, 0, 0], [0, 0, 1], [0, -1, 0]])
        m.box("rocker", (0, 0, 0), (0.25, 0, 0), width=0.02, thickness=0.01)
        m.point("B_rod", "rod_z", (0.35, 0, 0))
        m.point("B_rocker", "rocker", (0.25, 0, 0))
        chain = m.chain([("B", "B_rod", "B_rocker")], ("crank",))

    Every joint carries a link, `NAME_link`, which has the joint's axes and no mass until something is added to it.
    For planar linkages `fivebar_pin.planar.Linkage` takes points and bars and chooses the tree itself.
    """

    def __init__(self, name: str, *, gravity: npt.ArrayLike = (0.0, -9.81, 0.0)) -> None:
        """Start a tree that is the ground alone.

        Args:
            name: of the mechanism.
            gravity: (3,) [m/s2].
        """
        self.model = pin.Model()
        self.model.name = name
        self.model.gravity.linear = np.array(checked("gravity", gravity, (3,)))
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
            axes: rotation matrix (3, 3) of the joint's axes in the parent's; its columns are these axes.
            kind: Pinocchio's joint of one degree of freedom; about z when None.
            limit: bound of the coordinate, on both sides [rad or m].

        Raises:
            UnknownNameError: there is no such parent.
            InvalidInputError: a joint or frame is called so already, or the axes are no rotation.
        """
        model = self.model
        self._check_new(name)
        self._check_new(f"{name}_link")
        R = np.eye(3) if axes is None else np.array(checked(f"axes of joint {name}", axes, (3, 3)))
        if np.abs(R.T @ R - np.eye(3)).max() > _ROTATION or np.linalg.det(R) < 0.0:
            raise InvalidInputError(f"axes of joint {name}", R.tolist(), "must be a rotation, right-handed")
        placement = pin.SE3(R, np.array(checked(f"position of joint {name}", at, (3,))))
        turning: Any = kind or pin.JointModelRZ()
        if (turning.nq, turning.nv) != (1, 1):
            name_of_kind = str(turning.shortname())
            hint = "Put joints of one coordinate in a row."
            raise InvalidInputError(f"kind of joint {name}", name_of_kind, "must have one coordinate", hint)
        j = model.addJoint(self._index(parent), turning, placement, name)
        model.lowerPositionLimit[model.idx_qs[j]], model.upperPositionLimit[model.idx_qs[j]] = -limit, limit
        model.addJointFrame(j, -1)
        model.addBodyFrame(f"{name}_link", j, pin.SE3.Identity(), -1)

    def box(
        self,
        joint: str,
        start: npt.ArrayLike,
        end: npt.ArrayLike,
        *,
        width: float,
        thickness: float,
        density: float = ALUMINIUM,
    ) -> None:
        """Add a uniform bar between two points of a joint's link, as a mass and as a visual.

        Args:
            joint: whose link it belongs to.
            start, end: its ends (3,), in the joint's axes [m].
            width, thickness: of its section [m]; the width is horizontal in these axes.
            density: [kg/m3]; aluminium unless given.
        """
        a, b = (np.array(checked(f"end of a box on {joint}", x, (3,))) for x in (start, end))
        number(f"density of a box on {joint}", density, positive=True, unit="kg/m3")
        length = float(np.linalg.norm(b - a))
        if length == 0.0:
            raise InvalidInputError(f"length of a box on {joint}", length, "must be positive [m]")
        size = (length, width, thickness)
        inertia = pin.Inertia.FromBox(density * length * width * thickness, *size)
        placement = pin.SE3(axes_along((b - a) / length), 0.5 * (a + b))
        self.model.appendBodyToJoint(self._moving(joint), inertia, placement)
        self.draw(joint, "box", size, np.array(placement.homogeneous))

    def mass(self, joint: str, at: npt.ArrayLike, mass: float) -> None:
        """Add a point mass [kg] at a point (3,) of a joint's link [m]."""
        place = pin.SE3(np.eye(3), np.array(checked(f"place of a mass on {joint}", at, (3,))))
        point = pin.Inertia(number(f"mass on {joint}", mass, positive=True, unit="kg"), np.zeros(3), np.zeros((3, 3)))
        self.model.appendBodyToJoint(self._moving(joint), point, place)

    def draw(self, joint: str, shape: str, size: tuple[float, ...], placement: Array) -> None:
        """Add a visual to a joint's link, in the joint's own colour; see `Visual`."""
        colour = _COLOURS[(self._moving(joint) - 1) % len(_COLOURS)]
        self.visuals.append(Visual(f"{joint}_link", shape, size, placement, colour))

    def bar(self, name: str, parent: str, at: npt.ArrayLike, length: float, *, width: float = 0.02) -> None:
        """Add a bar of aluminium that turns about z at one end and reaches along x to the other: joint and box.

        Args:
            name: of the joint.
            parent: joint whose link carries it; "" is the ground.
            at: position (3,) in the parent's axes [m].
            length: [m].
            width: of its section [m]; half as thick.
        """
        self.joint(name, parent, at=at)
        self.box(name, (0.0, 0.0, 0.0), (length, 0.0, 0.0), width=width, thickness=0.5 * width)

    def point(self, name: str, joint: str, at: npt.ArrayLike) -> None:
        """Name a point (3,) of a joint's link [m], as an end of closures; joint "" is the ground."""
        self._check_new(name)
        placement = pin.SE3(np.eye(3), np.array(checked(f"place of point {name}", at, (3,))))
        self.model.addFrame(pin.Frame(name, self._index(joint), 0, placement, pin.FrameType.OP_FRAME), False)

    def chain(
        self,
        closures: Iterable[tuple[str, str, str] | Closure],
        actuated: Iterable[str],
        home: Mapping[str, float] | None = None,
    ) -> ClosedChain:
        """Return the closed chain.

        Args:
            closures: name and the two points of each closure of points; or any `Closure`.
            actuated: driven joints.
            home: coordinate of every joint in an assembled configuration [rad or m], kept as the reference
                configuration "home"; angles are taken within half a turn.

        Raises:
            UnknownNameError: a point or joint that there is not.
            InvalidInputError: home leaves a joint out.
        """
        if home is not None:
            self.model.referenceConfigurations["home"] = self._configuration(home)
        loops = tuple(c if isinstance(c, Closure) else Closure((c[1], c[2]), name=c[0]) for c in closures)
        return ClosedChain(self.model, loops, tuple(actuated), visuals=tuple(self.visuals))

    def _configuration(self, home: Mapping[str, float]) -> Array:
        joints = list(self.model.names)[1:]
        for name in home:
            if name not in joints:
                raise UnknownNameError("joint of home", name, joints)
        missing = [name for name in joints if name not in home]
        if missing:
            raise InvalidInputError("home", sorted(home), f"must state every joint; {', '.join(missing)} missing")
        turns = [str(joint.shortname()).startswith("JointModelR") for joint in list(self.model.joints)[1:]]
        values = (number(f"home of {name}", home[name]) for name in joints)
        return np.array([wrapped(x) if turn else x for x, turn in zip(values, turns, strict=True)])

    def _index(self, joint: str) -> int:
        return self._moving(joint) if joint else 0

    def _moving(self, joint: str) -> int:
        if not self.model.existJointName(joint) or joint == "universe":
            raise UnknownNameError("joint", joint, list(self.model.names)[1:])
        return int(self.model.getJointId(joint))

    def _check_new(self, name: str) -> None:
        if not name or self.model.existFrame(name) or self.model.existJointName(name):
            raise InvalidInputError("name of a joint or point", name, "must be new, and not empty")


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
