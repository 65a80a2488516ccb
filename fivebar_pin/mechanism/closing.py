"""Closing the loops: one Newton iteration, whichever coordinates may move and however it stops.

    q_{k+1} = q_k + step(q_k),   J step = -residual, as far as the rule of the iteration has it

A rule looks at the configurations reached and says where each sample goes next and which are done. Here are two: plain
steps of the passive coordinates from a good start (`polish`), and damped ones of any coordinates from a poor one
(`search`). Steps of least length in all coordinates, with the independent ones held, and back from a walk are rules of
those who need them: `manifold`, `mobility` and the walk of balancing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import TINY, Array
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import Loops

__all__ = [
    "CLOSED",
    "STEP",
    "Closed",
    "Limits",
    "Rule",
    "closed_enough",
    "iterate",
    "most_open",
    "nudged",
    "polish",
    "residual_of",
    "search",
]


Rule = Callable[[Configurations, npt.NDArray[np.intp]], tuple[Array, npt.NDArray[np.bool_]]]
"""What to do with configurations reached (k) by samples of these numbers (k,): where they go next (k, nq), and which
of them go on (k,); those that do not stay where they are put."""

CLOSED = 1e-12  # closure residual that counts as closed: some thousand units in the last place [m or rad]
STEP = 0.5  # longest Newton step of a damped search [rad, or chain lengths]
_NUDGES, _NUDGE = 8, 0.2  # further starts about a poor one, and how far off [rad, or chain lengths]
_BLOCK = 4096  # samples polished at a time, so that what is computed on the way stays in cache
_POLISHED = 1e-9  # scaled residual below which one more Newton step reaches round-off: it squares it [-]
_ASTRAY = 1e3  # sum of Newton steps beyond which a sample is given up [rad, or chain lengths]

_CONTENT = 1e-26  # half the squared scaled residual that a search is content with, also where loops are folded [-]
_FLAT = 1e-14  # gradient of it below which the search stands at a stationary point [-]
_DAMPING = 1e-3  # of the first step, as part of the mean slope [-]
_LEAST_DAMPING, _MOST_DAMPING, _STUCK = 1e-12, 1e8, 1e7  # bounds, and from where on steps lead nowhere [-]
_SLOPE = 1e-3  # added to the sum of squared slopes, so that a flat place is damped too [-]
_LIGHTER, _HEAVIER = 5.0, 4.0  # change of the damping after a step that helped, and one that did not


def iterate(loops: Loops, q: Array, rule: Rule, *, most: int) -> Array:
    """Let samples q (n, nq) go where a rule sends them, each until it is done, for at most so many looks."""
    q, which = np.array(q), np.arange(q.shape[0])
    for _ in range(most):
        q[which], going = rule(Configurations(loops, q[which]), which)
        which = which[going]
        if not which.size:
            break
    return q


@dataclass(frozen=True, slots=True, eq=False)
class Closed:
    """Configurations after closing.

    Attributes:
        q: configurations (n, nq).
        residual: largest closure residual (n,) [m or rad], all rows.
        correction: size of all the Newton steps together (n,) [rad, or chain lengths].
    """

    q: Array
    residual: Array
    correction: Array


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
    return Configurations(loops, q).residual


def closed_enough(loops: Loops, residual: npt.ArrayLike, tolerance: float) -> npt.NDArray[np.bool_]:
    """Whether residuals (n,) [m or rad] are closed: below the tolerance times the chain's length (or one radian)."""
    return np.asarray(np.asarray(residual) <= most_open(loops, tolerance))


def most_open(loops: Loops, tolerance: float) -> float:
    """Return the residual up to which a configuration is closed: the larger tolerance, times a length above 1 m."""
    return max(tolerance, loops.tolerance) * max(1.0, loops.length)


def nudged(loops: Loops, q: Array) -> Array:
    """Return starts (k, nq) about q (1, nq): a search that starts at a saddle stays there, and has to step aside."""
    rng = np.random.default_rng(0)
    tangent = _NUDGE * rng.uniform(-1.0, 1.0, (_NUDGES, loops.tree.nv)) * loops.column_scale
    return loops.tree.integrate(np.repeat(q, _NUDGES, axis=0), tangent)


def polish(loops: Loops, q: Array, *, iterations: int = 8) -> Closed:
    """Close nearly closed configurations by Newton's method; non-convergence shows in the residual.

    Every sample stops when it is at round-off: one step after its scaled residual has passed below `_POLISHED`.
    """
    n = q.shape[0]
    if not loops.m:
        return Closed(np.array(q), np.zeros(n), np.zeros(n))
    if n > _BLOCK:
        parts = [polish(loops, q[k : k + _BLOCK], iterations=iterations) for k in range(0, n, _BLOCK)]
        return Closed(*(np.concatenate([getattr(part, name) for part in parts]) for name in Closed.__slots__))
    rule = _Passive(n)
    q = iterate(loops, q, rule, most=iterations)
    return Closed(q, rule.size, rule.correction)


