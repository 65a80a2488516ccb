"""One group of the variables of a problem: what they do to the bodies, and the cones that they lie in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.change import Change
from fivebar_pin.balancing.setting import Setting
from fivebar_pin.balancing.solvers import Block

__all__ = ["Made", "Part", "Placed"]


@dataclass(frozen=True, slots=True, eq=False)
class Made(Immutable):
    """What values of the variables make of the bodies.

    Attributes:
        parameters: of all bodies with them (nb, 10).
        added, removed: the material, for people to read.
        lowest: smallest eigenvalue of a pseudo-inertia that must not be negative [kg, kg m, kg m2].
    """

    parameters: Array
    added: tuple[Change, ...] = ()
    removed: tuple[Change, ...] = ()
    lowest: float = float("inf")


class Part(Immutable, ABC):
    """A few variables z (size,) that belong together, such as the moments of one piece of material.

    Attributes:
        label: what certificates call it.
        size: number of variables.
        cones: what is asked of them, G (rows, size).
    """

    __slots__ = ()

    label: str
    size: int
    cones: tuple[Block, ...]

    @property
    def apex(self) -> int | None:
        """Return the index of the variable without which all the others are zero too, or None."""
        return None

    @property
    def sticks_out(self) -> int | None:
        """Return the index of the variable that says how far an elastic counterweight sticks out, or None."""
        return None

    @abstractmethod
    def map(self, setting: Setting) -> Array:
        """Return what unit variables change in the ten parameters of all bodies (10 nb, size), SI units."""

    @abstractmethod
    def sizes(self, most: Array) -> Array:
        """Return bounds b (size,) with |z_i| <= b_i for all designs; infinite where there are none.

        Args:
            most: upper bound on each variable (size,) that is stated for it alone, infinite where there is none.
        """

    def scaled_map(self, setting: Setting) -> Array:
        """Return the same in the scaled parameters of the space (nb * width, size)."""
        return np.asarray((setting.space.selection() @ self.map(setting)) / setting.unit[:, None])

    def replaces(self) -> tuple[int, ...]:
        """Return the bodies whose present parameters play no part."""
        return ()

    def bounds(self, setting: Setting) -> list[Block]:
        """Return what is asked by the user of the variables alone, G (rows, size)."""
        return []

    def caps(self, setting: Setting) -> list[Block]:
        """Return bounds on variables that have none of their own; without them an optimum need not exist."""
        return []

    def fixed(self, setting: Setting) -> Array:
        """Return rows (k, size + 1) of what is given exactly: row @ z = last entry."""
        return np.zeros((0, self.size + 1))

    def share(self, z: Array) -> float:
        """Return how much there is of it [moving masses]; changes are spread in proportion."""
        return float(np.abs(z).max(initial=0.0))

    def compact(self, z: Array, felt: npt.NDArray[np.bool_]) -> Array:
        """Return equivalent variables (size,) that make the most compact bodies.

        Args:
            z: the variables.
            felt: which of them anything in the problem depends on (size,).
        """
        return z

    def swollen(self, z: Array) -> Array:
        """Return the variables (size,) with the inertia raised to the least that a stated density leaves."""
        return z

    def make(self, setting: Setting, z: Array, parameters: Array) -> Made:
        """Return what values of the variables make of bodies that have parameters (nb, 10) without them."""
        return Made(parameters + (self.map(setting) @ z).reshape(-1, 10))


@dataclass(frozen=True, slots=True, eq=False)
class Placed(Immutable):
    """A part among all variables of a problem, from `start`."""

    part: Part
    start: int

    @property
    def where(self) -> slice:
        """Return where its variables stand."""
        return slice(self.start, self.start + self.part.size)

    @property
    def apex(self) -> int | None:
        """Return where its apex stands, or None."""
        return None if self.part.apex is None else self.start + self.part.apex

    def widened(self, block: Block, n: int) -> Block:
        """Return a block on the part's variables as one on all n."""
        G = np.zeros((block.G.shape[0], n))
        G[:, self.where] = block.G
        return replace(block, G=G)
