"""What a link is made of, as a rule that follows its points when named lengths change.

A rule names frames of one link; its inertia and how it is drawn are functions of where these frames are. Everything is
in the axes of the link's joint. Adding a rule is one class here: sidecars find it in `RULES` and write its fields.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, all_of, checked, number
from fivebar_pin.errors import InvalidInputError

__all__ = ["RULES", "BarBody", "Body", "LumpBody", "PlateBody", "axes_along"]

_FLAT = 1e-9
"""Area of a plate below which it is a line, as part of the square of its extent: round-off of its corners [-]."""


class Body(Immutable, ABC):
    """A rule: the inertia of a part of one link as a function of its frames.

    Attributes:
        frames: names of frames of one link.
    """

    __slots__ = ()
    frames: tuple[str, ...]

    @abstractmethod
    def inertia(self, poses: Array) -> pin.Inertia:
        """Return the inertia in the axes of the link's joint, from the poses of the frames there (k, 4, 4)."""

    def drawn(self, poses: Array) -> tuple[tuple[tuple[float, ...], Array], ...]:
        """Return the boxes that show it: size (x, y, z) [m] and pose (4, 4) in the axes of the link's joint."""
        return ()

    def _check(self, *, least: int, most: int | None = None) -> None:
        frames = all_of("frames of a body", self.frames, str)
        object.__setattr__(self, "frames", frames)
        if not least <= len(frames) <= (len(frames) if most is None else most) or len(set(frames)) < len(frames):
            how_many = f"{least}" if most == least else f"at least {least}"
            raise InvalidInputError("frames of a body", frames, f"must be {how_many} different names")

    def _size(self, name: str, *, may_be_zero: bool) -> None:
        what = f"{name} of the body {'-'.join(self.frames)}"
        value = number(what, getattr(self, name), positive=not may_be_zero)
        if value < 0.0:
            raise InvalidInputError(what, value, "must not be negative")
        object.__setattr__(self, name, value)


@dataclass(frozen=True, slots=True, eq=False)
class BarBody(Body):
    """A uniform bar of rectangular section from one frame to another.

    Attributes:
        frames: its two ends.
        linear_density: mass per length [kg/m]; density * width * thickness for a section of a material.
        width, thickness: of the section [m]; 0 for a thin rod, which is not drawn.
    """

    frames: tuple[str, ...]
    linear_density: float
    width: float = 0.0
    thickness: float = 0.0

    def __post_init__(self) -> None:
        self._check(least=2, most=2)
        for name in ("linear_density", "width", "thickness"):
            self._size(name, may_be_zero=True)

    def inertia(self, poses: Array) -> pin.Inertia:
        """Return that of a box of its length, width and thickness."""
        size, pose = self._box(poses)
        if self.linear_density == 0.0:
            return pin.Inertia.Zero()
        return pin.SE3(pose).act(pin.Inertia.FromBox(self.linear_density * size[0], *size))

    def drawn(self, poses: Array) -> tuple[tuple[tuple[float, ...], Array], ...]:
        """Return its box."""
        return (self._box(poses),) if self.width > 0.0 and self.thickness > 0.0 else ()

    def _box(self, poses: Array) -> tuple[tuple[float, float, float], Array]:
        a, b = poses[0, :3, 3], poses[1, :3, 3]
        length = float(np.linalg.norm(b - a))
        if length == 0.0:
            raise InvalidInputError(f"length of the bar {'-'.join(self.frames)}", length, "must be positive [m]")
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = axes_along((b - a) / length), 0.5 * (a + b)
        return (length, self.width, self.thickness), pose


