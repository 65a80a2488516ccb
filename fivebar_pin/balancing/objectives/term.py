"""A term of an objective as a function of the variables: epigraphs t >= term(design), and bounds on the same."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.solvers import Block

__all__ = ["Term", "linear_term"]


@dataclass(frozen=True, slots=True, eq=False)
class Term(Immutable):
    """One term as a function of the design variables y: a linear one, or lengths of vectors.

    Attributes:
        name: what certificates call it.
        vectors: affine vectors (G (d, n), g (d,)) whose longest length is the term; a linear term has one row and
            may be negative.
        signed: whether the single row counts with its sign.
        scale: typical size, in the term's unit.
    """

    name: str
    vectors: tuple[tuple[Array, Array], ...]
    signed: bool
    scale: float

    def largest(self, sizes: Array) -> float:
        """Return a bound on |term| / scale over all |y_i| <= sizes_i (n,)."""
        tops = (np.linalg.norm(np.abs(G) @ sizes + np.abs(g), axis=1).max() for G, g in self._stacks())
        return max(float(top) for top in tops) / self.scale

    def epigraph(self, column: int) -> list[Block]:
        """Return the cones of scale * y[column] >= term, for a variable after those of the design."""
        bound = np.zeros(column + 1)
        bound[column] = 1.0
        return self._below(bound, np.zeros(1), f"epigraph of {self.name}")

    def bounded(self, limit: float) -> list[Block]:
        """Return the cones of term <= limit."""
        n = self.vectors[0][0].shape[1]
        return self._below(np.zeros(n), np.array([limit / self.scale]), f"{self.name} <= {limit:g}")

    def _below(self, bound: Array, offset: Array, label: str) -> list[Block]:
        """Return the cones of term / scale <= bound @ y + offset."""
        blocks, flat = [], []
        for G, g in self._stacks():
            k, d, n = G.shape
            rows = np.zeros((k, d + 1, bound.size))
            rows[:, 0], rows[:, 1:, :n] = bound, G / self.scale
            right = np.concatenate([np.broadcast_to(offset, (k, 1)), g / self.scale], axis=1)
            if d > 1:
                inward = np.eye(d + 1)[0]
                blocks += [Block(label, "soc", rows[i], right[i], inward) for i in range(k)]
                continue
            flat.append((rows[:, 0] - rows[:, 1], right[:, 0] - right[:, 1]))
            if not self.signed:
                flat.append((rows[:, 0] + rows[:, 1], right[:, 0] + right[:, 1]))
        if flat:
            right = np.concatenate([c for _, c in flat])
            blocks.append(Block(label, "nonneg", np.concatenate([r for r, _ in flat]), right, np.ones(right.size)))
        return blocks

    def _stacks(self) -> list[tuple[Array, Array]]:
        """Return the vectors of each length together: G (k, d, n), g (k, d)."""
        lengths = sorted({len(g) for _, g in self.vectors})
        together = [[(G, g) for G, g in self.vectors if len(g) == d] for d in lengths]
        return [(np.stack([G for G, _ in group]), np.stack([g for _, g in group])) for group in together]


def linear_term(name: str, row: Array, constant: float, scale: float) -> Term:
    """Make a term row @ y + constant."""
    return Term(name, ((row[None], np.array([constant])),), True, scale)
