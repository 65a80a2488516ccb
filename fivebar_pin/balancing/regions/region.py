"""Where material may lie, as the user says it: something in the axes of a body or of one of its frames."""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, number
from fivebar_pin.balancing.regions.shape import Shape
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["Region", "positive", "resolve"]

_FAR = 1e6  # how far out a region may lie or reach: beyond, nothing can be told from round-off [chain lengths]


class Region(Immutable, ABC):
    """A part of space that material has to stay in.

    A region of one's own is a frozen dataclass with `center` and `frame` and the two methods below; nothing else in
    the library has to know it.

    Attributes:
        center: in the axes of the frame (3,) [m].
        frame: name of a frame of the body; the joint frame unless given.
    """

    __slots__ = ()

    center: npt.ArrayLike
    frame: str

    @abstractmethod
    def half_extents(self) -> Array:
        """Half extents along the axes of the frame (3,) [m]."""

    @abstractmethod
    def shape(self, body: str, center: Array, R: Array, *, plane: Array | None, unit: float) -> Shape:
        """Return the region in the axes of a body's space; a planar mechanism sees its shadow on the plane.

        Args:
            body: name of the body, for errors.
            center: in the joint axes of the body (3,) [m].
            R: axes of the frame, as columns, in joint axes (3, 3).
            plane: rows e_1, e_2, n (3, 3) of a planar mechanism in joint axes, else None.
            unit: length that everything is divided by [m].
        """


def resolve(region: Region, chain: ClosedChain, body: int, axes: Array, *, planar: bool, unit: float) -> Shape:
    """Return a region in the axes of a body's space.

    Args:
        region: where material may lie.
        chain, body: the mechanism and the index of the body, 0 for the first joint.
        axes: rows e_1, e_2, n of the body's space in joint axes (3, 3).
        planar: whether the mechanism is.
        unit: length that everything is divided by [m].

    Raises:
        UnknownNameError: a frame that the body does not have.
        InvalidInputError: no region, one that is out of reach, or a box that stands askew to the plane.
    """
    name = f"region of body {chain.joints[body]}"
    if not isinstance(region, Region):
        raise InvalidInputError(name, region, "must be a Ball, a Box or an Ellipsoid, or another Region")
    R, p = _placement(region.frame, chain, body)
    center = p + R @ np.asarray(region.center)
    farthest = float(max(np.abs(center).max(), region.half_extents().max()))
    if not farthest <= _FAR * unit:
        raise InvalidInputError(name, farthest, f"must lie within {_FAR * unit:g} m, {_FAR:g} x the mechanism")
    return region.shape(chain.joints[body], center, R, plane=axes if planar else None, unit=unit)


def positive(name: str, value: float) -> None:
    """Raise for a length that is not positive and finite."""
    if number(name, value, unit="m") <= 0.0:
        raise InvalidInputError(name, value, "must be positive and finite [m]", "An empty region holds no material.")


def _placement(frame: str, chain: ClosedChain, body: int) -> tuple[Array, Array]:
    if not frame:
        return np.eye(3), np.zeros(3)
    own = [f for f in chain.model.frames if f.parentJoint == body + 1]
    for f in own:
        if f.name == frame:
            return np.array(f.placement.rotation), np.array(f.placement.translation)
    raise UnknownNameError(f"frame of body {chain.joints[body]}", frame, [f.name for f in own])
