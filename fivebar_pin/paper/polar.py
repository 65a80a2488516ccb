"""The optimisation problem (77)-(79) in x = (alpha, rho, mu): values, derivatives, and the climb to a KKT point.

Every condition is linear in mu_i rho_i cos(alpha_i), mu_i rho_i sin(alpha_i) and mu_i, so that all second derivatives
are 3 x 3 blocks, one per link.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import TINY, Array, Immutable
from fivebar_pin.paper.equations import RIGHT, ROWS

__all__ = ["Problem", "Stationary", "alone", "climb"]

_FIRST = 1e-13  # change of the objective at which the first solver stops [-]
_STOP = 1e-16  # step at which Newton has nothing left to do [rad or -]
_SIGN = 1e-12  # multiplier of the wrong sign that is round-off [-]
_RANK = 1e-10  # singular value of the conditions that counts as zero [of the largest, at least one]
_NEAR = 1e-7  # a variable this close to its bound after the first solver is tried as active


@dataclass(frozen=True, slots=True, eq=False)
class Problem(Immutable):
    """Minimise (77) under the conditions.

    Attributes:
        weights: w_alpha, w_rho, (78).
        low, high: bounds (12,); equal where a variable is given.
    """

    weights: tuple[float, float]
    low: Array
    high: Array

    @property
    def free(self) -> npt.NDArray[np.bool_]:
        """Which variables may change (12,)."""
        return np.asarray(self.low < self.high)

    @property
    def rows(self) -> npt.NDArray[np.intp]:
        """Which conditions count: (70) is dropped when the mass ratios are given."""
        return np.arange(7 if self.free[8:].any() else 6)

    def objective(self, x: Array) -> float:
        """(77)."""
        return float(self.weights[0] * x[:4] @ x[:4] + self.weights[1] * (x[4:8] - 0.5) @ (x[4:8] - 0.5))

    def gradient(self, x: Array) -> Array:
        """Gradient of (77), (12,)."""
        wa, wr = self.weights
        return np.concatenate([2.0 * wa * x[:4], 2.0 * wr * (x[4:8] - 0.5), np.zeros(4)])

    def residual(self, x: Array) -> Array:
        """Residuals of the conditions that count, (6,) or (7,)."""
        moments = x[8:] * x[4:8] * np.exp(1j * x[:4])
        return np.asarray((ROWS @ np.concatenate([moments.real, moments.imag, x[8:]]) - RIGHT)[self.rows])

    def jacobian(self, x: Array) -> Array:
        """Derivatives of the conditions, (6 or 7, 12)."""
        alpha, rho, mu = x[:4], x[4:8], x[8:]
        c, s = np.diag(np.cos(alpha)), np.diag(np.sin(alpha))
        y = np.zeros((12, 12))
        y[:4, :4], y[:4, 4:8], y[:4, 8:] = -s * (mu * rho), c * mu, c * rho
        y[4:8, :4], y[4:8, 4:8], y[4:8, 8:] = c * (mu * rho), s * mu, s * rho
        y[8:, 8:] = np.eye(4)
        return np.asarray((ROWS @ y)[self.rows])

    def hessian(self, x: Array, multipliers: Array) -> Array:
        """Second derivatives of the Lagrangian (77) + multipliers . conditions, (12, 12)."""
        wa, wr = self.weights
        out = np.diag([2.0 * wa] * 4 + [2.0 * wr] * 4 + [0.0] * 4)
        pull = ROWS[self.rows].T @ multipliers  # on mu rho cos, mu rho sin, mu
        for i in range(4):
            alpha, rho, mu = x[i], x[4 + i], x[8 + i]
            turn = np.exp(1j * alpha)
            block = np.array(
                [
                    [-mu * rho * turn, 1j * mu * turn, 1j * rho * turn],
                    [1j * mu * turn, 0.0, turn],
                    [1j * rho * turn, turn, 0.0],
                ]
            )
            k = np.array([i, 4 + i, 8 + i])
            out[np.ix_(k, k)] += pull[i] * block.real + pull[4 + i] * block.imag
        return out


@dataclass(frozen=True, slots=True, eq=False)
class Stationary(Immutable):
    """A point and what is known of its optimality.

    Attributes:
        x: (12,).
        multipliers: of the conditions, (6,) or (7,).
        bound_multipliers: gradient of the Lagrangian (12,), zero but at active bounds.
        residual: largest of stationarity, conditions, bounds crossed and multipliers of the wrong sign [-];
            stationarity and signs relative to the largest multiplier where that exceeds one.
        curvature: least eigenvalue of the Lagrangian's Hessian along the conditions and active bounds; inf at a corner.
    """

    x: Array
    multipliers: Array
    bound_multipliers: Array
    residual: float
    curvature: float


def alone(problem: Problem, x: Array) -> Stationary:
    """Return the judgement of a point that is the only feasible one: optimal, though no multipliers need exist."""
    outside = np.maximum(np.maximum(problem.low - x, x - problem.high), 0.0)
    residual = float(max(np.abs(problem.residual(x)).max(), outside.max()))
    return Stationary(x, np.full(len(problem.rows), np.nan), np.full(12, np.nan), residual, float("inf"))


def climb(problem: Problem, start: Array) -> Stationary:
    """Return the KKT point near a start: SLSQP finds the active bounds, Newton on the KKT system reaches round-off."""
    from scipy import optimize

    minimize: Any = optimize.minimize  # its stubs do not take a jacobian with a constraint dictionary
    free = problem.free
    first = np.clip(start, problem.low, problem.high)

    def whole(z: Array) -> Array:
        x = first.copy()
        x[free] = np.clip(z, problem.low[free], problem.high[free])
        return x

    with warnings.catch_warnings():  # before 1.16 SciPy tells of bounds that it missed by round-off itself and mended
        warnings.filterwarnings("ignore", "Values in x were outside bounds", RuntimeWarning)
        answer = minimize(
            lambda z: problem.objective(whole(z)),
            first[free],
            jac=lambda z: problem.gradient(whole(z))[free],
            bounds=list(zip(problem.low[free], problem.high[free], strict=True)),
            constraints={
                "type": "eq",
                "fun": lambda z: problem.residual(whole(z)),
                "jac": lambda z: problem.jacobian(whole(z))[:, free],
            },
            method="SLSQP",
            options={"maxiter": 300, "ftol": _FIRST},
        )
    return _polish(problem, whole(np.asarray(answer.x)))


def _polish(problem: Problem, x: Array) -> Stationary:
    """Newton on the KKT system, moving single bounds in and out of the active set until their signs fit."""
    low, high = problem.low, problem.high
    active = ~problem.free | (x <= low + _NEAR) | (x >= high - _NEAR)
    x = np.where(active & (x >= high - _NEAR), high, np.where(active & (x <= low + _NEAR), low, x))
    best = _newton(problem, x, active)
    for _ in range(16):
        wrong = np.where(active & problem.free, _wrong_sign(problem, best), 0.0)
        outside = np.maximum(low - best.x, best.x - high)
        if outside.max() > 0.0:
            k = int(np.argmax(outside))
            active[k] = True
        elif wrong.max() > _SIGN:
            k = int(np.argmax(wrong))
            active[k] = False
        else:
            break
        best = _newton(problem, np.clip(best.x, low, high), active)
    return best


def _newton(problem: Problem, x: Array, active: npt.NDArray[np.bool_]) -> Stationary:
    """Solve stationarity and conditions with the active variables held; keep the best iterate."""
    moving = np.flatnonzero(~active)
    best = _judge(problem, x, active)
    for _ in range(25):
        J, g = problem.jacobian(x), problem.gradient(x)
        point = _judge(problem, x, active)
        if point.residual < best.residual:
            best = point
        multipliers = point.multipliers
        H = problem.hessian(x, multipliers)[np.ix_(moving, moving)]
        m = len(multipliers)
        K = np.block([[H, J[:, moving].T], [J[:, moving], np.zeros((m, m))]])
        right = -np.concatenate([g[moving] + J[:, moving].T @ multipliers, problem.residual(x)])
        step = np.linalg.lstsq(K, right, rcond=None)[0][: moving.size]
        x = x.copy()
        x[moving] += step * min(1.0, 1.0 / max(float(np.abs(step).max(initial=0.0)), TINY))
        if np.abs(step).max(initial=0.0) <= _STOP:
            break
    return best


def _judge(problem: Problem, x: Array, active: npt.NDArray[np.bool_]) -> Stationary:
    J, g = problem.jacobian(x), problem.gradient(x)
    multipliers = np.asarray(np.linalg.lstsq(J[:, ~active].T, -g[~active], rcond=None)[0], dtype=np.float64)
    slope = g + J.T @ multipliers
    outside = np.maximum(np.maximum(problem.low - x, x - problem.high), 0.0)
    held = np.where(active & problem.free, slope, 0.0)
    scale = max(1.0, float(np.abs(multipliers).max(initial=0.0)))
    parts = [np.abs(slope[~active]) / scale, np.abs(problem.residual(x)), outside]
    point = Stationary(x, multipliers, held, 0.0, 0.0)
    parts.append(np.where(active & problem.free, _wrong_sign(problem, point), 0.0) / scale)
    residual = max(float(p.max(initial=0.0)) for p in parts)
    return Stationary(x, multipliers, held, residual, _curvature(problem, x, multipliers, active))


def _wrong_sign(problem: Problem, point: Stationary) -> Array:
    """How much leaving each bound would lower the objective: -slope at a lower bound, slope at an upper one."""
    z = point.bound_multipliers
    return np.asarray(np.where(point.x >= problem.high, np.maximum(z, 0.0), np.maximum(-z, 0.0)))


def _curvature(problem: Problem, x: Array, multipliers: Array, active: npt.NDArray[np.bool_]) -> float:
    moving = np.flatnonzero(~active)
    J = problem.jacobian(x)[:, moving]
    _, values, V = np.linalg.svd(J)
    rank = int(np.sum(values > _RANK * max(float(values.max(initial=0.0)), 1.0)))
    Z = V[rank:].T
    if Z.shape[1] == 0:
        return float("inf")
    return float(np.linalg.eigvalsh(Z.T @ problem.hessian(x, multipliers)[np.ix_(moving, moving)] @ Z).min())