@dataclass(frozen=True, slots=True, eq=False)
class PlateBody(Body):
    """A uniform flat plate, the polygon through frames of a link, square to the z axis of the link's joint.

    Attributes:
        frames: its corners in order, three or more; no side crosses another.
        density: [kg/m3].
        thickness: [m]; the corners lie in its middle plane.
        width: how wide its sides are drawn [m]; 0 draws nothing.
    """

    frames: tuple[str, ...]
    density: float
    thickness: float
    width: float = 0.0

    def __post_init__(self) -> None:
        self._check(least=3)
        self._size("thickness", may_be_zero=False)
        for name in ("density", "width"):
            self._size(name, may_be_zero=True)

    def inertia(self, poses: Array) -> pin.Inertia:
        """Return that of the polygon, by Green's theorem."""
        corners = poses[:, :3, 3]
        x, y, z = corners[:, 0], corners[:, 1], float(np.mean(corners[:, 2]))
        self._check_polygon(corners[:, :2])
        if self.density == 0.0:
            return pin.Inertia.Zero()
        x0, y0 = float(x.mean()), float(y.mean())
        x, y = x - x0, y - y0
        X, Y = np.roll(x, -1), np.roll(y, -1)
        turn = x * Y - X * y
        area = 0.5 * turn.sum()
        cx, cy = (turn @ (x + X)) / (6.0 * area), (turn @ (y + Y)) / (6.0 * area)
        xx = turn @ (x * x + x * X + X * X) / 12.0 - area * cx * cx
        yy = turn @ (y * y + y * Y + Y * Y) / 12.0 - area * cy * cy
        xy = turn @ (x * Y + 2.0 * x * y + 2.0 * X * Y + X * y) / 24.0 - area * cx * cy
        weight = self.density * self.thickness * np.sign(area)
        mass = weight * area
        flat = mass * self.thickness**2 / 12.0
        tensor = weight * np.array([[yy, -xy, 0.0], [-xy, xx, 0.0], [0.0, 0.0, xx + yy]]) + np.diag([flat, flat, 0.0])
        return pin.Inertia(float(mass), np.array([cx + x0, cy + y0, z]), tensor)

    def drawn(self, poses: Array) -> tuple[tuple[tuple[float, ...], Array], ...]:
        """Return a box for each side."""
        sides = zip(poses, np.roll(poses, -1, axis=0), strict=True)
        ends = (("one", "other"), 0.0, self.width, self.thickness)
        return tuple(box for side in sides for box in BarBody(*ends).drawn(np.stack(side)))

    def _check_polygon(self, corners: Array) -> None:
        name = f"corners of the plate {'-'.join(self.frames)}"
        sides = list(zip(corners, np.roll(corners, -1, axis=0), strict=True))
        for (i, (a, b)), (k, (c, d)) in combinations(enumerate(sides), 2):
            if k - i not in (1, len(sides) - 1) and _cross_over(a, b, c, d):
                raise InvalidInputError(name, corners.tolist(), "make sides that cross", "Name them in order.")
        extent = float(np.ptp(corners, axis=0).max())
        area = 0.5 * sum(_turn(a, b) for a, b in sides - corners.mean(axis=0))
        if abs(area) <= _FLAT * extent**2:
            raise InvalidInputError(name, corners.tolist(), "lie on one line", "Make it of bars instead.")


@dataclass(frozen=True, slots=True, eq=False)
class LumpBody(Body):
    """A body of stated mass, mass centre and inertia in the axes of one frame: it moves with the frame, unchanged.

    Attributes:
        frames: the frame.
        mass: [kg].
        centre: mass centre (3,) in the frame [m].
        inertia_z: about the frame's z axis through the mass centre, of a flat body [kg m2]; 0 is a point.
    """

    frames: tuple[str, ...]
    mass: float
    centre: tuple[float, ...] = (0.0, 0.0, 0.0)
    inertia_z: float = 0.0

    def __post_init__(self) -> None:
        self._check(least=1, most=1)
        for name in ("mass", "inertia_z"):
            self._size(name, may_be_zero=True)
        centre = checked(f"centre of the body at {self.frames[0]}", self.centre, (3,))
        object.__setattr__(self, "centre", tuple(float(x) for x in centre))

    def inertia(self, poses: Array) -> pin.Inertia:
        """Return it, carried along by the frame."""
        if self.mass == 0.0 and self.inertia_z == 0.0:
            return pin.Inertia.Zero()
        tensor = np.diag([0.5 * self.inertia_z, 0.5 * self.inertia_z, self.inertia_z])
        return pin.SE3(poses[0]).act(pin.Inertia(self.mass, np.array(self.centre), tensor))


RULES: dict[str, type[Body]] = {"bar": BarBody, "lump": LumpBody, "plate": PlateBody}
"""Kinds of bodies by the word that sidecars use."""


def axes_along(x: Array) -> Array:
    """Return axes (3, 3) whose first is the unit vector x and whose second is horizontal (y when x is along z)."""
    helper = np.array([0.0, 0.0, 1.0]) if abs(x[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    y = np.cross(helper, x)
    y /= np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _turn(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _cross_over(a: Array, b: Array, c: Array, d: Array) -> bool:
    """Tell whether two segments of the plane cross or touch."""
    apart = _turn(b - a, c - a) * _turn(b - a, d - a) > 0.0 or _turn(d - c, a - c) * _turn(d - c, b - c) > 0.0
    return not apart
