"""The rank of closures: the decomposition of their scaled Jacobian, and every bound that decides on it.

Rows and columns of the Jacobian are brought to one unit first (`Loops.scaled`: lengths over the chain's own), so that
its singular values are numbers of size one, whatever the units and the size of the mechanism. With J = U diag(s) V^T

    rank        how many s count
    tangent     the last columns of V: velocities that keep the loops closed, whatever joints are driven
    solve       the velocity of least length that changes the closure rows by given rates
    carry       the closure forces of least norm that carry given joint torques
    left_null   combinations of rows that say nothing: forces that the closures can hold against each other
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, block_svd, inverse
from fivebar_pin.engine.tables import ROUNDED

__all__ = [
    "BRANCHING",
    "HELD",
    "LEFT_OUT",
    "RANK_TOLERANCE",
    "SINGULAR",
    "TIED",
    "UNDRIVEN",
    "Decomposed",
    "Factored",
    "factored",
    "pseudo_inverse",
    "raised",
    "ranks_of",
    "singular_values",
    "smallest_values",
    "truncated_inverse",
]


RANK_TOLERANCE = 1e-9
"""Singular value that counts, as part of the largest, of one at least [-].

Zeros come out as 1e-16 times the entries and the depth of the tree; mechanisms made overconstrained on purpose have
dimensions right to 1e-12 and closures that are closed as far.
"""
SINGULAR = 1e-7
"""Singular value below which the motion along its direction counts as undetermined [-].

A residual of round-off, 1e-15, leaves such a coordinate open by 1e-8, and its accelerations, which go with the square
of the inverse, without a digit.
"""
LEFT_OUT = 1e-6
"""Singular value left out of a Newton step in all coordinates, as part of the largest [-].

Far from the closed configurations a direction so flat leads nowhere; at them it makes no difference.
"""
HELD = 1e-6
"""Singular value of the passive columns down to which the motors still hold the mechanism for certain [-].

Ten times the one at which they do not, so that samples taken above it can be driven.
"""
UNDRIVEN = 1e-12
"""Singular value of the motors' part of the tangent below which they do not determine a simulated motion at all [-].

A simulation does not need the motors to determine it: all that it can say of its motors is said, down to round-off.
"""
BRANCHING = 1e-3
"""Singular value of all columns below which two branches of a mechanism are too near to be told apart on a walk [-].

