"""Configurations of a chain and what its closures are there, each thing computed when it is first asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, lazy
from fivebar_pin.mechanism.loops import Loops, Seen
from fivebar_pin.mechanism.passive import PassiveMap
from fivebar_pin.mechanism.rank import Decomposed, Factored, factored
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

    @lazy
    def poses(self) -> Poses:
        """Poses of the joints."""
        return self.loops.tree.poses(self.q)

    @lazy
    def seen(self) -> Seen:
        """What the closures are there."""
        return self.loops.see(self.q)

    @property
    def residual(self) -> Array:
        """All closure rows (n, m) [m, rad]."""
        return self.seen.residual

    @lazy
    def gap(self) -> Array:
        """Largest of them (n,) [m or rad]; a row of coordinates counts as if its largest ratio were one."""
        return np.asarray(np.abs(self.residual * self.loops.unit).max(axis=1, initial=0.0))

    @lazy
    def reduced(self) -> Array:
        """Independent combinations of the closure rows, scaled (n, r)."""
        return np.asarray(self.residual @ self.loops.reduce.T)

    @property
    def J(self) -> Array:
        """The closure Jacobian (n, m, nv)."""
        return self.seen.J

    @lazy
    def blocks(self) -> list[Array]:
        """The closure Jacobian per independent group of closures."""
        return self.loops.blocks(self.J)

    @lazy
    def passive(self) -> PassiveMap:
        """What takes the actuated coordinates to the passive ones."""
        return self.loops.passive_map(self.blocks, self.q.shape[0])

    @property
    def error(self) -> Array:
        """Largest scaled closure row (n,) [-]."""
        return np.asarray(np.abs(self.residual * self.loops.row_scale).max(axis=1, initial=0.0))

    @lazy
    def factored(self) -> Factored:
        """The same as `independent` where the actuated joints tell the mobility, cheaper."""
        loops = self.loops
        J = np.matmul(loops.reduce, self.J) * loops.column_scale
        return factored(J, loops.tree.nv - loops.actuated.size)

    @lazy
    def independent(self) -> Decomposed:
        """The Jacobian of the independent combinations of rows, scaled and decomposed."""
        return Decomposed.of(np.matmul(self.loops.reduce, self.J) * self.loops.column_scale, self.loops.misfit)

    @lazy
    def whole(self) -> Decomposed:
        """The Jacobian of all rows, scaled and decomposed."""
        return Decomposed.of(self.loops.scaled(self.J), self.loops.misfit)

    @property
    def rank(self) -> int:
        """Least rank of the closures in the batch."""
        return self.whole.rank

    @property
    def free(self) -> Array:
        """Orthonormal basis of the scaled velocities that all rows together allow (n, nv, nv - rank)."""
        return self.whole.tangent(self.rank)