class _Passive:
    """Plain Newton steps of the passive coordinates. Samples that are done wait for the others."""

    def __init__(self, n: int) -> None:
        self.size, self.correction = np.full(n, np.inf), np.zeros(n)
        self._last = np.zeros(n, dtype=np.bool_)

    def __call__(self, here: Configurations, which: npt.NDArray[np.intp]) -> tuple[Array, npt.NDArray[np.bool_]]:
        loops, finished = here.loops, self._last[which]
        self.size[which] = here.gap
        if finished.all():
            return here.q, ~finished
        step = -here.passive.solve(here.residual)
        lost = ~np.isfinite(step).all(axis=1)
        step[finished | lost] = 0.0
        self.size[which[lost]] = np.inf
        self.correction[which] += np.abs(step / loops.column_scale[loops.passive]).max(axis=1, initial=0.0)
        self._last[which] = here.error < _POLISHED
        q = loops.tree.integrate(here.q, _spread(loops, step, loops.passive))
        return q, np.isfinite(self.size[which]) & (self.correction[which] < _ASTRAY)


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
        loops: the closures.
        q: starts (n, nq).
        columns: velocity coordinates that may move; the passive ones unless given.
        limits: that the starts keep and that are kept; a coordinate that is pushed against one of its own stays there.
        iterations: at most so many.

    Returns:
        The best configurations found (n, nq), closed or not: check the residual.
    """
    rule = _Damped(q, loops.passive if columns is None else columns, limits)
    iterate(loops, q, rule, most=iterations + 1)  # the last one only looks
    return rule.q


class _Damped:
    """Steps of Levenberg and Marquardt in some coordinates, taken back where they do not help."""

    def __init__(self, q: Array, columns: npt.NDArray[np.intp], limits: Limits | None) -> None:
        n, k = q.shape[0], columns.size
        self.q, self._columns, self._limits = np.array(q), columns, limits
        self._value, self._gradient, self._H = np.full(n, np.inf), np.zeros((n, k, 1)), np.zeros((n, k, k))
        self._damping, self._begun = np.full(n, _DAMPING), False

    def __call__(self, here: Configurations, which: npt.NDArray[np.intp]) -> tuple[Array, npt.NDArray[np.bool_]]:
        value, gradient, H = self._normal(here)
        going = np.ones(which.size, dtype=np.bool_)
        better = value < self._value[which] if self._begun else going
        to = which[better]
        self.q[to], self._value[to] = here.q[better], value[better]
        self._gradient[to], self._H[to] = gradient[better], H[better]
        if self._begun:
            damping = np.where(better, self._damping[which] / _LIGHTER, self._damping[which] * _HEAVIER)
            self._damping[which] = np.clip(damping, _LEAST_DAMPING, _MOST_DAMPING)
            flat = np.abs(self._gradient[which]).max(axis=(1, 2), initial=0.0) < _FLAT
            going = ~((self._value[which] < _CONTENT) | (self._damping[which] >= _STUCK) | flat)
        self._begun = True
        out = np.array(here.q)
        if going.any():
            out[going] = self._trial(here.loops, which[going])
        return out, going

    def _trial(self, loops: Loops, which: npt.NDArray[np.intp]) -> Array:
        """Return configurations (k, nq) one step from the best ones."""
        H, columns = self._H[which], self._columns
        heavier = self._damping[which] * (_SLOPE + np.trace(H, axis1=1, axis2=2))
        eye = np.eye(columns.size)
        step = -np.linalg.solve(H + heavier[:, None, None] * eye, self._gradient[which])[..., 0]
        longest = np.abs(step).max(axis=1, initial=0.0)
        step *= np.minimum(1.0, STEP / np.maximum(longest, TINY))[:, None]
        trial = loops.tree.integrate(self.q[which], _spread(loops, step * loops.column_scale[columns], columns))
        if self._limits is not None:
            self._limits.clamp(loops, trial)
        return trial

    def _normal(self, here: Configurations) -> tuple[Array, Array, Array]:
        """Return half the squared scaled residual (n,), its gradient (n, k, 1) and Gauss-Newton matrix (n, k, k)."""
        loops, columns = here.loops, self._columns
        r = here.residual * loops.row_scale
        J = loops.scaled(here.J[:, :, columns], columns=columns)
        if self._limits is not None:
            uphill = np.matmul(np.swapaxes(J, 1, 2), r[..., None])[..., 0]
            J = J * ~self._limits.pressed(loops, here.q, _spread(loops, -uphill, columns))[:, None, columns]
        JT = np.swapaxes(J, 1, 2)
        return 0.5 * np.sum(r * r, axis=1), np.matmul(JT, r[..., None]), np.matmul(JT, J)


def _spread(loops: Loops, tangent: Array, columns: npt.NDArray[np.intp]) -> Array:
    """Put the tangent of some coordinates (n, k) into a whole one (n, nv)."""
    out = np.zeros((tangent.shape[0], loops.tree.nv))
    out[:, columns] = tangent
    return out
