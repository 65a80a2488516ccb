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

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import TINY, Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import SingularityError
from fivebar_pin.mechanism.closing import STEP, closed_enough, iterate
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import Loops, loops_of, open_message
from fivebar_pin.mechanism.per_chain import once_per_chain
from fivebar_pin.mechanism.rank import SINGULAR, raised

__all__ = ["ROUND_OFF", "Chart", "Manifold", "manifold_of"]


ROUND_OFF = 2e-15  # scaled closure residual that Newton's method is asked for [-]
_SETTLED = 1e-12  # scaled residual below which Newton steps that do not help are round-off [-]
_LOST = 1e3  # scaled residual, or distance in the chart, beyond which Newton's method is given up [-]
_PROBES = 8
_PROBE_STEP = 0.05  # how far the neighbours lie at which the rank is compared [rad, or chain lengths]
_PROBE_STEPS = 60  # Newton steps to a neighbour


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

    def at(self, q: Array) -> Configurations:
        """Evaluate the closures at q (n, nq)."""
        return Configurations(self.loops, q)

    def rank_of(self, point: Configurations) -> int:
        """Return the rank to work with at closed configurations.

        Raises:
            SingularityError: some of them are bifurcations: the rank there is less than at their neighbours.
        """
        if not self.loops.r or not point.independent.s.size:
            return self.loops.r
        ranks = point.independent.ranks
        if self._rank is None and int(ranks.min()) == self.loops.r:
            self._rank = self.loops.r
        if self._rank is None:
            self._rank = max(int(ranks.max()), self._rank_nearby(point.q[int(np.argmin(ranks))]))
        worst = int(np.argmin(ranks))
        if ranks[worst] < self._rank:
            sigma = float(point.independent.smallest(self._rank)[worst])
            raise SingularityError(
                f"configuration {worst} is a bifurcation of the mechanism: the closures have rank {ranks[worst]} there "
                f"and {self._rank} around it, so its motion is not determined (smallest scaled singular value "
                f"{sigma:.2g}). Start away from it.",
                sigma=sigma,
                sample=worst,
            )
        return self._rank

    def project(self, q: Array, tolerance: float, *, iterations: int = 50) -> Configurations:
        """Return the closed configuration near q (nq,), by Gauss-Newton steps of least length.

        Raises:
            AssemblyError: none was reached.
        """
        point = self._nearest(q, iterations)
        if not closed_enough(self.loops, point.gap, tolerance)[0]:
            raise open_message(self.loops, point.residual[0], "near the given configuration")
        return point

    def _nearest(self, q: Array, iterations: int) -> Configurations:
        """Return where steps of least length lead from q (nq,), closed or not."""
        rule = _LeastSteps()
        q = iterate(self.loops, q[None], rule, most=iterations + 1)  # the last one only looks
        return rule.reached

    def chart_at(self, point: Configurations, rank: int) -> Chart:
        """Return independent coordinates around the first configuration of a point."""
        return Chart(np.array(point.q[0]), np.array(point.independent.tangent(rank)[0]))

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

    def solve(self, chart: Chart, xi: Array, guess: Array, rank: int, *, iterations: int = 12) -> Configurations | None:
        """Return the closed configuration with independent coordinates xi (f,), from a guess (nq,); None if none."""
        rule = _ChartSteps(self, chart, xi, rank)
        iterate(self.loops, guess[None], rule, most=iterations)
        return rule.reached

    def _rank_nearby(self, q: Array) -> int:
        """Return the largest rank met at closed configurations around q (nq,)."""
        rng = np.random.default_rng(11)
        here = self.at(q[None]).independent
        tangent = here.tangent(here.rank)[0].T
        best = 0
        for _ in range(_PROBES):
            step = rng.normal(size=tangent.shape[0]) @ tangent
            away = _PROBE_STEP * step / max(float(np.abs(step).max(initial=0.0)), TINY)
            near = self._nearest(self.loops.tree.integrate(q[None], (away * self.scale)[None])[0], _PROBE_STEPS)
            if np.abs(near.reduced).max(initial=0.0) < _settled(self.loops):
                best = max(best, int(np.sum(near.independent.s[0] > _least(self.loops))))
        return best


def _settled(loops: Loops) -> float:
    """Return the scaled residual below which an iteration that gets no further has ended: round-off, or a misfit."""
    return raised(_SETTLED, loops.misfit)


def _least(loops: Loops) -> float:
    """Return the singular value above which a direction counts."""
    return raised(SINGULAR, loops.misfit)


class _LeastSteps:
    """Steps of least length in all coordinates, of one sample; directions of tiny slope are left out."""

    reached: Configurations

    def __init__(self) -> None:
        self._open = np.inf

    def __call__(self, here: Configurations, which: npt.NDArray[np.intp]) -> tuple[Array, npt.NDArray[np.bool_]]:
        size = float(np.abs(here.reduced).max(initial=0.0))
        if size >= self._open and self._open < _settled(here.loops):  # round-off: the last one was no worse
            return self.reached.q, np.zeros(1, dtype=np.bool_)
        self.reached, self._open = here, size
        if size <= ROUND_OFF:
            return here.q, np.zeros(1, dtype=np.bool_)
        J = here.independent
        step = -J.solve(here.reduced, int(np.sum(J.s[0] > _least(here.loops))))
        step *= min(1.0, STEP / max(float(np.abs(step).max(initial=0.0)), TINY))
        return here.loops.tree.integrate(here.q, step * here.loops.column_scale), np.ones(1, dtype=np.bool_)


class _ChartSteps:
    """Newton steps of one sample towards closed loops and given independent coordinates at once."""

    def __init__(self, manifold: Manifold, chart: Chart, xi: Array, rank: int) -> None:
        self._manifold, self._chart, self._xi, self._rank = manifold, chart, xi, rank
        self._enough = ROUND_OFF * (1.0 + float(np.abs(xi).max(initial=0.0)))
        self._last = np.inf
        self.reached: Configurations | None = None

    def __call__(self, here: Configurations, which: npt.NDArray[np.intp]) -> tuple[Array, npt.NDArray[np.bool_]]:
        off = self._xi - self._manifold.coordinates(self._chart, here.q[0])
        size = max(float(np.abs(here.reduced).max(initial=0.0)), float(np.abs(off).max(initial=0.0)))
        if size <= self._enough or (size < _settled(here.loops) and size >= 0.5 * self._last):
            self.reached = here
        step = None if self.reached is not None or not size < _LOST else self._step(here, off)
        self._last = size
        if step is None:
            return here.q, np.zeros(1, dtype=np.bool_)
        return here.loops.tree.integrate(here.q, (step * self._manifold.scale)[None]), np.ones(1, dtype=np.bool_)

    def _step(self, here: Configurations, off: Array) -> Array | None:
        """Return the scaled step (nv,), None where chart and closures do not determine one."""
        J = here.independent
        inward = -J.components(here.reduced, self._rank)[0]
        A = np.concatenate([J.Vt[0, : self._rank], self._manifold.slope(self._chart, here.q[0])])
        try:
            step = np.linalg.solve(A, np.concatenate([inward, off]))
        except np.linalg.LinAlgError:
            return None
        return np.asarray(step) if np.all(np.isfinite(step)) else None


@once_per_chain
def manifold_of(chain: ClosedChain) -> Manifold:
    """Return the prepared manifold of a chain, made once."""
    return Manifold(chain)
