"""The terms of an objective as epigraphs t >= term(design), and bounds on the same terms."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, reals
from fivebar_pin.balancing.regressors.measures import MEASURES, Rows
from fivebar_pin.balancing.solvers import Block
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = [
    "LINEAR",
    "TERMS",
    "Term",
    "base",
    "check_terms",
    "first",
    "linear_term",
    "measure_of",
    "positive_limit",
    "rows_term",
    "torque_limits",
]

_NOWHERE = 1e-15  # share of a direction in vectors along motions that is round-off [-]
LINEAR = ("added_mass", "inertia")
TERMS = (*LINEAR, "distance", *(f"{s}_{m}" for m in MEASURES for s in ("rms", "peak", "mean_square")))


def base(term: str) -> str:
    """Return the term whose epigraph a term uses: a mean square is the square of an rms."""
    return term.replace("mean_square_", "rms_")


def check_terms(names: Mapping[str, object] | tuple[str, ...], what: str) -> None:
    """Raise for a term that does not exist."""
    for name in names:
        if name not in TERMS:
            raise UnknownNameError(what, name, TERMS)


def measure_of(term: str) -> str | None:
    """Return the quantity along motions that a term needs, or None."""
    for name in MEASURES:
        if term.endswith(name):
            return name
    return None


@dataclass(frozen=True, slots=True, eq=False)
class Term(Immutable):
    """One term as a function of the design variables y: a linear one, or lengths of vectors.

    Attributes:
        name: base name.
        vectors: affine vectors (G (d, n), g (d,)) whose longest length is the term; a linear term has one row and
            may be negative.
        signed: whether the single row counts with its sign.
        scale: typical size, in the term's unit.
        measured: the term of bodies that have given parameters (nb, 10); `value` at what they were lifted from.
    """

    name: str
    vectors: tuple[tuple[Array, Array], ...]
    signed: bool
    scale: float
    measured: Callable[[Array], float]

    def value(self, y: Array) -> float:
        """Return the term at y (n,)."""
        if self.signed:
            G, g = self.vectors[0]
            return float((G @ y + g)[0])
        return max(float(np.linalg.norm(G @ y + g, axis=1).max()) for G, g in self._stacks())

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
                inward = first(d + 1)
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


def first(size: int) -> Array:
    """Return the first unit vector."""
    e = np.zeros(size)
    e[0] = 1.0
    return e


def linear_term(name: str, row: Array, constant: float, scale: float, measured: Callable[[Array], float]) -> Term:
    """Make a term row @ y + constant."""
    return Term(name, ((row[None], np.array([constant])),), True, scale, measured)


def rows_term(name: str, rows: Rows, E: Array, pi0: Array, present: Array) -> Term:
    """Make the rms or peak of rows over designs pi = E y + pi0 (10 nb,).

    Args:
        present: parameters (10 nb,) that give the term its scale.
    """
    G, g = rows.F @ E, rows.F @ pi0 + rows.f
    if name.startswith("rms_"):
        stacked = np.column_stack([G.reshape(-1, G.shape[-1]), g.reshape(-1)]) / np.sqrt(len(g))
        R = np.asarray(np.linalg.qr(stacked, mode="r"))
        used = np.abs(R).max(axis=1) > 1e-16 * float(np.abs(R).max(initial=0.0))
        R = R[used] if used.any() else R[:1]
        value = rows.rms(present)
        vectors: tuple[tuple[Array, Array], ...] = ((R[:, :-1], R[:, -1]),)
    else:
        value = rows.peak(present)
        vectors = tuple(pair for s in rows.groups for pair in _thin(G[:, s], g[:, s]))
    without = float(np.abs(rows.F * np.abs(present)).max(initial=0.0))
    measured = rows.rms if name.startswith("rms_") else rows.peak
    return Term(name, vectors, False, value if value > 1e-3 * without else (without or 1.0), measured)


def _thin(G: Array, g: Array) -> list[tuple[Array, Array]]:
    """Return vectors G y + g of the same lengths without the directions in which none ever points.

    A moment about the normal of a plane is one row instead of three: its cone is a pair of bounds.

    Args:
        G, g: one vector a sample (n, d, k), (n, d).
    """
    if g.shape[1] > 1:
        whole = np.moveaxis(np.concatenate([G, g[..., None]], axis=2), 1, 0).reshape(g.shape[1], -1)
        axes, size, _ = np.linalg.svd(whole, full_matrices=False)
        axes = axes[:, size > _NOWHERE * size[0]] if size[0] > 0.0 else axes[:, :1]
        G, g = np.matmul(axes.T, G), g @ axes
    return list(zip(G, g, strict=True))


def torque_limits(limit: npt.ArrayLike, rows: Rows, E: Array, pi0: Array) -> list[Block]:
    """Return the cones of |torque of every motor| <= its limit; one limit for all motors or one for each."""
    given = np.atleast_1d(reals("limit of peak_torque", limit))
    if given.shape not in ((1,), (len(rows.groups),)):
        raise InvalidInputError("limit of peak_torque", given.tolist(), f"must be one number, or {len(rows.groups)}")
    each = np.broadcast_to(given, (len(rows.groups),))
    G, g = rows.F @ E, rows.F @ pi0 + rows.f
    blocks = []
    for k, label in enumerate(rows.labels):
        top = positive_limit(f"peak_torque of {label}", float(each[k]))
        both = np.concatenate([-G[:, k], G[:, k]]) / top
        offset = 1.0 - np.r_[g[:, k], -g[:, k]] / top
        blocks.append(Block(f"peak_torque of {label} <= {top:g}", "nonneg", both, offset, np.ones(offset.size)))
    return blocks


def positive_limit(name: str, limit: npt.ArrayLike) -> float:
    """Return a bound on a term as a number, checked."""
    value = reals(f"limit of {name}", limit)
    if value.ndim or not (np.isfinite(value) and value > 0.0):
        raise InvalidInputError(f"limit of {name}", limit, "must be one positive and finite number")
    return float(value)
