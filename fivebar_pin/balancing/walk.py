"""Walking on the closed configurations of a chain.

With J the scaled closure Jacobian, r its rank at closed configurations and T the last nv - r directions of a complete
orthogonal factorisation of J, velocities T x keep the loops closed, whatever joints are actuated. A step goes along T
and comes back to the closures by Newton steps of least length in all coordinates; so it does not stop where the
actuated joints lose control, only where the mechanism itself branches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.mechanism.closing import Limits
from fivebar_pin.mechanism.loops import Loops
from fivebar_pin.mechanism.rank import inverse

__all__ = ["HELD", "Ground", "Walk", "close", "ground"]

HELD = 1e-6  # scaled smallest singular value of the passive columns where the motors still hold the mechanism [-]
_REGULAR = 1e-3  # scaled smallest singular value of all columns where the mechanism does not branch [-]
_LONGEST, _SHORTEST = 0.7, 1e-4  # steps of a walk [rad, or chain lengths]
_CAREFUL = 0.2  # longest step of a careful walk over the smallest singular value [rad, or chain lengths]
_TIED = 1e-6  # scaled closure rate that velocities along the tangent may have left [-]
_CLOSED = 1e-11  # scaled closure residual of a closed configuration [rad, or chain lengths]
_NEARLY = 1e-9  # scaled residual below which one more Newton step reaches round-off [rad, or chain lengths]
_NEWTON = 8  # steps of Newton's method
_DETOUR, _FREE = 0.4, 0.01  # longest way back to the closures, as a share of a step that is at least so long


@dataclass(frozen=True, slots=True, eq=False)
class Ground(Immutable):
    """Where a batch of walkers stands.

    Attributes:
        q: configurations (n, nq).
        residual: largest closure row, scaled (n,).
        reduced: independent combinations of the rows, scaled (n, r).
        T: orthonormal tangent space, scaled (n, nv, na).
        back: pseudo-inverse of the scaled Jacobian (n, nv, r).
        sigma: lower estimate of the smallest singular value of the scaled Jacobian (n,).
        tied: scaled rate of the closures along T (n,); above round-off where the actuated joints are too many.
        control: the same estimate as sigma for the passive columns alone (n,).
        sign: sign of the determinant of these, per group of closures (n, groups).
    """

    q: Array
    residual: Array
    reduced: Array
    T: Array
    back: Array
    sigma: Array
    tied: Array
    control: Array
    sign: Array

    def regular(self) -> npt.NDArray[np.bool_]:
        """Return where it is closed and the mechanism does not branch (n,)."""
        return np.asarray((self.residual <= _CLOSED) & (self.sigma > _REGULAR) & (self.tied < _TIED))

    def replaced(self, where: npt.NDArray[np.bool_], other: Ground) -> Ground:
        """Return the same with some walkers (n,) moved to where others stand."""
        mixed = {}
        for name in self.__slots__:
            mine, theirs = getattr(self, name), getattr(other, name)
            mixed[name] = np.where(where.reshape(-1, *(1,) * (mine.ndim - 1)), theirs, mine)
        return Ground(**mixed)

    def of(self, index: npt.NDArray[np.intp]) -> Ground:
        """Return some of the walkers."""
        return Ground(**{name: getattr(self, name)[index] for name in self.__slots__})


def ground(loops: Loops, q: Array) -> Ground:
    """Return where walkers at q (n, nq) stand."""
    n, nv, na = q.shape[0], loops.tree.nv, loops.actuated.size
    poses = loops.tree.poses(q)
    if not loops.m:
        T, one, no = np.broadcast_to(np.eye(nv), (n, nv, nv)), np.ones(n), np.zeros((n, 0))
        return Ground(q, np.zeros(n), no, T, np.zeros((n, nv, 0)), one, np.zeros(n), one, np.ones((n, 0)))
    pairs = loops.pairs(poses)
    residual = loops.residual(pairs)
    blocks = loops.blocks(poses, pairs)
    J = np.matmul(loops.reduce, loops.jacobian(poses, pairs)) * loops.column_scale
    passive = loops.passive_map(blocks)
    T, back, sigma, tied = _factored(J, nv - na)
    size = np.abs(residual * loops.row_scale).max(axis=1)
    return Ground(q, size, residual @ loops.reduce.T, T, back, sigma, tied, passive.sigma, passive.sign)


def _factored(J: Array, rank: int) -> tuple[Array, Array, Array, Array]:
    """Return tangent, pseudo-inverse, smallest singular value and rate left for Jacobians (n, r, nv) of a rank."""
    if J.shape[1] == rank:
        Q, R = np.linalg.qr(np.swapaxes(J, 1, 2), mode="complete")
        X, _ = inverse(np.swapaxes(R[:, :rank], 1, 2))
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            sigma = 1.0 / np.sqrt(np.einsum("nij,nij->n", X, X))
            back = np.matmul(Q[:, :, :rank], X)
        return Q[:, :, rank:], back, np.where(np.isfinite(sigma), sigma, 0.0), np.zeros(J.shape[0])
    U, s, Vt = np.linalg.svd(J)  # rows that depend on each other wherever the loops are closed
    V = np.swapaxes(Vt, 1, 2)
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        back = np.matmul(V[:, :, :rank] / s[:, None, :rank], np.swapaxes(U[:, :, :rank], 1, 2))
    return V[:, :, rank:], back, s[:, rank - 1] if rank else np.ones(J.shape[0]), s[:, rank]


def close(loops: Loops, q: Array, longest: Array) -> tuple[Ground, Array]:
    """Bring nearly closed configurations (n, nq) to the closures; what is left shows in the residual.

    Args:
        longest: how far the coordinates may move before a walker is given up (n,) [rad, or chain lengths].

    Returns:
        Where they stand, and how far they moved (n,).
    """
    here = ground(loops, q)
    moved = np.zeros(q.shape[0])
    last = np.zeros(q.shape[0], dtype=np.bool_)
    for _ in range(_NEWTON if loops.m else 0):
        step = -np.matmul(here.back, here.reduced[..., None])[..., 0]
        step[last | ~np.isfinite(step).all(axis=1) | (moved > longest)] = 0.0
        if not step.any():
            break
        last = here.residual < _NEARLY
        moved += np.abs(step).max(axis=1)
        here = ground(loops, loops.tree.integrate(here.q, step * loops.column_scale))
    return here, moved


class Walk:
    """Walkers that wander over the closed configurations, each within what it can reach.

    Args:
        loops: of the chain.
        limits: of the actuated coordinates, kept.
        start: closed, regular configurations (n, nq) within the limits.
        rng: decides on the ways.
        careful: whether walkers turn round before every singularity, those of the actuated joints too. Steps are then
            so short that the smallest singular value cannot pass through zero on the way: where two branches of a
            mechanism meet, nobody jumps from one to the other.
    """

    def __init__(self, loops: Loops, limits: Limits, start: Ground, rng: np.random.Generator, *, careful: bool) -> None:
        self._loops, self._limits, self._rng, self._careful = loops, limits, rng, careful
        self.here = start
        n = start.q.shape[0]
        room = np.min((limits.high - limits.low) / loops.column_scale[limits.index], initial=np.inf)
        self._shortest = min(_SHORTEST, 0.05 * float(room)) if room > 0.0 else _SHORTEST
        self._reach = np.full(n, min(_LONGEST, max(0.5 * float(room), self._shortest)))
        self._heading = self._straight(rng.normal(size=(n, loops.tree.nv)))

    def step(self) -> Ground:
        """Let every walker take a step, shorter next time where it could not; return where those stand that could."""
        loops, here = self._loops, self.here
        along = np.matmul(here.T, np.matmul(np.swapaxes(here.T, 1, 2), self._heading[..., None]))[..., 0]
        length = np.minimum(self._reach, _CAREFUL * here.sigma) if self._careful else self._reach
        length = length * self._rng.uniform(0.3, 1.0, length.size)
        step = along * (length / np.maximum(np.abs(along).max(axis=1, initial=0.0), 1e-12))[:, None]
        longest = _DETOUR * np.maximum(length, _FREE)
        there, detour = close(loops, loops.tree.integrate(here.q, step * loops.column_scale), longest)
        went = there.regular() & (detour <= longest) & self._limits.inside(loops, there.q)
        if self._careful:
            went &= (there.sign == here.sign).all(axis=1) & (there.control > HELD)
        self.here = here.replaced(went, there)
        self._reach = np.clip(np.where(went, 1.5, 0.5) * self._reach, self._shortest, _LONGEST)
        turned = np.where(went[:, None], along, -along)
        size = np.linalg.norm(turned, axis=1, keepdims=True)
        self._heading = self._straight(turned / np.maximum(size, 1e-12) + self._noise())
        return there.of(np.flatnonzero(went))

    def _noise(self) -> Array:
        shape = self._heading.shape
        return np.asarray(0.3 * self._rng.normal(size=shape) / np.sqrt(shape[1]))

    def _straight(self, heading: Array) -> Array:
        """Return headings (n, nv) along the tangent space, of length one."""
        T = self.here.T
        along = np.matmul(T, np.matmul(np.swapaxes(T, 1, 2), heading[..., None]))[..., 0]
        return np.asarray(along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12))