Steps are corrected by amounts that go with the square of their length over this value.
"""
TIED = 1e-6
"""Rate of the closures along a tangent of the dimension expected, above which the rank is more than expected [-]."""

Ranks = int | npt.NDArray[np.intp]

_WHOLE = 4000
"""Entries of a Jacobian from which on its singular values are computed block by block."""


@dataclass(frozen=True, slots=True, eq=False)
class Decomposed:
    """Scaled closure Jacobians J = U diag(s) V^T of a batch of configurations, k = min(m, nv).

    Attributes:
        U: (n, m, m).
        s: singular values, descending (n, k).
        Vt: (n, nv, nv).
        misfit: scaled residual of closures that are met as far as they can be [-], see `Loops`.

    Wherever a method takes a rank, it is that to work with for the whole batch; forces take one for each configuration
    too (n,), since what closures carry at one must not depend on what they can carry at another.
    """

    U: Array
    s: Array
    Vt: Array
    misfit: float = 0.0

    @staticmethod
    def of(J: Array, misfit: float = 0.0) -> Decomposed:
        """Decompose scaled Jacobians (n, m, nv); a single one block by block when it is large."""
        n, m, nv = J.shape
        if not m:
            return Decomposed(np.zeros((n, 0, 0)), np.zeros((n, 0)), np.broadcast_to(np.eye(nv), (n, nv, nv)), misfit)
        if n == 1:
            U, s, Vt = block_svd(J[0])
            return Decomposed(U[None], s[None], Vt[None], misfit)
        return Decomposed(*np.linalg.svd(J, full_matrices=True), misfit)

    @property
    def ranks(self) -> npt.NDArray[np.intp]:
        """Rank at every configuration (n,)."""
        return ranks_of(self.s, self.misfit)

    @property
    def rank(self) -> int:
        """Least rank in the batch."""
        return int(self.ranks.min(initial=self.s.shape[1]))

    def tangent(self, rank: int) -> Array:
        """Return an orthonormal basis of the velocities that keep the loops closed, scaled (n, nv, nv - rank)."""
        return np.swapaxes(self.Vt[:, rank:], 1, 2)

    def smallest(self, rank: int) -> Array:
        """Return the smallest singular value that counts (n,); one where nothing is closed."""
        return np.asarray(self.s[:, rank - 1]) if rank else np.ones(self.s.shape[0])

    def rate(self, velocity: Array) -> Array:
        """Return the largest rate of the closures, along their own axes, at velocities (n, nv), scaled -> (n,)."""
        along = np.einsum("nrk,nk->nr", self.Vt[:, : self.s.shape[1]], velocity)
        return np.asarray(np.abs(self.s * along).max(axis=1, initial=0.0))

    def solve(self, rows: Array, rank: int) -> Array:
        """Return the velocity of least length (n, nv) with these rates of the closures (n, m), both scaled."""
        return np.asarray(np.einsum("nrk,nr->nk", self.Vt[:, :rank], self.components(rows, rank)))

    def components(self, rows: Array, rank: int) -> Array:
        """Return the components (n, rank) of the same along the first rows of Vt; not finite where J lacks this rank.

        The decomposition of one configuration serves many rates.
        """
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            return np.asarray(np.einsum("nir,ni->nr", self.U[:, :, :rank], rows) / self.s[:, :rank])

    def carry(self, torque: Array, rank: Ranks) -> Array:
        """Return the closure forces of least norm (n, m) that carry torques (n, nv), both scaled: J^T f = torque."""
        k = self.s.shape[1]
        loaded = np.matmul(self.Vt[:, :k], torque[..., None])[..., 0] * self._reciprocal(rank)
        return np.asarray(np.matmul(self.U[:, :, :k], loaded[..., None])[..., 0])

    def carrier(self, rank: Ranks) -> Array:
        """Return the map (n, m, nv) from torques to the same forces."""
        k = self.s.shape[1]
        return np.asarray(np.matmul(self.U[:, :, :k] * self._reciprocal(rank)[:, None, :], self.Vt[:, :k]))

    def left_null(self, rank: Ranks) -> Array:
        """Return combinations of rows that vanish, orthonormal (n, m - least rank, m), or zero where fewer do."""
        least = int(np.min(rank, initial=self.U.shape[1]))
        null = np.swapaxes(self.U[:, :, least:], 1, 2)
        vanishes = np.arange(least, self.U.shape[1]) >= np.reshape(rank, (-1, 1))
        return null if vanishes.all() else np.where(vanishes[..., None], null, 0.0)

    def _reciprocal(self, rank: Ranks) -> Array:
        counts = np.arange(self.s.shape[1]) < np.reshape(rank, (-1, 1))
        return np.where(counts, 1.0 / np.where(self.s > 0.0, self.s, 1.0), 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Factored:
    """The same for a rank that is known beforehand, cheaper.

    Attributes:
        tangent: orthonormal basis of the velocities that keep the loops closed (n, nv, nv - rank).
        back: pseudo-inverse of the Jacobian (n, nv, m).
        sigma: lower estimate of the smallest singular value that counts (n,).
        tied: largest rate of the closures along the tangent (n,); above round-off where the rank is more.
    """

    tangent: Array
    back: Array
    sigma: Array
    tied: Array


def factored(J: Array, rank: int) -> Factored:
    """Factorise scaled Jacobians (n, m, nv) of a rank: by Q R when it is that of all rows."""
    n, m, nv = J.shape
    if not m:
        T = np.broadcast_to(np.eye(nv), (n, nv, nv))
        return Factored(T, np.zeros((n, nv, 0)), np.ones(n), np.zeros(n))
    if m == rank:
        Q, R = np.linalg.qr(np.swapaxes(J, 1, 2), mode="complete")
        X, _ = inverse(np.swapaxes(R[:, :rank], 1, 2))
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            sigma = 1.0 / np.sqrt(np.einsum("nij,nij->n", X, X))
            back = np.matmul(Q[:, :, :rank], X)
        return Factored(Q[:, :, rank:], back, np.where(np.isfinite(sigma), sigma, 0.0), np.zeros(n))
    U, s, Vt = np.linalg.svd(J)  # rows that depend on each other wherever the loops are closed
    V = np.swapaxes(Vt, 1, 2)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        back = np.matmul(V[:, :, :rank] / s[:, None, :rank], np.swapaxes(U[:, :, :rank], 1, 2))
    return Factored(V[:, :, rank:], back, s[:, rank - 1] if rank else np.ones(n), s[:, rank])


def raised(bound: float, misfit: float) -> float:
    """Return a bound on singular values, residuals or rates, raised to what rows with that misfit leave of them."""
    return max(bound, ROUNDED * misfit)


def ranks_of(s: Array, misfit: float = 0.0) -> npt.NDArray[np.intp]:
    """Return the rank that singular values (..., k), descending, stand for (...), of closures with that misfit."""
    least = raised(RANK_TOLERANCE, misfit)
    return np.asarray(np.sum(s > least * np.maximum(1.0, s[..., :1]), axis=-1))


def singular_values(J: Array) -> Array:
    """Return the singular values of one scaled Jacobian (m, nv), descending, without its vectors."""
    if 0 in J.shape:
        return np.zeros(0)
    return np.asarray(np.linalg.svd(J, compute_uv=False) if J.size < _WHOLE else block_svd(J)[1])


def smallest_values(M: Array) -> Array:
    """Return the smallest singular values of a batch of matrices (n, k, f) -> (n,)."""
    return np.asarray(np.linalg.svd(M, compute_uv=False)[:, -1])


def truncated_inverse(J: Array, misfit: float = 0.0) -> Array:
    """Return pseudo-inverses (n, nv, m) of scaled Jacobians without their flat directions, see `LEFT_OUT`."""
    return np.asarray(np.linalg.pinv(J, rcond=raised(LEFT_OUT, misfit)))


def pseudo_inverse(J: Array) -> tuple[Array, Array]:
    """Return pseudo-inverses of a batch of tall matrices and their smallest singular values, zero where not tall."""
    U, s, Vt = np.linalg.svd(J, full_matrices=False)
    smallest = s[:, -1] if J.shape[1] >= J.shape[2] > 0 else np.zeros(J.shape[0])
    with np.errstate(divide="ignore", invalid="ignore"):
        X = np.matmul(np.swapaxes(Vt, 1, 2) / s[:, None, :], np.swapaxes(U, 1, 2))
    return X, smallest
