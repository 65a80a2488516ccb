"""Conic programs as data: what is asked, in cones, without a word on how it is solved.

    minimise  x.P x / 2 + q.x      subject to      g + G x in K

K is a product of zero cones, half-lines, second-order cones and cones of positive semidefinite matrices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.solvers.cones import CONES, outside, projected

__all__ = ["Block", "ConicProblem", "Program"]


@dataclass(frozen=True, slots=True, eq=False)
class Block(Immutable):
    """Rows g + G x in one cone: "zero", "nonneg", "soc" or "psd" (scaled upper triangle, column by column).

    Attributes:
        label: what the rows mean, for certificates; one for the block or one per row.
        G: (rows, n).
        g: (rows,).
        inward: direction into the cone (rows,): a margin subtracts this much from g.
        soft: whether the bound may give way by a hair, where a design exists on its boundary alone.
    """

    label: str | tuple[str, ...]
    cone: str
    G: Array
    g: Array
    inward: Array | None = None
    soft: bool = False


class Program:
    """The constraints of one problem, assembled once and solved for many objectives.

    Attributes:
        n: number of variables.
        blocks: in the order of `CONES`.
        G, g, inward, soft: of all blocks together (rows, n), (rows,), (rows,), (rows,).
        slices: rows of each block.
        sizes: every solution that matters has |x_i| <= sizes_i (n,); infinite unless stated. Bounds and proofs hold
            within them.
    """

    def __init__(self, n: int, blocks: Sequence[Block], sizes: Array | None = None) -> None:
        """Put blocks together; those with fewer than n columns leave the last variables alone."""
        self.sizes = np.full(n, np.inf) if sizes is None else sizes
        self.n = n
        self.blocks = sorted(blocks, key=lambda b: CONES.index(b.cone))
        self.G = np.zeros((sum(b.g.size for b in self.blocks), n))
        self.g = np.concatenate([b.g for b in self.blocks]) if blocks else np.zeros(0)
        self.inward = np.concatenate(
            [np.zeros(b.g.size) if b.inward is None else b.inward for b in self.blocks] or [np.zeros(0)]
        )
        self.soft = np.repeat([b.soft for b in self.blocks], [b.g.size for b in self.blocks]).astype(bool)
        ends = np.cumsum([b.g.size for b in self.blocks])
        self.slices = [slice(int(e) - b.g.size, int(e)) for e, b in zip(ends, self.blocks, strict=True)]
        for block, part in zip(self.blocks, self.slices, strict=True):
            self.G[part, : block.G.shape[1]] = block.G

    def outside(self, s: Array) -> float:
        """Return how far s (rows,) is outside the cone."""
        return max((outside(b.cone, s[part]) for b, part in zip(self.blocks, self.slices, strict=True)), default=0.0)

    def projected(self, z: Array) -> Array:
        """Return the point of the dual cone that is closest to z (rows,)."""
        parts = [projected(b.cone, z[part]) for b, part in zip(self.blocks, self.slices, strict=True)]
        return np.concatenate(parts) if parts else np.zeros(0)


@dataclass(frozen=True, slots=True, eq=False)
class ConicProblem(Immutable):
    """One objective over the constraints of a program.

    Attributes:
        program: the constraints.
        P: diagonal of the quadratic part (n,), not negative.
        q: linear part (n,).
        g: offset (rows,), that of the program but for a margin.
    """

    program: Program
    P: Array
    q: Array
    g: Array
