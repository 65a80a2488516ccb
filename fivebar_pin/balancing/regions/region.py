"""Where material may lie: ball, box or ellipsoid in the axes of a body or of one of its frames.

A mass distribution with given mass, first and second moments (m, h, S) fits into an ellipsoid with centre c and
semi-axes a_i along d_i if and only if its pseudo-inertia is positive semidefinite and

    sum_i (d_i.S d_i - 2 (d_i.c) (d_i.h) + (d_i.c)^2 m) / a_i^2 <= m             [Wensing, Kim, Slotine 2018]

A box asks the same of every axis by itself, d_i.S d_i - ... <= a_i^2 m, and that products of two of its half-spaces
have non-negative mean. For a planar mechanism this is exact too; in space the box conditions are necessary ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, checked, frozen, number
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["Ball", "Box", "Ellipsoid", "Region"]


@dataclass(frozen=True, slots=True, eq=False)
class Ball(Immutable):
    """Material within a distance of a point.

    Attributes:
        radius: [m].
        center: in the axes of the frame (3,) [m].
        frame: name of a frame of the body; the joint frame unless given.
    """

    radius: float
    center: npt.ArrayLike = (0.0, 0.0, 0.0)
    frame: str = ""

    def __post_init__(self) -> None:
        _positive("radius of the ball", self.radius)
        object.__setattr__(self, "center", checked("center", self.center, (3,)))

    @property
    def semi_axes(self) -> Array:
        """Half extents (3,) [m]."""
        return frozen(np.full(3, self.radius))


@dataclass(frozen=True, slots=True, eq=False)
class Box(Immutable):
    """Material within a box along the axes of the frame.

    Attributes:
        size: full lengths of the edges (3,) [m].
        center, frame: as for `Ball`.
    """

    size: npt.ArrayLike
    center: npt.ArrayLike = (0.0, 0.0, 0.0)
    frame: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", checked("size of the box", self.size, (3,)))
        for k, edge in enumerate(np.asarray(self.size)):
            _positive(f"size[{k}] of the box", float(edge))
        object.__setattr__(self, "center", checked("center", self.center, (3,)))

    @property
    def semi_axes(self) -> Array:
        """Half extents (3,) [m]."""
        return frozen(0.5 * np.asarray(self.size, dtype=np.float64))


@dataclass(frozen=True, slots=True, eq=False)
class Ellipsoid(Immutable):
    """Material within an ellipsoid along the axes of the frame.

    Attributes:
        semi_axes: half lengths (3,) [m].
        center, frame: as for `Ball`.
    """

    semi_axes: npt.ArrayLike
    center: npt.ArrayLike = (0.0, 0.0, 0.0)
    frame: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "semi_axes", checked("semi-axes of the ellipsoid", self.semi_axes, (3,)))
        for k, length in enumerate(np.asarray(self.semi_axes)):
            _positive(f"semi_axes[{k}] of the ellipsoid", float(length))
        object.__setattr__(self, "center", checked("center", self.center, (3,)))


Region = Ball | Box | Ellipsoid
_FAR = 1e6  # how far out a region may lie or reach: beyond, nothing can be told from round-off [chain lengths]


@dataclass(frozen=True, slots=True, eq=False)
class Shape(Immutable):
    """A region in the coordinates of one body's space (d = 2 planar, 3 spatial), lengths in any one unit.

    Attributes:
        kind: "ball", "box" or "ellipsoid".
        center: (d,).
        axes: rows d_i (d, d), orthonormal.
        semi_axes: (d,).
    """

    kind: str
    center: Array
    axes: Array
    semi_axes: Array


def resolve(region: Region, chain: ClosedChain, body: int, axes: Array, *, planar: bool, unit: float) -> Shape:
    """Return a region in the axes of a body's space; a planar mechanism sees its shadow on the plane.

    Args:
        body: index of the body, 0 for the first joint.
        axes: rows e_1, e_2, n of the body's space in joint axes (3, 3).
        unit: length that everything is divided by [m].

    Raises:
        UnknownNameError: a frame that the body does not have.
        InvalidInputError: a box that stands askew to the plane of the mechanism.
    """
    if not isinstance(region, Region):
        raise InvalidInputError(f"region of body {chain.joints[body]}", region, "must be a Ball, a Box or an Ellipsoid")
    R, p = _placement(region.frame, chain, body)
    center = p + R @ np.asarray(region.center)
    kind = type(region).__name__.lower()
    semi = np.asarray(region.semi_axes, dtype=np.float64)
    farthest = float(max(np.abs(center).max(), semi.max()))
    if not farthest <= _FAR * unit:
        raise InvalidInputError(
            f"region of body {chain.joints[body]}",
            farthest,
            f"must lie within {_FAR * unit:g} m, {_FAR:g} x the mechanism",
        )
    if not planar:
        return Shape(kind, frozen(center / unit), frozen(R.T), frozen(semi / unit))
    flat = axes[:2] @ center / unit
    if kind == "ball":
        return Shape(kind, frozen(flat), frozen(np.eye(2)), frozen(semi[:2] / unit))
    if kind == "ellipsoid":
        shadow = axes[:2] @ (R * semi**2) @ R.T @ axes[:2].T
        squares, directions = np.linalg.eigh(shadow)
        return Shape(kind, frozen(flat), frozen(directions.T), frozen(np.sqrt(squares) / unit))
    across = np.abs(R.T @ axes[2])
    k = int(np.argmax(across))
    if across[k] < 1.0 - 1e-9:
        raise InvalidInputError(
            f"box for body {chain.joints[body]}",
            "askew",
            "must have one edge along the normal of the plane of motion",
            "Name a frame that is aligned with the plane.",
        )
    keep = [i for i in range(3) if i != k]
    return Shape(kind, frozen(flat), frozen((axes[:2] @ R[:, keep]).T), frozen(semi[keep] / unit))


def _placement(frame: str, chain: ClosedChain, body: int) -> tuple[Array, Array]:
    if not frame:
        return np.eye(3), np.zeros(3)
    own = [f for f in chain.model.frames if f.parentJoint == body + 1]
    for f in own:
        if f.name == frame:
            return np.array(f.placement.rotation), np.array(f.placement.translation)
    raise UnknownNameError(f"frame of body {chain.joints[body]}", frame, [f.name for f in own])


def _positive(name: str, value: float) -> None:
    if number(name, value, unit="m") <= 0.0:
        raise InvalidInputError(name, value, "must be positive and finite [m]", "An empty region holds no material.")
