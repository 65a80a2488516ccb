"""The logarithmic barrier of a product of cones, by factors: its Hessian is M^T M, its gradient -M^T v.

    half-line:            -log s                M = 1 / s                                    v = 1
    second-order cone:    -log(t^2 - |u|^2)     M = sqrt(2 / w) B, w = t^2 - |u|^2           v = (sqrt 2, 0, ..)
    semidefinite cone:    -log det S            M: D -> L^-1 D L^-T with S = L L^T           v = identity

with B = [[x, -y^T], [-y, 1 + y y^T / (1 + x)]], (x, y) = (t, u) / sqrt(w). [Nesterov, Nemirovskii 1994]

Cones of one kind and size are handled together: rows of k cones are arrays (k, size).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.solvers.cones import ROOT2

__all__ = ["Barrier", "barriers"]


@dataclass(frozen=True, eq=False)
class Barrier(ABC):
    """The barrier of k cones of one kind.

    Attributes:
        rows: indices of their rows in the program (k, size).
    """

    rows: Array

    @property
    def v(self) -> Array:
        """Return M times the point itself (k, size)."""
        return np.tile(self.unit * self.scale, (len(self.rows), 1))

    @property
    def degree(self) -> float:
        """Return the parameter of the barrier: what it adds to the gap."""
        return float((self.v**2).sum())

    @property
    @abstractmethod
    def unit(self) -> Array:
        """Return a point well inside one cone (size,)."""

    @property
    def scale(self) -> float:
        """Return the length of v over that of the unit."""
        return 1.0

    @abstractmethod
    def depth(self, s: Array) -> Array:
        """Return how far inside points s (k, size) are (k,); not positive outside."""

    @abstractmethod
    def factor(self, s: Array, D: Array) -> Array:
        """Return M D for points s (k, size) and D (k, size, any)."""

    @abstractmethod
    def back(self, s: Array, V: Array) -> Array:
        """Return M^T V for points s (k, size) and V (k, size)."""


@dataclass(frozen=True, eq=False)
class HalfLines(Barrier):
    """Barrier of half-lines."""

    @property
    def unit(self) -> Array:
        """Return one."""
        return np.ones(1)

    def depth(self, s: Array) -> Array:
        """Return the entries."""
        return np.asarray(s[:, 0])

    def factor(self, s: Array, D: Array) -> Array:
        """Divide by the point."""
        return np.asarray(D / s[:, :, None])

    def back(self, s: Array, V: Array) -> Array:
        """Divide by the point."""
        return np.asarray(V / s)


@dataclass(frozen=True, eq=False)
class SecondOrder(Barrier):
    """Barrier of second-order cones."""

    @property
    def unit(self) -> Array:
        """Return the axis."""
        e = np.zeros(self.rows.shape[1])
        e[0] = 1.0
        return e

    @property
    def scale(self) -> float:
        """Return sqrt 2: the barrier counts twice."""
        return ROOT2

    def depth(self, s: Array) -> Array:
        """Return t - |u|."""
        return np.asarray(s[:, 0] - np.linalg.norm(s[:, 1:], axis=1))

    def factor(self, s: Array, D: Array) -> Array:
        """Apply sqrt(2 / w) B."""
        size = np.linalg.norm(s[:, 1:], axis=1)
        root = np.sqrt((s[:, 0] - size) * (s[:, 0] + size))
        x, y = (s[:, 0] / root)[:, None, None], s[:, 1:, None] / root[:, None, None]
        along = (y * D[:, 1:]).sum(axis=1, keepdims=True)
        top = x * D[:, :1] - along
        low = D[:, 1:] + y * (along / (1.0 + x) - D[:, :1])
        return np.asarray(np.concatenate([top, low], axis=1) * (ROOT2 / root)[:, None, None])

    def back(self, s: Array, V: Array) -> Array:
        """Apply the same: it is symmetric."""
        return self.factor(s, V[:, :, None])[:, :, 0]


@dataclass(frozen=True, eq=False)
class Semidefinite(Barrier):
    """Barrier of semidefinite cones, by their factors S = L L^T."""

    @property
    def order(self) -> int:
        """Return the order of the matrices."""
        return int(np.sqrt(2 * self.rows.shape[1]))

    @property
    def unit(self) -> Array:
        """Return the identity."""
        return np.asarray(_triangles(np.eye(self.order)[None])[0])

    def depth(self, s: Array) -> Array:
        """Return the smallest eigenvalues."""
        return np.asarray(np.linalg.eigvalsh(_matrices(s, self.order))[:, 0])

    def factor(self, s: Array, D: Array) -> Array:
        """Return L^-1 D L^-T."""
        inverse = np.linalg.inv(np.linalg.cholesky(_matrices(s, self.order)))[:, None]
        turned = inverse @ _matrices(np.moveaxis(D, 2, 1), self.order) @ np.swapaxes(inverse, 2, 3)
        return np.asarray(np.moveaxis(_triangles(turned), 2, 1))

    def back(self, s: Array, V: Array) -> Array:
        """Return L^-T V L^-1."""
        inverse = np.linalg.inv(np.linalg.cholesky(_matrices(s, self.order)))
        return _triangles(np.swapaxes(inverse, 1, 2) @ _matrices(V, self.order) @ inverse)


_KINDS: dict[str, type[Barrier]] = {"nonneg": HalfLines, "soc": SecondOrder, "psd": Semidefinite}


def barriers(cones: Sequence[tuple[str, slice]]) -> list[Barrier]:
    """Return the barriers of cones and the rows they have, cones of one kind and size together."""
    groups: dict[tuple[str, int], list[Array]] = {}
    for cone, part in cones:
        rows = np.arange(part.start, part.stop)
        if cone == "nonneg":
            groups.setdefault((cone, 1), []).extend(rows[:, None])
        elif cone != "zero":
            groups.setdefault((cone, rows.size), []).append(rows)
    return [_KINDS[cone](np.stack(rows)) for (cone, _), rows in groups.items()]


def _places(order: int) -> tuple[Array, Array, Array]:
    """Return row, column and factor of every entry of a scaled triangle."""
    i, j = np.array([(i, j) for j in range(order) for i in range(j + 1)]).T
    return i, j, np.where(i == j, 1.0, ROOT2)


def _matrices(s: Array, order: int) -> Array:
    """Return the symmetric matrices (..., order, order) of scaled triangles (..., size)."""
    i, j, scale = _places(order)
    M = np.empty((*s.shape[:-1], order, order))
    M[..., i, j] = M[..., j, i] = s / scale
    return M


def _triangles(M: Array) -> Array:
    """Return the scaled triangles (..., size) of symmetric matrices (..., order, order)."""
    i, j, scale = _places(M.shape[-1])
    return np.asarray(M[..., i, j] * scale)
