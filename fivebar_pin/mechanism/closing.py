"""Closing the loops: damped Newton from a poor start, plain Newton from a good one. Passive coordinates only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array
from fivebar_pin.mechanism.loops import Loops

__all__ = ["STEP", "Closed", "Limits", "closed_enough", "polish", "residual_of", "search"]


STEP = 0.5  # longest Newton step of a damped search [rad, or chain lengths]
_POLISHED = 1e-9  # scaled residual below which one more Newton step reaches round-off


@dataclass(frozen=True, slots=True, eq=False)
class Closed:
    """Configurations after closing.

    Attributes:
        q: configurations (n, nq).
        residual: largest closure residual (n,) [m or rad], all rows.
        correction: size of all the Newton steps together (n,) [rad, or chain lengths].
        sigma, sign: of the passive Jacobian at the last step, see `PassiveMap` (n,), (n, groups).
    """

    q: Array
    residual: Array
    correction: Array
    sigma: Array
    sign: Array


@dataclass(frozen=True, slots=True, eq=False)
class Limits:
    """Bounds on coordinates of one degree of freedom.

    Attributes:
        index: their velocity indices (k,).
        low, high: bounds (k,) [rad or m]; infinite where there is none.
    """

    index: npt.NDArray[np.intp]
    low: Array
    high: Array

    def values(self, loops: Loops, q: Array) -> Array:
        """Return the coordinates (n, k) of configurations q (n, nq)."""
        return np.stack([loops.tree.coordinate(q, int(k)) for k in self.index] or [np.zeros(0)], axis=-1)

    def inside(self, loops: Loops, q: Array) -> npt.NDArray[np.bool_]:
        """Return which configurations q (n, nq) keep them (n,)."""
        if not self.index.size:
            return np.ones(q.shape[0], dtype=np.bool_)
        x = self.values(loops, q)
        return np.asarray(((x >= self.low) & (x <= self.high)).all(axis=1))

    def clamp(self, loops: Loops, q: Array) -> None:
        """Move coordinates that lie outside onto the bounds, in place."""
        for k, low, high in zip(self.index, self.low, self.high, strict=True):
            loops.tree.set_coordinate(q, int(k), np.clip(loops.tree.coordinate(q, int(k)), low, high))

    def pressed(self, loops: Loops, q: Array, step: Array) -> npt.NDArray[np.bool_]:
        """Return which coordinates (n, nv) a step (n, nv) would push out from where they lie on a bound."""
        out = np.zeros(step.shape, dtype=np.bool_)
        if self.index.size:
            x, along = self.values(loops, q), step[:, self.index]
            out[:, self.index] = ((x <= self.low) & (along < 0.0)) | ((x >= self.high) & (along > 0.0))
        return out


def residual_of(loops: Loops, q: Array) -> Array:
    """Return all closure rows at configurations q (n, nq) -> (n, m)."""
    return loops.residual(loops.pairs(loops.tree.poses(q)))


def polish(loops: Loops, q: Array, *, iterations: int = 8) -> Closed:
    """Close nearly closed configurations by Newton's method; non-convergence shows in the residual.

    Every sample stops when it is at round-off: one step after its scaled residual has passed below 1e-9.
    """
    n = q.shape[0]
    q = np.array(q)
    if not loops.m:
        return Closed(q, np.zeros(n), np.zeros(n), np.ones(n), np.ones((n, 0)))
    size = np.full(n, np.inf)
    correction, sigma, sign = np.zeros(n), np.zeros(n), np.zeros((n, loops.groups))
    todo, last = np.arange(n), np.zeros(n, dtype=np.bool_)
    for _ in range(iterations):
        poses = loops.tree.poses(q[todo])
        pairs = loops.pairs(poses)
        full = loops.residual(pairs)
        size[todo] = np.abs(full).max(axis=1, initial=0.0)
        finished = last[todo]
        if finished.all():
            break
        reduced = full * loops.row_scale
        passive = loops.passive_map(loops.blocks(poses, pairs))
        step = -passive.solve(full)
        sigma[todo], sign[todo] = passive.sigma, passive.sign
        lost = ~np.isfinite(step).all(axis=1)
        step[finished | lost] = 0.0
        size[todo] = np.where(lost, np.inf, size[todo])
        correction[todo] += np.abs(step / loops.column_scale[loops.passive]).max(axis=1, initial=0.0)
        q[todo] = loops.tree.integrate(q[todo], _spread(loops, step, loops.passive))
        last[todo] = np.abs(reduced).max(axis=1, initial=0.0) < _POLISHED
        todo = todo[np.isfinite(size[todo]) & (correction[todo] < 1e3)]
        if not todo.size:
            break
    return Closed(q, size, correction, sigma, sign)


def search(
    loops: Loops,
    q: Array,
    *,
    columns: npt.NDArray[np.intp] | None = None,
    limits: Limits | None = None,
    iterations: int = 150,
) -> Array:
    """Bring poor starts near a closed configuration by a damped (Levenberg-Marquardt), step-limited search.

    Args:
        q: starts (n, nq).
        columns: velocity coordinates that may move; the passive ones unless given.
        limits: that the starts keep and that are kept; a coordinate that is pushed against one of its own stays there.
        iterations: at most so many.

    Returns:
        The best configurations found (n, nq), closed or not: check the residual.
    """
    q = np.array(q)
    columns = loops.passive if columns is None else columns
    scale, eye = loops.column_scale[columns], np.eye(columns.size)
    damping, todo = np.full(q.shape[0], 1e-3), np.arange(q.shape[0])
    value, gradient, H = _normal(loops, q, columns, limits)
    for _ in range(iterations):
        heavier = damping[todo] * (1e-3 + np.trace(H[todo], axis1=1, axis2=2))
        step = -np.linalg.solve(H[todo] + heavier[:, None, None] * eye, gradient[todo])[..., 0]
        longest = np.abs(step).max(axis=1, initial=0.0)
        step *= np.minimum(1.0, STEP / np.maximum(longest, 1e-300))[:, None]
        trial = loops.tree.integrate(q[todo], _spread(loops, step * scale, columns))
        if limits is not None:
            limits.clamp(loops, trial)
        new_value, new_gradient, new_H = _normal(loops, trial, columns, limits)
        better = new_value < value[todo]
        to = todo[better]
        q[to], value[to] = trial[better], new_value[better]
        gradient[to], H[to] = new_gradient[better], new_H[better]
        damping[todo] = np.clip(np.where(better, damping[todo] / 5.0, damping[todo] * 4.0), 1e-12, 1e8)
        flat = np.abs(gradient[todo]).max(axis=(1, 2), initial=0.0) < 1e-14
        todo = todo[~((value[todo] < 1e-20) | (damping[todo] >= 1e7) | flat)]
        if not todo.size:
            break
    return q


def _normal(loops: Loops, q: Array, columns: npt.NDArray[np.intp], limits: Limits | None) -> tuple[Array, Array, Array]:
    """Return half the squared scaled residual (n,), its gradient (n, k, 1) and Gauss-Newton matrix (n, k, k)."""
    poses = loops.tree.poses(q)
    pairs = loops.pairs(poses)
    r = loops.residual(pairs) * loops.row_scale
    J = loops.jacobian(poses, pairs)[:, :, columns] * loops.row_scale[:, None] * loops.column_scale[columns]
    if limits is not None:
        uphill = np.matmul(np.swapaxes(J, 1, 2), r[..., None])[..., 0]
        J = J * ~limits.pressed(loops, q, _spread(loops, -uphill, columns))[:, None, columns]
    JT = np.swapaxes(J, 1, 2)
    return 0.5 * np.sum(r * r, axis=1), np.matmul(JT, r[..., None]), np.matmul(JT, J)


def _spread(loops: Loops, tangent: Array, columns: npt.NDArray[np.intp]) -> Array:
    """Put the tangent of some coordinates (n, k) into a whole one (n, nv)."""
    out = np.zeros((tangent.shape[0], loops.tree.nv))
    out[:, columns] = tangent
    return out


def closed_enough(loops: Loops, residual: Array, tolerance: float) -> npt.NDArray[np.bool_]:
    """Whether residuals (n,) [m or rad] are closed: below the tolerance times the chain's length (or one radian)."""
    return np.asarray(residual <= tolerance * max(1.0, loops.length))
