"""Conic programs as data: what is asked, in cones, without a word on how it is solved.

    minimise  x.P x / 2 + q.x      subject to      g + G x in K

K is a product of zero cones, half-lines, second-order cones and cones of positive semidefinite matrices.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array

__all__ = ["CONES", "Block", "Problem", "Program", "outside", "smat", "svec"]

CONES = ("zero", "nonneg", "soc", "psd")  # in the order in which programs hold them
ROOT2 = float(np.sqrt(2.0))


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Rows g + G x in one cone: "zero", "nonneg", "soc" or "psd" (scaled upper triangle, column by column).

    Attributes:
        label: what the rows mean, for certificates; one for the block or one per row.
        G: (rows, n).
        g: (rows,).
        inward: direction into the cone (rows,): a margin subtracts this much from g.
    """

    label: str | tuple[str, ...]
    cone: str
    G: Array
    g: Array
    inward: Array | None = None


class Program:
    """The constraints of one problem, assembled once and solved for many objectives.

    Attributes:
        n: number of variables.
        blocks: in the order of `CONES`.
        G, g, inward: of all blocks together (rows, n), (rows,), (rows,).
        slices: rows of each block.
    """

    def __init__(self, n: int, blocks: Sequence[Block]) -> None:
        """Put blocks together; those with fewer than n columns leave the last variables alone."""
        self.n = n
        self.blocks = sorted(blocks, key=lambda b: CONES.index(b.cone))
        self.G = np.zeros((sum(b.g.size for b in self.blocks), n))
        self.g = np.concatenate([b.g for b in self.blocks]) if blocks else np.zeros(0)
        self.inward = np.concatenate(
            [np.zeros(b.g.size) if b.inward is None else b.inward for b in self.blocks] or [np.zeros(0)]
        )
        ends = np.cumsum([b.g.size for b in self.blocks])
        self.slices = [slice(int(e) - b.g.size, int(e)) for e, b in zip(ends, self.blocks, strict=True)]
        for block, part in zip(self.blocks, self.slices, strict=True):
            self.G[part, : block.G.shape[1]] = block.G

    def outside(self, s: Array) -> float:
        """Return how far s (rows,) is outside the cone."""
        return max((outside(b.cone, s[part]) for b, part in zip(self.blocks, self.slices, strict=True)), default=0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
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


def svec(rows: Sequence[Sequence[Array]]) -> Array:
    """Stack linear functionals M_ij (n,) of a symmetric matrix into the scaled triangle of a "psd" block."""
    size = len(rows)
    return np.stack([rows[i][j] * (1.0 if i == j else ROOT2) for j in range(size) for i in range(j + 1)])


def smat(s: Array) -> Array:
    """Return the symmetric matrix of a scaled triangle."""
    size = int(np.sqrt(2 * s.size))
    M = np.zeros((size, size))
    k = 0
    for j in range(size):
        for i in range(j + 1):
            M[i, j] = M[j, i] = s[k] / (1.0 if i == j else ROOT2)
            k += 1
    return M


def outside(cone: str, s: Array) -> float:
    """Return how far s (rows,) is outside one cone; its dual cone is the same but for "zero"."""
    if not s.size:
        return 0.0
    if cone == "zero":
        return float(np.abs(s).max())
    if cone == "nonneg":
        return max(0.0, -float(s.min()))
    if cone == "soc":
        return max(0.0, float(np.linalg.norm(s[1:]) - s[0]))
    return max(0.0, -float(np.linalg.eigvalsh(smat(s))[0]))
