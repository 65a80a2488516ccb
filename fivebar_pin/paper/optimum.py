"""The paper's balanced linkage: the optimum of (77)-(80), in its 8 variables and in the conclusion's 12."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, checked, finite, frozen, number, numeric
from fivebar_pin.errors import InfeasibleError, InvalidInputError, SolverError
from fivebar_pin.paper.equations import HOLDS, Conditions, conditions
from fivebar_pin.paper.linkage import FiveBar
from fivebar_pin.paper.polar import Problem, Stationary, alone, climb
from fivebar_pin.paper.starts import balanced_points, mixtures, only_point

__all__ = ["Optimum", "balance_mass_centres", "balance_masses"]

Bounds = tuple[npt.ArrayLike, npt.ArrayLike]

_WRITTEN = 1e-9  # weights written with so many digits add up to one [-]
_ADDED = 1e-12  # round-off of a sum of masses [of the sum]
_FLAT = 1e-9  # negative curvature that is round-off [-]
_SAME = 1e-9  # difference of objectives, over 1 + objective, that counts as none [-]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Optimum(Immutable):
    """A force balanced linkage that minimises (77), and the evidence that it does.

    Attributes:
        linkage: the balanced linkage; lengths and inertias about the mass centres are those given.
        objective: (77) [-].
        weights: w_alpha, w_rho.
        conditions: residuals of (60)-(63), (68)-(71).
        multipliers: of the conditions: (6,), or (7,) when the masses are free.
        bound_multipliers: of active bounds on alpha (none), rho and mu (12,); zero elsewhere.
        kkt_residual: largest violation of the optimality conditions [-]; slopes relative to the largest multiplier
            where that exceeds one. Where the bounds leave a single linkage it is the optimum without multipliers
            (nan), and this is its largest residual of the conditions and bounds.
        curvature: least eigenvalue of the Lagrangian's Hessian along the conditions; positive: a strict minimum.
        starts: how many starting points were tried.
        reached: how many of them led to a minimum.
        minima: objectives of the distinct minima found, ascending; the first is `objective`.
    """

    linkage: FiveBar
    objective: float
    weights: tuple[float, float]
    conditions: Conditions
    multipliers: Array
    bound_multipliers: Array
    kkt_residual: float
    curvature: float
    starts: int
    reached: int
    minima: tuple[float, ...]

    @property
    def residuals(self) -> Array:
        """Residuals of the seven equations (7,) [-]."""
        return self.conditions.residuals

    def __repr__(self) -> str:
        return (
            f"Optimum(rho={self.linkage.rho.tolist()}, alpha={self.linkage.alpha.tolist()}, "
            f"objective={self.objective:.6g}, kkt_residual={self.kkt_residual:.1e}, "
            f"{self.reached} of {self.starts} starts reached a minimum)"
        )


@finite(open=("bound_multipliers", "curvature", "multipliers"))
def balance_mass_centres(
    linkage: FiveBar,
    *,
    weights: tuple[float, float] = (0.5, 0.5),
    rho_bounds: Bounds | None = None,
    tolerance: float = HOLDS,
) -> Optimum:
    """Return the optimum of (77)-(79) in alpha_i and rho_i, the masses being those of the linkage.

    Once l_1 is chosen, the conditions give the other l_i: the feasible set is a plane. It is searched for starting
    points with every link on either side of its joint; from each, SLSQP and then Newton on the KKT system. The best of
    the minima that pass the tolerance is returned.

    Args:
        linkage: gives lengths, masses and inertias; its rho and alpha do not matter.
        weights: w_alpha and w_rho, positive, with sum 1, (78).
        rho_bounds: lowest and highest rho, scalars or (4,) each [-], infinite where there is none; rho may be
            negative unless they say otherwise.
        tolerance: bound on the KKT residual [-].

    Raises:
        InvalidInputError: weights outside (78), bounds in the wrong order, a tolerance that is not positive.
        InfeasibleError: no linkage within the bounds is balanced.
        SolverError: no start reached a minimum.
    """
    mu = linkage.mass_ratios
    problem = _problem(weights, rho_bounds, (mu, mu))
    number("tolerance", tolerance, positive=True)
    starts = balanced_points(problem, mu, each=1 if rho_bounds is None else 3)  # bounds may cut the plane apart
    only = only_point(problem, mu) if rho_bounds is not None else []
    points = [alone(problem, x) for x in only] or [climb(problem, x) for x in starts]
    return _best(linkage, problem, only or starts, points, tolerance)


@finite(open=("bound_multipliers", "curvature", "multipliers"))
def balance_masses(
    linkage: FiveBar,
    *,
    mass_bounds: Bounds,
    total_mass: float | None = None,
    weights: tuple[float, float] = (0.5, 0.5),
    rho_bounds: Bounds | None = None,
    tolerance: float = HOLDS,
) -> Optimum:
    """Return the optimum of (77) in all twelve variables alpha_i, rho_i, mu_i, under (70) and (71).

    The inequalities (71) are open: without bounds the best linkage would have links of no mass, so bounds are needed.

    Args:
        linkage: gives lengths, inertias, and the total mass unless given.
        mass_bounds: lowest and highest mass of each link, scalars or (4,) each [kg]; the lowest must be positive, the
            highest may be infinite.
        total_mass: sum of the four masses [kg].
        weights, rho_bounds, tolerance: as for `balance_mass_centres`.

    Raises:
        InvalidInputError: weights outside (78), bounds in the wrong order or not positive.
        InfeasibleError: the mass bounds do not allow the total mass, or no mass distribution tried can be balanced.
        SolverError: no start reached a minimum.
    """
    total = number("total_mass", linkage.masses.sum() if total_mass is None else total_mass, positive=True, unit="kg")
    low, high = _bounds("mass_bounds", mass_bounds)
    if np.any(low <= 0.0):
        raise InvalidInputError("mass_bounds[0]", low.tolist(), "must be positive, (71) [kg]")
    if low.sum() > total * (1.0 + _ADDED) or high.sum() < total * (1.0 - _ADDED):
        raise InfeasibleError(
            f"Masses between {low.tolist()} and {high.tolist()} kg add up to between {low.sum():g} and {high.sum():g} "
            f"kg, never to the total mass of {total:g} kg. Change mass_bounds or total_mass."
        )
    number("tolerance", tolerance, positive=True)
    problem = _problem(weights, rho_bounds, (low / total, np.minimum(high / total, 1.0)))
    starts: list[Array] = []
    reasons: list[InfeasibleError] = []
    for mu in mixtures(problem.low[8:], problem.high[8:]):
        try:
            starts += balanced_points(problem, mu, each=1)[:6]
        except InfeasibleError as error:
            reasons.append(error)
    if not starts:
        raise InfeasibleError(f"No mass distribution tried can be balanced within rho_bounds. {reasons[0]}")
    points = [climb(problem, x) for x in starts]
    return _best(linkage, problem, starts, points, tolerance, total=total)


def _problem(weights: tuple[float, float], rho_bounds: Bounds | None, mu: tuple[Array, Array]) -> Problem:
    w = checked("weights", weights, (2,))
    if np.any(w <= 0.0) or np.any(w >= 1.0) or abs(w.sum() - 1.0) > _WRITTEN:
        raise InvalidInputError("weights", w.tolist(), "must lie between 0 and 1 and add up to 1, (78)")
    low, high = np.full(12, -np.inf), np.full(12, np.inf)
    if rho_bounds is not None:
        low[4:8], high[4:8] = _bounds("rho_bounds", rho_bounds)
    low[8:], high[8:] = mu
    return Problem((float(w[0]), float(w[1])), frozen(low), frozen(high))


def _bounds(name: str, bounds: Bounds) -> tuple[Array, Array]:
    if not isinstance(bounds, Sequence | np.ndarray) or len(bounds) != 2:
        raise InvalidInputError(name, bounds, "must be a pair: the lowest and the highest, scalars or (4,) each")
    pair = []
    for side, values in zip(("[0]", "[1]"), bounds, strict=True):
        array = numeric(name + side, values)
        array = np.full(4, array) if array.ndim == 0 else array
        checked(name + side, np.where(np.isinf(array), 0.0, array), (4,))  # infinite: no bound on this side
        pair.append(array)
    low, high = pair
    if np.any(low > high) or np.any(low == np.inf) or np.any(high == -np.inf):
        raise InvalidInputError(name, [low.tolist(), high.tolist()], "the lowest must not exceed the highest")
    return low, high


def _best(
    linkage: FiveBar,
    problem: Problem,
    starts: list[Array],
    points: list[Stationary],
    tolerance: float,
    *,
    total: float | None = None,
) -> Optimum:
    """Return the best of the points that are minima; `total` mass where the masses were free [kg]."""
    minima = [p for p in points if p.residual <= tolerance and p.curvature >= -_FLAT]
    if not minima:
        nearest: Stationary = min(points, key=lambda p: p.residual)
        raise SolverError(
            f"None of {len(starts)} starts reached a minimum: the nearest stops at a KKT residual of "
            f"{nearest.residual:.3g} (tolerance {tolerance:.3g}). Loosen the tolerance or change the bounds.",
            residual=nearest.residual,
            tolerance=tolerance,
        )
    minima.sort(key=lambda p: problem.objective(p.x))
    best = minima[0]
    values = [problem.objective(p.x) for p in minima]
    known = min(problem.objective(x) for x in starts)
    if values[0] > known + _SAME * (1.0 + known):
        raise SolverError(
            f"The best minimum found has the objective {values[0]:.6g}, but a balanced linkage with {known:.6g} is "
            "known: the search missed a minimum. Change the bounds or the weights a little.",
            residual=values[0] - known,
            tolerance=_SAME,
        )
    distinct = [v for k, v in enumerate(values) if k == 0 or v - values[k - 1] > _SAME * (1.0 + v)]
    alpha, rho, mu = best.x[:4], best.x[4:8], best.x[8:]
    masses = linkage.masses if total is None else total * mu
    balanced = replace(linkage, masses=masses, rho=rho, alpha=alpha)
    return Optimum(
        linkage=balanced,
        objective=values[0],
        weights=problem.weights,
        conditions=conditions(balanced),
        multipliers=frozen(best.multipliers),
        bound_multipliers=frozen(best.bound_multipliers),
        kkt_residual=best.residual,
        curvature=best.curvature,
        starts=len(starts),
        reached=len(minima),
        minima=tuple(distinct),
    )
