"""What a link is made of, as a rule that follows its points when named lengths change.

A rule names frames of one link; its inertia and how it is drawn are functions of where these frames are. Everything is
in the axes of the link's joint. Adding a rule is one class here: sidecars find it in `RULES` and write its fields.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, all_of, checked, cross, number
from fivebar_pin.chain.masses import inertia_of, packed
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
    def masses(self, poses: Array) -> Array:
        """Return its rows, see `fivebar_pin.chain.masses`, in the axes of the link's joint, of n designs (n, 10).

        Args:
            poses: of the frames there (n, k, 4, 4).

        Returns:
            Mass, mass centre and moments about it; nan where it is no body.
        """

    def inertia(self, poses: Array) -> pin.Inertia:
        """Return the inertia in the axes of the link's joint, from the poses of the frames there (k, 4, 4).

        Raises:
            InvalidInputError: frames that make no body.
        """
        self.require_real(poses)
        return inertia_of(self.masses(poses[None])[0])

    def require_real(self, poses: Array) -> None:
        """Raise where the frames (k, 4, 4) make no body."""

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

    def masses(self, poses: Array) -> Array:
        """Return those of boxes of its length, width and thickness."""
        along = poses[:, 1, :3, 3] - poses[:, 0, :3, 3]
        length = np.sqrt(np.sum(along * along, axis=1))
        axes = axes_along(along / length[:, None])
        mass = self.linear_density * length
        sides = np.stack([length, np.full_like(length, self.width), np.full_like(length, self.thickness)], axis=1) ** 2
        moments = mass[:, None] / 12.0 * (sides[:, [1, 0, 0]] + sides[:, [2, 2, 1]])
        tensor = np.matmul(axes * moments[:, None, :], np.swapaxes(axes, 1, 2))
        return packed(mass, 0.5 * (poses[:, 0, :3, 3] + poses[:, 1, :3, 3]), tensor)

    def require_real(self, poses: Array) -> None:
        """Raise for a bar without length."""
        self._box(poses)

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

    def masses(self, poses: Array) -> Array:
        """Return those of the polygon, by Green's theorem."""
        corners = poses[:, :, :3, 3]
        middle = corners.mean(axis=1)
        x, y = corners[:, :, 0] - middle[:, :1], corners[:, :, 1] - middle[:, 1:2]
        X, Y = np.roll(x, -1, axis=1), np.roll(y, -1, axis=1)
        turn = x * Y - X * y
        area = 0.5 * turn.sum(axis=1)
        cx, cy = (np.sum(turn * c, axis=1) / (6.0 * area) for c in (x + X, y + Y))
        xx = np.sum(turn * (x * x + x * X + X * X), axis=1) / 12.0 - area * cx * cx
        yy = np.sum(turn * (y * y + y * Y + Y * Y), axis=1) / 12.0 - area * cy * cy
        xy = np.sum(turn * (x * Y + 2.0 * x * y + 2.0 * X * Y + X * y), axis=1) / 24.0 - area * cx * cy
        weight = self.density * self.thickness * np.sign(area)
        mass = weight * area
        flat, none = mass * self.thickness**2 / 12.0, np.zeros_like(mass)
        columns = (
            mass,
            cx,
            cy,
            none,
            weight * yy + flat,
            -weight * xy,
            weight * xx + flat,
            none,
            none,
            weight * (xx + yy),
        )
        rows = np.stack(columns, axis=1)
        rows[:, 1:4] += middle
        return np.where(self._real(corners[:, :, :2])[:, None], rows, np.nan)

    def require_real(self, poses: Array) -> None:
        """Raise for corners on one line, and where sides cross."""
        self._check_polygon(poses[:, :2, 3])

    def drawn(self, poses: Array) -> tuple[tuple[tuple[float, ...], Array], ...]:
        """Return a box for each side."""
        sides = zip(poses, np.roll(poses, -1, axis=0), strict=True)
        ends = (("one", "other"), 0.0, self.width, self.thickness)
        return tuple(box for side in sides for box in BarBody(*ends).drawn(np.stack(side)))

    def _check_polygon(self, corners: Array) -> None:
        name = f"corners of the plate {'-'.join(self.frames)}"
        if self._crossed(corners[None])[0]:
            raise InvalidInputError(name, corners.tolist(), "make sides that cross", "Name them in order.")
        if not self._real(corners[None])[0]:
            raise InvalidInputError(name, corners.tolist(), "lie on one line", "Make it of bars instead.")

    def _real(self, corners: Array) -> npt.NDArray[np.bool_]:
        """Tell which polygons (n, k, 2) are ones: no sides cross, and they are no lines."""
        extent = np.ptp(corners, axis=1).max(axis=1)
        away = corners - corners.mean(axis=1, keepdims=True)
        area = 0.5 * np.sum(_turn(away, np.roll(away, -1, axis=1)), axis=1)
        return np.asarray(~self._crossed(corners) & (np.abs(area) > _FLAT * extent**2))

    def _crossed(self, corners: Array) -> npt.NDArray[np.bool_]:
        """Tell where sides that are no neighbours cross or touch (n,)."""
        found = np.zeros(corners.shape[0], dtype=np.bool_)
        ends, k = np.roll(corners, -1, axis=1), corners.shape[1]
        for i, j in combinations(range(k), 2):
            if j - i not in (1, k - 1):
                found |= _cross_over(corners[:, i], ends[:, i], corners[:, j], ends[:, j])
        return found


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

    def masses(self, poses: Array) -> Array:
        """Return those of it, carried along by the frame."""
        R, n = poses[:, 0, :3, :3], poses.shape[0]
        tensor = np.diag([0.5 * self.inertia_z, 0.5 * self.inertia_z, self.inertia_z])
        centre = np.matmul(R, np.array(self.centre)) + poses[:, 0, :3, 3]
        return packed(np.full(n, self.mass), centre, np.matmul(np.matmul(R, tensor), np.swapaxes(R, 1, 2)))


RULES: dict[str, type[Body]] = {"bar": BarBody, "lump": LumpBody, "plate": PlateBody}
"""Kinds of bodies by the word that sidecars use."""


def axes_along(x: Array) -> Array:
    """Return axes (..., 3, 3) whose first is x (..., 3) of length one, the second horizontal (y where x is along z)."""
    helper = np.where(np.abs(x[..., 2:]) < 0.9, np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0]))
    y = cross(helper, x)
    y = y / np.sqrt(np.sum(y * y, axis=-1, keepdims=True))
    return np.stack([x, y, cross(x, y)], axis=-1)


def _turn(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _cross_over(a: Array, b: Array, c: Array, d: Array) -> npt.NDArray[np.bool_]:
    """Tell which segments of the plane cross or touch, ends (n, 2) each."""
    apart = (_turn(b - a, c - a) * _turn(b - a, d - a) > 0.0) | (_turn(d - c, a - c) * _turn(d - c, b - c) > 0.0)
    return np.asarray(~apart)
