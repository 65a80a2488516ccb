"""One long step over an instant at which the closures lose rank, with nothing evaluated near it.

At a distance d from such an instant the round-off of the closures is magnified by 1/d^2 in the accelerations, while the
motion itself is smooth. So the step is Gauss collocation with an even number of stages, the instant in its middle,

    y_i = y_0 + h sum_j A_ij f(t_0 + c_j h, y_j),   A_ij = the integral from 0 to c_i of the Lagrange polynomial l_j

solved by repeated substitution: of order 2 s, which allows it to be long. The result with eight stages is taken when
the one with six agrees.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import TINY, Array
from fivebar_pin.simulation.chart_motion import ChartMotion, Node, is_smooth, next_node

__all__ = ["Collocated", "Crossing", "lagrange", "refine", "singular_ahead", "step_over"]


_SWEEPS, _SWEEPS_AT_LEAST = 40, 3  # substitutions at most, and before they may be found to stall
_SETTLED, _GOOD = 1e-2, 0.5  # change of the result, in tolerances, that ends them, and that is good enough [-]
_STALLED = 0.9  # of the change before, from which on they do not converge any further [-]
_FLOOR = 1e-12  # least tolerance: what the round-off near the instant leaves
_LOOK = 33  # instants at which the closures are looked at ahead


@dataclass(frozen=True, slots=True, eq=False)
class _Gauss:
    """Nodes (s,), matrix (s, s) and weights (s,) of a collocation method."""

    c: Array
    A: Array
    b: Array


@dataclass(frozen=True, slots=True, eq=False)
class Collocated:
    """A step as a polynomial: gives (xi, u) at any time in it.

    Attributes:
        t, h: where it begins, and its length [s].
        y: (xi, u) at its begin (2 f,).
        c: Gauss points (s,), of the step.
        rates: there (s, 2 f).
    """

    t: float
    h: float
    y: Array
    c: Array
    rates: Array

    def __call__(self, t: float) -> Array:
        s = np.array([(t - self.t) / self.h])
        return np.asarray(self.y + self.h * (_integrals(s, self.c) @ self.rates)[0])


@dataclass(frozen=True, slots=True, eq=False)
class Crossing:
    """A step that was taken: the state after it, and what makes the way there when it is asked for."""

    node: Node
    way: Callable[[], Collocated]


def singular_ahead(motion: ChartMotion, within: float) -> float | None:
    """Return the time after which the closures come nearest to losing rank, as predicted; None if not within."""
    node, manifold = motion.node, motion.system.manifold
    dt = np.linspace(0.0, within, _LOOK)
    sigma = manifold.at(np.stack([motion.predict(node.t + s) for s in dt])).independent.smallest(motion.rank)
    k = int(np.argmin(sigma))
    if k in (0, _LOOK - 1):
        return None
    left, right = sigma[k] - sigma[k - 1], sigma[k + 1] - sigma[k]
    slope = max(-left, right)  # the least value lies where two lines of this slope meet
    return float(dt[k] + 0.5 * dt[1] * (-left - right) / max(slope, TINY))


def step_over(motion: ChartMotion, h: float, rtol: float, atol: Array) -> Crossing | None:
    """Take one step of length h from the motion's node; None when it does not reach its tolerance."""
    node, y0 = motion.node, motion.start()
    rtol, atol = max(rtol, _FLOOR), np.maximum(atol, 0.1 * _FLOOR)
    rate = motion.rate(node.t, y0)
    rates = _substitute(motion, _SIX, np.repeat(rate[None], _SIX.c.size, axis=0), h, rtol, atol)
    if rates is None:
        return None
    six = y0 + h * _SIX.b @ rates
    rates = _substitute(motion, _EIGHT, lagrange(_EIGHT.c, _SIX.c) @ rates, h, rtol, atol)
    if rates is None:
        return None
    y = y0 + h * _EIGHT.b @ rates
    if not np.all(np.abs(y - six) <= atol + rtol * np.maximum(np.abs(y0), np.abs(y))):
        return None
    reached = next_node(motion, node.t + h, y)
    if reached is None or not is_smooth(motion.system, node, reached):
        return None
    return Crossing(reached, lambda: _way(motion, Collocated(node.t, h, y0, _EIGHT.c, rates), rtol, atol))


def refine(motion: ChartMotion, h: float, rough: Callable[[float], Array]) -> Callable[[float], Array]:
    """Return a better interpolant of a step from the motion's node than the integrator's own, which is of less order.

    The rates along the rough one, integrated: one substitution of the collocation method.
    """
    node = motion.node
    rates = np.stack([motion.rate(t, rough(t)) for t in node.t + _EIGHT.c * h])
    return Collocated(node.t, h, motion.start(), _EIGHT.c, rates) if np.all(np.isfinite(rates)) else rough


def _way(motion: ChartMotion, rough: Collocated, rtol: float, atol: Array) -> Collocated:
    """Return the polynomial with more points: eight have half their order inside the step."""
    first = lagrange(_TEN.c, rough.c) @ rough.rates
    rates = _substitute(motion, _TEN, first, rough.h, rtol, atol)
    return rough if rates is None else Collocated(rough.t, rough.h, rough.y, _TEN.c, rates)


def _substitute(motion: ChartMotion, method: _Gauss, rates: Array, h: float, rtol: float, atol: Array) -> Array | None:
    """Return the rates at the stages (s, 2 f), from a first guess; None without convergence."""
    y0, times, rates = motion.start(), motion.node.t + method.c * h, np.array(rates)
    y, moved = y0 + h * method.b @ rates, np.inf
    for sweep in range(_SWEEPS):
        for k in range(times.size):
            rates[k] = motion.rate(float(times[k]), y0 + h * method.A[k] @ rates)
        new = y0 + h * method.b @ rates
        if not np.all(np.isfinite(new)):
            return None
        before, moved, y = moved, float(np.max(np.abs(new - y) / (atol + rtol * np.abs(new)))), new
        if moved < _SETTLED or (sweep > _SWEEPS_AT_LEAST and moved > _STALLED * before):
            break
    return rates if moved < _GOOD else None


def lagrange(x: Array, c: Array) -> Array:
    """Return the Lagrange polynomials of the nodes c at x (..., len(c))."""
    values = np.ones((*x.shape, c.size))
    for j in range(c.size):
        for k in range(c.size):
            if k != j:
                values[..., j] *= (x - c[k]) / (c[j] - c[k])
    return values


def _integrals(x: Array, c: Array) -> Array:
    """Return the integrals from 0 to every x of the Lagrange polynomials of the nodes c, (len(x), len(c))."""
    z, weight = np.polynomial.legendre.leggauss(c.size)
    values = lagrange(0.5 * x[:, None] * (z + 1.0), c)
    return np.asarray(0.5 * x[:, None] * np.einsum("g,xgj->xj", weight, values))


def _gauss(stages: int) -> _Gauss:
    z, weight = np.polynomial.legendre.leggauss(stages)
    c = 0.5 * (z + 1.0)
    return _Gauss(c, _integrals(c, c), 0.5 * weight)


_SIX, _EIGHT, _TEN = _gauss(6), _gauss(8), _gauss(10)
