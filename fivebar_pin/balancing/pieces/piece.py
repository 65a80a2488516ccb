"""What counterweights are made as."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, TypeVar

import numpy as np

from fivebar_pin._arrays import Array, Immutable, number
from fivebar_pin.balancing.pieces.solid import Solid

__all__ = ["ARM", "SHAPES", "Piece", "check_arm", "register"]

ARM = 0.2  # side of the arms that carry counterweights unless given [outer radii]
SHAPES: dict[str, type[Piece]] = {}  # by the word that stands for them
P = TypeVar("P", bound="type[Piece]")


class Piece(Immutable, ABC):
    """A kind of counterweight that can be made, of one material.

    Attributes:
        shape: the word that stands for it.
        flat: whether it needs a plane of motion to lie in.
        density: [kg/m3], or one of `MATERIALS`.
        arm: side [m] of the square arm of the same material that carries it, from the joint to its rim; a fifth of its
            outer radius unless given, 0 for none (the body itself carries it).
    """

    __slots__ = ()

    shape: ClassVar[str]
    flat: ClassVar[bool]

    density: float | str
    arm: float | None

    @classmethod
    @abstractmethod
    def of(cls, density: float, thickness: float, arm: float | None) -> Piece:
        """Return the piece of a density [kg/m3], a thickness where it has one, and an arm [m]."""

    @abstractmethod
    def solid(self, axes: Array, mass: float, length: float) -> Solid:
        """Return what it asks of the scaled parameters of one body (axes (3, 3): rows e_1, e_2, n)."""

    @abstractmethod
    def outer_radius(self, mass: float, inertia: Array, axes: Array) -> float:
        """Return the outer radius [m] of the piece of a mass [kg] > 0 and inertia (3, 3), or of the solid one."""

    @abstractmethod
    def size(self, mass: float, inertia: Array, axes: Array) -> tuple[float, ...]:
        """Return its lengths [m], the most compact where the inertia is too small."""

    @classmethod
    @abstractmethod
    def radius_of(cls, size: tuple[float, ...]) -> float:
        """Return the distance from its centre to its farthest point [m], in the plane of a flat piece."""

    @classmethod
    @abstractmethod
    def principal(cls, mass: float, size: tuple[float, ...]) -> Array:
        """Return the principal inertias (3,) about its mass centre, z along the thickness [kg m2]."""

    @classmethod
    @abstractmethod
    def words(cls, size: tuple[float, ...]) -> str:
        """Return its size in words [mm]."""

    @classmethod
    @abstractmethod
    def visual(cls, size: tuple[float, ...]) -> tuple[str, tuple[float, ...]]:
        """Return the shape and size that it is drawn as, see `Visual`."""

    def axes_at(self, place: Array, axes: Array) -> Array:
        """Return its axes, as columns (3, 3), at a place in joint axes; z along the thickness, x along a bar."""
        return np.eye(3)

    def alike(self, other: Piece) -> bool:
        """Return whether another piece is of the kind asked for; its line and arm are its own."""
        mine = {k: v for k, v in self.kind().items() if v is not None}
        return type(self) is type(other) and all(other.kind()[k] == v for k, v in mine.items())

    @abstractmethod
    def kind(self) -> dict[str, float | None]:
        """Return the numbers that tell two pieces of one shape apart; None where anything will do."""

    def arm_width(self, radius: float) -> float:
        """Return the width and thickness of the arm of a piece of an outer radius [m]."""
        return ARM * radius if self.arm is None else self.arm


def register(kind: P) -> P:
    """Add a kind of piece to those that `realise` knows by their word."""
    SHAPES[kind.shape] = kind
    return kind


def check_arm(width: float | None) -> None:
    """Raise for the side of an arm that is not one."""
    if width is not None and width != 0.0:
        number("side of the arm", width, positive=True, unit="m")
