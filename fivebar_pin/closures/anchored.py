"""A closure that has found its place in one model."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array

__all__ = ["Anchored", "FramePair", "Segment"]


@dataclass(frozen=True, slots=True, eq=False)
class FramePair:
    """World poses of the two frames of a closure. R (..., 3, 3), p (..., 3)."""

    R1: Array
    p1: Array
    R2: Array
    p2: Array


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """A straight line to draw, from a point fixed to one body to a point fixed to another.

    Attributes:
        joints: joints that carry the bodies; 0 is the ground.
        points: the ends in the axes of these joints (3,) [m].
        rod: a rod that can be touched; else only a sign that the two have to do with each other.
    """

    joints: tuple[int, int]
    points: tuple[Array, Array]
    rod: bool


class Named(Protocol):
    """What is asked of the closure itself, see `Closure`."""

    @property
    def name(self) -> str: ...
    @property
    def kind(self) -> str: ...
    @property
    def row_names(self) -> tuple[str, ...]: ...


@dataclass(frozen=True, slots=True, eq=False)
class Anchored(ABC):
    """A closure with what it joins found in one model.

    Attributes:
        closure: what it is made of.
        rows: its place among the rows of the chain.
        joints: joints of the two bodies that its wrench acts between; 0 is the ground.
        tied: joints that it ties to each other.
        columns: velocity coordinates that move its rows, ascending.
    """

    closure: Named
    rows: slice
    joints: tuple[int, int]
    tied: tuple[int, ...]
    columns: npt.NDArray[np.intp]

    def place(self, pair: FramePair) -> tuple[Array, Array]:
        """Return the point (n, 3), of frame 2, and the axes (n, 3, 3), of frame 1, its wrench is told at and in."""
        return pair.p2, pair.R1

    @abstractmethod
    def row_scale(self, length: float, column_scale: Array) -> Array:
        """Return what makes the rows free of units (m,), for a chain of this length [m] and these units of v (nv,)."""

    @abstractmethod
    def numbers(self) -> Array:
        """Return the numbers that, with the kind and the joints, make it the closure it is (k,)."""

    def opposed(self, pair: FramePair) -> npt.NDArray[np.bool_]:
        """Return where it is met falsely, axes against each other (n,)."""
        return np.zeros(pair.p1.shape[0], dtype=np.bool_)

    def segments(self) -> tuple[Segment, ...]:
        """Return the lines to draw."""
        return ()
