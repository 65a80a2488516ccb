"""Configurations of a chain and what its closures are there, each thing computed when it is first asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.mechanism.loops import Loops
from fivebar_pin.mechanism.passive import PassiveMap
from fivebar_pin.mechanism.rank import Decomposed
from fivebar_pin.mechanism.tree import Poses

__all__ = ["Configurations"]


@dataclass(frozen=True, eq=False)
class Configurations:
    """A batch of configurations, closed or not.

    Attributes:
        loops: the closures.
        q: configurations (n, nq).
    """

    loops: Loops
    q: Array

    @cached_property
    def poses(self) -> Poses:
        """Poses of the joints."""
        return self.loops.tree.poses(self.q)

    @cached_property
    def pairs(self) -> list[Any]:
        """World poses of the frames of every closure."""
        return self.loops.pairs(self.poses)

    @cached_property
    def residual(self) -> Array:
        """All closure rows (n, m) [m, rad]."""
        return self.loops.residual(self.pairs) if self.loops.m else np.zeros((self.q.shape[0], 0))

    @cached_property
    def gap(self) -> Array:
        """Largest of them (n,) [m or rad]."""
        return np.asarray(np.abs(self.residual).max(axis=1, initial=0.0))

    @cached_property
    def reduced(self) -> Array:
        """Independent combinations of the closure rows, scaled (n, r)."""
        return np.asarray(self.residual @ self.loops.reduce.T)

    @cached_property
    def blocks(self) -> list[Array]:
        """The closure Jacobian per independent group of closures."""
        return self.loops.blocks(self.poses, self.pairs)

    @cached_property
    def J(self) -> Array:
        """The closure Jacobian (n, m, nv)."""
        return self.loops.joined(self.blocks, self.q.shape[0])

    @cached_property
    def passive(self) -> PassiveMap:
        """What takes the actuated coordinates to the passive ones."""
        return self.loops.passive_map(self.blocks)

    @cached_property
    def independent(self) -> Decomposed:
        """The Jacobian of the independent combinations of rows, scaled and decomposed."""
        return Decomposed.of(np.matmul(self.loops.reduce, self.J) * self.loops.column_scale)

    @cached_property
    def whole(self) -> Decomposed:
        """The Jacobian of all rows, scaled and decomposed."""
        return Decomposed.of(self.loops.scaled(self.J))

    @property
    def rank(self) -> int:
        """Least rank of the closures in the batch."""
        return self.whole.rank

    @property
    def free(self) -> Array:
        """Orthonormal basis of the scaled velocities that all rows together allow (n, nv, nv - rank)."""
        return self.whole.tangent(self.rank)
