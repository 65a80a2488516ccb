"""The closed configurations of a chain as a manifold: rank, tangent space, projection and local charts.

With the closure Jacobian J (scaled to one unit) and its singular value decomposition J = U diag(s) V^T of rank r,
the last columns of V span the velocities that keep the loops closed, whatever joints are actuated. A chart around a
closed configuration q_0 takes f = nv - r independent coordinates

    xi = B^T (q - q_0),   B = the tangent space at q_0

and finds all others from the closures; it holds while B and the tangent space at q stay well apart from orthogonal.
Unlike the choice of single joints, no chart fails where the mechanism itself is regular [Potra and Yen 1991].
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import SingularityError
from fivebar_pin.mechanism.loops import RANK_TOLERANCE, Loops, loops_of, open_message
from fivebar_pin.mechanism.per_chain import once_per_chain
from fivebar_pin.mechanism.tree import Poses

__all__ = ["ROUND_OFF", "Chart", "Manifold", "Point", "manifold_of"]


ROUND_OFF = 2e-15  # scaled closure residual that Newton's method is asked for [-]
_PROBES = 8
_PROBE_STEP = 0.05  # how far the neighbours lie at which the rank is compared [rad, or chain lengths]


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """A batch of configurations with the decomposed closure Jacobian.

    Attributes:
        q: configurations (n, nq).
        poses, pairs: of the joints, and what the closures see of them.
        residual: all closure rows (n, m) [m, rad].
        reduced: the scaled independent combinations of them (n, r).
        U, s, Vt: singular value decomposition of the reduced, scaled Jacobian: (n, r, r), (n, r), (n, nv, nv).
    """

    q: Array
    poses: Poses
    pairs: list[Any]
    residual: Array
    reduced: Array
    U: Array
    s: Array
    Vt: Array


@dataclass(frozen=True, slots=True, eq=False)
class Chart:
    """Independent coordinates around a closed configuration.

    Attributes:
        q: the configuration (nq,) at which they are zero.
        B: tangent space there, scaled, orthonormal (nv, f).
    """

    q: Array
    B: Array


class Manifold:
    """The closed configurations of one chain.

    Attributes:
        rank: of the closures at regular closed configurations. It may be less than that of open ones (parallelograms
            with a third crank, Bennett linkages); then the redundant rows are left out everywhere.
    """

    def __init__(self, chain: ClosedChain) -> None:
        self.loops: Loops = loops_of(chain)
        self.scale = self.loops.column_scale
        self._model = chain.model
        self._curved = any(j.nv > 1 for j in list(chain.model.joints)[1:])
        self._rank: int | None = None

    def at(self, q: Array) -> Point:
        """Evaluate the closures at q (n, nq)."""
        loops, n = self.loops, q.shape[0]
        poses = loops.tree.poses(q)
        if not loops.m:
            V = np.broadcast_to(np.eye(loops.tree.nv), (n, loops.tree.nv, loops.tree.nv))
            return Point(q, poses, [], np.zeros((n, 0)), np.zeros((n, 0)), np.zeros((n, 0, 0)), np.zeros((n, 0)), V)
        pairs = loops.pairs(poses)
        residual = loops.residual(pairs)
        J = np.matmul(loops.reduce, loops.jacobian(poses, pairs)) * self.scale
        U, s, Vt = np.linalg.svd(J, full_matrices=True)
        return Point(q, poses, pairs, residual, residual @ loops.reduce.T, U, s, Vt)

    def rank_of(self, point: Point) -> int:
        """Return the rank to work with at closed configurations.

        Raises:
            SingularityError: some of them are bifurcations: the rank there is less than at their neighbours.
        """
        if not self.loops.r or not point.s.size:
            return self.loops.r
        ranks = np.sum(point.s > RANK_TOLERANCE * np.maximum(1.0, point.s[:, :1]), axis=1)
        if self._rank is None and int(ranks.min()) == self.loops.r:
            self._rank = self.loops.r
        if self._rank is None:
            self._rank = max(int(ranks.max()), self._rank_nearby(point.q[int(np.argmin(ranks))]))
        worst = int(np.argmin(ranks))
        if ranks[worst] < self._rank:
            sigma = float(point.s[worst, self._rank - 1])
            raise SingularityError(
                f"configuration {worst} is a bifurcation of the mechanism: the closures have rank {ranks[worst]} there "
                f"and {self._rank} around it, so its motion is not determined (smallest scaled singular value "
                f"{sigma:.2g}). Start away from it.",
                sigma=sigma,
                sample=worst,
            )
        return self._rank

    def project(self, q: Array, tolerance: float, *, iterations: int = 50) -> Point:
        """Return the closed configuration near q (nq,), by Gauss-Newton steps of least length.

        Raises:
            AssemblyError: none was reached.
        """
        loops = self.loops
        point = self.at(np.array(q[None]))
        for _ in range(iterations):
            if np.abs(point.reduced).max(initial=0.0) <= ROUND_OFF:
                break
            before = np.abs(point.reduced).max()
            trial = self.at(loops.tree.integrate(point.q, (self._least(point) * self.scale)[None]))
            if np.abs(trial.reduced).max() >= before and before < 1e-12:
                break
            point = trial
        if np.abs(point.residual).max(initial=0.0) > tolerance * max(1.0, loops.length):
            raise open_message(loops, point.residual[0], "near the given configuration")
        return point

    def chart_at(self, point: Point, rank: int) -> Chart:
        """Return independent coordinates around the first configuration of a point."""
        return Chart(np.array(point.q[0]), np.array(point.Vt[0, rank:].T))

    def coordinates(self, chart: Chart, q: Array) -> Array:
        """Return the independent coordinates (f,) of q (nq,)."""
        away = self.loops.tree.difference(chart.q[None], q[None])[0]
        return np.asarray(chart.B.T @ (away / self.scale))

    def slope(self, chart: Chart, q: Array) -> Array:
        """Return what takes a scaled velocity at q (nq,) to the rate of the independent coordinates (f, nv)."""
        if not self._curved:
            return chart.B.T
        D = pin.dDifference(self._model, chart.q, q, pin.ARG1)
        return np.asarray(chart.B.T @ (D / self.scale[:, None] * self.scale))

    def solve(self, chart: Chart, xi: Array, guess: Array, rank: int, *, iterations: int = 12) -> Point | None:
        """Return the closed configuration with independent coordinates xi (f,), from a guess (nq,); None if none."""
        tree, q = self.loops.tree, guess[None]
        last = np.inf
        for _ in range(iterations):
            point = self.at(q)
            off = xi - self.coordinates(chart, q[0])
            size = max(float(np.abs(point.reduced).max(initial=0.0)), float(np.abs(off).max(initial=0.0)))
            if size <= ROUND_OFF * (1.0 + float(np.abs(xi).max(initial=0.0))) or (size < 1e-12 and size >= 0.5 * last):
                return point
            if not size < 1e3:
                return None
            last = size
            Vr = point.Vt[0, :rank]
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                inward = -(point.U[0, :, :rank].T @ point.reduced[0]) / point.s[0, :rank]
            A = np.concatenate([Vr, self.slope(chart, q[0])])
            try:
                step = np.linalg.solve(A, np.concatenate([inward, off]))
            except np.linalg.LinAlgError:
                return None
            if not np.all(np.isfinite(step)):
                return None
            q = tree.integrate(q, (step * self.scale)[None])
        return None

    def _least(self, point: Point) -> Array:
        """Return the step of least length towards closure, scaled (nv,); directions of tiny slope are left out."""
        keep = point.s[0] > 1e-7
        along = np.where(keep, point.U[0, :, : keep.size].T @ point.reduced[0], 0.0) / np.where(keep, point.s[0], 1.0)
        step = -(point.Vt[0, : keep.size].T @ along)
        return np.asarray(step * min(1.0, 0.5 / max(float(np.abs(step).max(initial=0.0)), 1e-300)))

    def _rank_nearby(self, q: Array) -> int:
        """Return the largest rank met at closed configurations around q (nq,)."""
        rng = np.random.default_rng(11)
        here = self.at(q[None])
        tangent = here.Vt[0, int(np.sum(here.s[0] > RANK_TOLERANCE)) :]
        best = 0
        for _ in range(_PROBES):
            step = rng.normal(size=tangent.shape[0]) @ tangent
            away = _PROBE_STEP * step / max(float(np.abs(step).max(initial=0.0)), 1e-300)
            near = self.at(self.loops.tree.integrate(q[None], (away * self.scale)[None]))
            for _ in range(60):
                near = self.at(self.loops.tree.integrate(near.q, (self._least(near) * self.scale)[None]))
            if np.abs(near.reduced).max(initial=0.0) < 1e-12:
                best = max(best, int(np.sum(near.s[0] > 1e-7)))
        return best


@once_per_chain
def manifold_of(chain: ClosedChain) -> Manifold:
    """Return the prepared manifold of a chain, made once."""
    return Manifold(chain)
