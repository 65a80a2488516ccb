"""Closing the loops: damped Newton from a poor start, plain Newton from a good one. Passive coordinates only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array
from fivebar_pin._loops import Loops

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
        q[todo] = loops.tree.integrate(q[todo], _spread(loops, step))
        last[todo] = np.abs(reduced).max(axis=1, initial=0.0) < _POLISHED
        todo = todo[np.isfinite(size[todo]) & (correction[todo] < 1e3)]
        if not todo.size:
            break
    return Closed(q, size, correction, sigma, sign)


def search(loops: Loops, q: Array, *, iterations: int = 150) -> Array:
    """Bring poor starts near a closed configuration by a damped (Levenberg-Marquardt), step-limited search.

    Args:
        q: starts (n, nq); their actuated coordinates stay.

    Returns:
        The best configurations found (n, nq), closed or not: check the residual.
    """
    q = np.array(q)
    n = q.shape[0]
    scale = loops.column_scale[loops.passive]
    damping = np.full(n, 1e-3)
    value, gradient, H = _normal(loops, q)
    eye = np.eye(loops.passive.size)
    for _ in range(iterations):
        step = -np.linalg.solve(H + (damping * (1e-3 + np.trace(H, axis1=1, axis2=2)))[:, None, None] * eye, gradient)
        step = step[..., 0]
        longest = np.abs(step).max(axis=1, initial=0.0)
        step *= np.minimum(1.0, STEP / np.maximum(longest, 1e-300))[:, None]
        trial = loops.tree.integrate(q, _spread(loops, step * scale))
        new_value, new_gradient, new_H = _normal(loops, trial)
        better = new_value < value
        q[better], value[better] = trial[better], new_value[better]
        gradient[better], H[better] = new_gradient[better], new_H[better]
        damping = np.clip(np.where(better, damping / 5.0, damping * 4.0), 1e-12, 1e8)
        if np.all((value < 1e-20) | (damping >= 1e7) | (np.abs(gradient).max(axis=(1, 2)) < 1e-14)):
            break
    return q


def _normal(loops: Loops, q: Array) -> tuple[Array, Array, Array]:
    """Return half the squared scaled residual (n,), its gradient (n, np, 1) and Gauss-Newton matrix (n, np, np)."""
    poses = loops.tree.poses(q)
    pairs = loops.pairs(poses)
    r = loops.residual(pairs) * loops.row_scale
    J = loops.jacobian(poses, pairs)[:, :, loops.passive] * loops.row_scale[:, None] * loops.column_scale[loops.passive]
    JT = np.swapaxes(J, 1, 2)
    return 0.5 * np.sum(r * r, axis=1), np.matmul(JT, r[..., None]), np.matmul(JT, J)


def _spread(loops: Loops, passive: Array) -> Array:
    """Put a passive tangent (n, np) into a whole one (n, nv)."""
    out = np.zeros((passive.shape[0], loops.tree.nv))
    out[:, loops.passive] = passive
    return out


def closed_enough(loops: Loops, residual: Array, tolerance: float) -> npt.NDArray[np.bool_]:
    """Whether residuals (n,) [m or rad] are closed: below the tolerance times the chain's length (or one radian)."""
    return np.asarray(residual <= tolerance * max(1.0, loops.length))
