"""The second solver, independent of the first: follow the central path with SciPy's dense factorisations.

SciPy has no conic solver, but what one takes. The equalities are solved for, x = x0 + N w. In the rest

    minimise    tau (x.P x / 2 + q.x) + barrier(g + G x)

is solved by Newton's method for growing tau [Nesterov, Nemirovskii 1994]; (v - M G dx) M / tau is then a point z of the
dual cone with P x + q = G^T z, and the gap is degree / tau. To begin with, the largest t with g + G x - t e in K is
looked for in the same way: t > 0 is a start; if no t >= 0 is left, z is a Farkas certificate. Variables keep within a
wide box, so that the path cannot run away.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy  # its linear algebra is loaded where it is first used

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.solvers.answer import Answer, nothing
from fivebar_pin.balancing.solvers.barrier import Barrier, barriers
from fivebar_pin.balancing.solvers.program import ConicProblem
from fivebar_pin.balancing.solvers.registry import register

__all__ = ["answers"]

_FACTORS = (10.0, 3.0)  # growth of tau from stage to stage, one for each attempt
_GAP = 3e-2  # share of the tolerance that the gap may keep
_BOX = 100.0  # half width of the box [bounds on the variables]
_UNBOUNDED = 1e4  # the same where a variable has no bound
_RANK = 1e-11  # singular value of the equalities that counts as none, relative
_OPEN = 1e-9  # residual of equalities that contradict each other, relative
_CENTRED = 1e-3  # squared Newton decrement at which a stage ends
_NEWTON = 60  # steps of one stage
_STAGES = 120
_GIVE = 1e-10  # width given to cones without an interior, scaled as the program
_SURE = 1e-3  # gap of the search for a start at which its end is negative beyond doubt, relative
_STEEP = 0.5  # slope at the end of a step, over that at its start, that goes downhill still [-]
_SHORTER, _SHORT = 0.6, 1e-10  # factor of a step that does not stay inside, and length that is none [-]
_REFINED = 2  # corrections of z


@dataclass(frozen=True, slots=True, eq=False)
class _Stage:
    """Rows g + G w in cones, a cost P, q: what a path is followed in."""

    parts: list[Barrier]
    G: Array
    g: Array
    P: Array  # (n, n)
    q: Array

    @property
    def degree(self) -> float:
        return sum(part.degree for part in self.parts)

    def inside(self, w: Array) -> bool:
        s = self.g + self.G @ w
        return all(bool((part.depth(s[part.rows]) > 0.0).all()) for part in self.parts)

    def slope(self, w: Array, tau: float) -> Array:
        """Return the gradient (n,)."""
        s = self.g + self.G @ w
        out = tau * (self.P @ w + self.q)
        for part in self.parts:
            out -= self.G[part.rows.ravel()].T @ part.back(s[part.rows], part.v).ravel()
        return np.asarray(out)

    def rows(self, w: Array) -> Array:
        """Return M G, whose M G^T M G is the Hessian of the barrier."""
        s = self.g + self.G @ w
        return np.concatenate([p.factor(s[p.rows], self.G[p.rows]).reshape(-1, w.size) for p in self.parts])

    def back(self, w: Array, V: Array) -> Array:
        """Return M^T V (rows,) for V in the order of `rows`."""
        s, out, start = self.g + self.G @ w, np.zeros(self.g.size), 0
        for part in self.parts:
            end = start + part.rows.size
            out[part.rows] = part.back(s[part.rows], V[start:end].reshape(part.rows.shape))
            start = end
        return out

    def step(self, w: Array, tau: float) -> tuple[Array, float]:
        """Return the Newton step (n,) and the squared decrement."""
        R = np.concatenate([self.rows(w), np.sqrt(tau) * _root(self.P)])
        T = scipy.linalg.qr(R, mode="r", check_finite=False)[0][: w.size]
        half = scipy.linalg.solve_triangular(T, -self.slope(w, tau), trans=1, check_finite=False)
        return np.asarray(scipy.linalg.solve_triangular(T, half, check_finite=False)), float(half @ half)

    def dual(self, w: Array, dw: Array, tau: float) -> Array:
        """Return z (rows,) of the step dw at w.

        Near the end of the path g + G w is known to few digits, and P (w + dw) + q = G^T z holds to few. The smallest
        change of z, measured by M, mends that; the cones hardly notice it.
        """
        R = self.rows(w)
        v = np.concatenate([part.v.ravel() for part in self.parts])
        z = self.back(w, v - R @ dw) / tau
        Q, T = scipy.linalg.qr(R, mode="economic", check_finite=False)
        for _ in range(_REFINED):
            r = self.P @ (w + dw) + self.q - self.G.T @ z
            z += self.back(w, Q @ scipy.linalg.solve_triangular(T, r, trans=1, check_finite=False))
        return z


@register("scipy")
def answers(problem: ConicProblem, tolerance: float) -> Iterator[Answer]:
    """Follow the path in large steps, then, if asked again, in small ones."""
    for factor in _FACTORS:
        try:
            yield _answer(problem, tolerance, factor)
        except scipy.linalg.LinAlgError:
            yield nothing(problem, "a factorisation failed")


def _answer(problem: ConicProblem, tolerance: float, factor: float) -> Answer:
    program = problem.program
    cones = [(b.cone, part) for b, part in zip(program.blocks, program.slices, strict=True)]
    equal = np.concatenate([np.arange(0)] + [np.arange(p.start, p.stop) for cone, p in cones if cone == "zero"])
    A, a = program.G[equal], problem.g[equal]
    x0, N, left = _solved(A, a)
    if np.abs(left).max(initial=0.0) > _OPEN * (1.0 + np.abs(a).max(initial=0.0)):
        z = np.zeros(problem.g.size)
        z[equal] = -left
        return Answer("infeasible", x0, z, "equalities contradict each other")
    size = np.where(np.isfinite(program.sizes), _BOX * (program.sizes + 1.0), _UNBOUNDED)
    count = problem.g.size
    G = np.concatenate([program.G @ N, N, -N])
    g = np.concatenate([problem.g + program.G @ x0, size + x0, size - x0])
    parts = barriers([*cones, ("nonneg", slice(count, count + 2 * size.size))])
    start, give, z = _start(parts, G, g, factor)
    if start is None:
        z = z[:count]
        z[equal] = scipy.linalg.lstsq(A.T, -program.G.T @ z)[0] if equal.size else z[equal]
        return Answer("infeasible", x0, z, "no point inside the cones")
    stage = _Stage(parts, G, g + give, N.T * problem.P @ N, N.T @ (problem.q + problem.P * x0))
    w, z = _followed(stage, start, _GAP * tolerance, factor)
    x = x0 + N @ w
    z = z[:count]
    rest = problem.P * x + problem.q - program.G.T @ z
    z[equal] = scipy.linalg.lstsq(A.T, rest)[0] if equal.size else z[equal]
    return Answer("solved", x, z, "path followed to its end")


def _solved(A: Array, a: Array) -> tuple[Array, Array, Array]:
    """Return a solution of A x + a = 0, the kernel of A and what is left over."""
    n = A.shape[1]
    if not len(A):
        return np.zeros(n), np.eye(n), np.zeros(0)
    U, s, Vt = scipy.linalg.svd(A)
    rank = int((s > _RANK * s[0]).sum()) if s.size else 0
    x0 = -Vt[:rank].T @ ((U[:, :rank].T @ a) / s[:rank])
    return x0, Vt[rank:].T, A @ x0 + a


def _start(parts: list[Barrier], G: Array, g: Array, factor: float) -> tuple[Array | None, Array, Array]:
    """Return w inside the cones, by how much g had to give way, and a ray of the dual cone; w or the ray count.

    Cones without an interior get one of the width `_GIVE`, far below the tolerance of an answer.
    """
    e = np.zeros(g.size)
    for part in parts:
        e[part.rows] = part.unit
    rows, n = G.shape
    lifted = np.column_stack([G, -e])
    last = np.zeros((1, n + 1))
    last[0, n] = -1.0
    top = barriers([("nonneg", slice(rows, rows + 1))])
    stage = _Stage([*parts, *top], np.concatenate([lifted, last]), np.append(g, 1.0), np.zeros((n + 1, n + 1)), last[0])
    w = np.zeros(n + 1)
    w[n] = min([0.0, *(float(part.depth(g[part.rows]).min()) for part in parts)]) - 1.0
    tau = 1.0
    for _ in range(_STAGES):
        w, dw = _centred(stage, w, tau, until=n)
        if w[n] > 0.0:
            return w[:n], 0.0 * e, e
        gap = stage.degree / tau
        if w[n] > -_GIVE and gap < _GIVE:
            return w[:n], 2.0 * _GIVE * e, e
        if gap < _SURE * abs(w[n]):
            break
        tau *= factor
    return None, 0.0 * e, stage.dual(w, dw, tau)[:-1]


def _followed(stage: _Stage, w: Array, gap: float, factor: float) -> tuple[Array, Array]:
    """Return the end of the path (n,) and z (rows,)."""
    tau = 1.0
    for _ in range(_STAGES):
        w, dw = _centred(stage, w, tau)
        if stage.degree / tau <= gap:
            break
        tau *= factor
    z = stage.dual(w, dw, tau)
    return (w + dw if stage.inside(w + dw) else w), z


def _centred(stage: _Stage, w: Array, tau: float, until: int | None = None) -> tuple[Array, Array]:
    """Return the point of the path at tau, and the Newton step that is left there."""
    for _ in range(_NEWTON):
        dw, decrement = stage.step(w, tau)
        if decrement <= _CENTRED or (until is not None and w[until] > 0.0):
            break
        w = w + _length(stage, w, dw, tau) * dw
    return w, dw


def _length(stage: _Stage, w: Array, dw: Array, tau: float) -> float:
    """Return the share of a step that stays inside and goes downhill."""
    steep = abs(float(stage.slope(w, tau) @ dw))
    length = 1.0
    while length > _SHORT:
        moved = w + length * dw
        if stage.inside(moved) and float(stage.slope(moved, tau) @ dw) <= _STEEP * steep:
            return length
        length *= _SHORTER
    return 0.0


def _root(P: Array) -> Array:
    """Return a factor R of P = R^T R; nothing of zero."""
    if not P.any():
        return np.zeros((0, len(P)))
    values, vectors = scipy.linalg.eigh(P)
    return np.asarray(np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T)
