"""A closure that has found its place in one model: what it does over a batch of configurations."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array

__all__ = ["Anchored", "Segment", "TreePoses", "TreeRates"]


class TreePoses(Protocol):
    """Configurations q (n, nq), world poses of the joints R (n, 3, 3), p (n, 3) each, motion subspaces S (n, 6, nv)."""

    @property
    def q(self) -> Array: ...
    @property
    def R(self) -> Array: ...
    @property
    def p(self) -> Array: ...
    @property
    def S(self) -> Array: ...


class TreeRates(Protocol):
    """Spatial velocity V and acceleration A at zero joint accelerations, per joint (n, 6), world axes and origin."""

    @property
    def V(self) -> Array: ...
    @property
    def A(self) -> Array: ...


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
    """A closure with what it joins found in one model. What `look` saw is handed to all the others.

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

    @abstractmethod
    def look(self, poses: TreePoses) -> Any:
        """Return what the equations need of a batch of n configurations."""

    @abstractmethod
    def residual(self, seen: Any) -> Array:
        """Return the rows that vanish when the closure is met (n, m)."""

    @abstractmethod
    def jacobian(self, seen: Any, poses: TreePoses) -> Array:
        """Return the Jacobian in its columns (n, m, columns): residual rate = jacobian @ v[columns]."""

    @abstractmethod
    def drift(self, seen: Any, rates: TreeRates) -> Array:
        """Return the second rate of the residual at zero joint accelerations (n, m), the closure being met."""

    @abstractmethod
    def selector(self, seen: Any) -> Array:
        """Return T (n, m, 6): T^T lambda is the wrench on body 2 at the world origin, its opposite on body 1."""

    @abstractmethod
    def place(self, seen: Any) -> tuple[Array, Array]:
        """Return the point (n, 3) and the axes (n, 3, 3) that the wrench is told at and in."""

    @abstractmethod
    def row_scale(self, length: float, column_scale: Array) -> Array:
        """Return what makes the rows free of units (m,), for a chain of this length [m] and these units of v (nv,)."""

    @abstractmethod
    def numbers(self) -> Array:
        """Return the numbers that, with the kind and the joints, make it the closure it is (k,)."""

    def opposed(self, seen: Any) -> npt.NDArray[np.bool_]:
        """Return where it is met falsely, axes against each other (n,)."""
        return np.zeros(self.residual(seen).shape[0], dtype=np.bool_)

    def segments(self) -> tuple[Segment, ...]:
        """Return the lines to draw."""
        return ()
