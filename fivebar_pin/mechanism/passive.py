"""What the closures make of the passive coordinates, group by group.

Closures that share no passive joint do not act on each other once the actuated coordinates are given: each group is
inverted alone. The mechanism is as near to a type 2 singularity as the nearest of its groups.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, inverse
from fivebar_pin.mechanism.rank import pseudo_inverse

__all__ = ["Group", "PassiveMap", "passive_map"]


@dataclass(frozen=True, slots=True, eq=False)
class Group:
    """Closures that share passive joints; groups are independent of each other given the actuated coordinates."""

    members: tuple[int, ...]  # closures
    rows: npt.NDArray[np.intp]  # of J
    columns: npt.NDArray[np.intp]  # velocity coordinates that move some of the rows
    passive: npt.NDArray[np.intp]  # positions in `Loops.passive`
    passive_columns: npt.NDArray[np.intp]  # the same, positions in `columns`
    actuated: npt.NDArray[np.intp]  # positions in `Loops.actuated`
    actuated_columns: npt.NDArray[np.intp]
    reduce: Array  # independent row combinations (r, rows)
    scale: Array  # of the passive columns

    @property
    def is_square(self) -> bool:
        return bool(self.reduce.shape[0] == self.passive.size)


@dataclass(frozen=True, slots=True, eq=False)
class PassiveMap:
    """What takes the actuated coordinates to the passive ones at a batch of configurations.

    Attributes:
        groups: the independent groups of closures.
        X: per group, pseudo-inverse of the passive columns of its reduced rows (n, np_g, r_g); nan where singular.
        sigma: lower estimate of their smallest singular value over all groups, scaled [-] (n,).
        sign: sign of their determinant, per group; one where they are not square (n, groups).
        size: number of passive and actuated coordinates.
    """

    groups: list[Group]
    X: list[Array]
    sigma: Array
    sign: Array
    size: tuple[int, int]

    def solve(self, rows: Array) -> Array:
        """Return the passive tangent that changes the closure rows (n, m) by this much, (n, np)."""
        out = np.zeros((rows.shape[0], self.size[0]))
        for g, X in zip(self.groups, self.X, strict=True):
            out[:, g.passive] = np.matmul(X, (rows[:, g.rows] @ g.reduce.T)[..., None])[..., 0]
        return out

    def complement(self, blocks: list[Array]) -> Array:
        """Return the passive rows of the complement (n, np, na) from the Jacobian's blocks."""
        out = np.zeros((self.sigma.size, *self.size))
        for g, X, J in zip(self.groups, self.X, blocks, strict=True):
            if g.actuated.size:
                out[:, g.passive[:, None], g.actuated] = -np.matmul(X, np.matmul(g.reduce, J[:, :, g.actuated_columns]))
        return out


def passive_map(groups: list[Group], blocks: list[Array], n: int, size: tuple[int, int]) -> PassiveMap:
    """Invert the passive columns of the Jacobian's blocks at n samples. Singular ones get sigma = 0 and X = nan."""
    X, sigma, sign = [], np.full(n, 1.0), np.ones((n, len(groups)))
    for k, (g, J) in enumerate(zip(groups, blocks, strict=True)):
        Jp = np.matmul(g.reduce, J[:, :, g.passive_columns]) * g.scale
        if g.is_square:
            inverted, determinant = inverse(Jp)
            sign[:, k] = np.sign(determinant)
            with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
                smallest = 1.0 / np.sqrt(np.einsum("nij,nij->n", inverted, inverted))
        else:
            inverted, smallest = pseudo_inverse(Jp)
        X.append(g.scale[:, None] * inverted)
        if g.passive.size:
            smallest = np.where(np.isfinite(smallest), smallest, 0.0)
            sigma = smallest if len(groups) == 1 else np.minimum(sigma, smallest)
    return PassiveMap(groups, X, sigma, sign, size)
