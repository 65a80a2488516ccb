"""Solve a program by any solver, and check what it says.

With z in the dual cone, a solution has P x + q = G^T z and no gap between x.P x / 2 + q.x and -g.z - x.P x / 2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.solvers.answer import Answer
from fivebar_pin.balancing.solvers.bound import lower_bound, refined
from fivebar_pin.balancing.solvers.certificate import Certificate, certificate_of
from fivebar_pin.balancing.solvers.program import ConicProblem, Program
from fivebar_pin.balancing.solvers.registry import DEFAULT, solver_named
from fivebar_pin.errors import SolverError

__all__ = ["Outcome", "solve"]

_TOLERANCE = 1e-8  # residual and gap of an answer that is accepted [of the size of its numbers]


@dataclass(frozen=True, slots=True, eq=False)
class Outcome(Immutable):
    """What came of a solve. x is None when infeasible, certificate is None when solved.

    Attributes:
        x, z: primal (n,) and dual (rows,) solution.
        objective, dual: values of the two problems, with the margin.
        bound: what no objective without the margin is below, rigorously (see `bound`).
        certificate: proof of infeasibility.
    """

    x: Array | None
    z: Array
    objective: float
    dual: float
    bound: float
    certificate: Certificate | None


def solve(
    program: Program,
    P: Array,
    q: Array,
    *,
    margin: float = 0.0,
    give: float = 0.0,
    tolerance: float = _TOLERANCE,
    solver: str = DEFAULT,
) -> Outcome:
    """Solve for a diagonal P (n,) and q (n,), the cones tightened by a margin, or soft bounds given way by `give`.

    Raises:
        SolverError: no solution to the tolerance and no valid certificate; a solver that is not installed.
        UnknownNameError: there is no such solver.
    """
    problem = ConicProblem(program, P, q, program.g - np.where(program.soft, margin - give, margin) * program.inward)
    failure = SolverError("the conic solver was not run")
    for answer in solver_named(solver)(problem, tolerance):
        try:
            return _outcome(problem, answer, tolerance)
        except SolverError as error:
            failure = error
    raise failure


def _outcome(problem: ConicProblem, answer: Answer, tolerance: float) -> Outcome:
    """Check one answer, whatever the solver calls it."""
    if answer.kind == "infeasible":
        certificate = certificate_of(problem.program, answer.z, problem.g)
        return Outcome(None, answer.z, float("nan"), float("nan"), float("inf"), certificate)
    if answer.kind == "unbounded":
        raise SolverError(
            "the objective can fall without bound: bound the region, the masses or choose another objective"
        )
    return _accepted(problem, answer, tolerance)


def _accepted(problem: ConicProblem, answer: Answer, tolerance: float) -> Outcome:
    P, q, g, G = problem.P, problem.q, problem.g, problem.program.G
    x, z = answer.x, answer.z
    if not (np.isfinite(x).all() and np.isfinite(z).all()):
        raise SolverError(f"the conic solver stopped without an answer ({answer.status})", residual=np.inf)
    quadratic = float(x @ (P * x))
    objective, dual = 0.5 * quadratic + float(q @ x), -float(g @ z) - 0.5 * quadratic
    scale = 1.0 + float(np.abs(x).max(initial=0.0))
    worst = max(
        problem.program.outside(g + G @ x) / scale,
        float(np.abs(P * x + q - G.T @ z).max(initial=0.0)) / (1.0 + float(np.abs(q).max(initial=0.0))),
        float(np.abs(problem.program.projected(z) - z).max(initial=0.0)) / (1.0 + float(np.abs(z).max(initial=0.0))),
        abs(objective - dual) / (1.0 + abs(objective)),
    )
    if not worst <= tolerance:
        raise SolverError(
            f"the conic solver stopped at a residual of {worst:.2g}, {tolerance:g} is needed ({answer.status}). "
            "Loosen the bounds, or drop objectives of very different size.",
            residual=worst,
            tolerance=tolerance,
        )
    bound = lower_bound(problem.program, P, q, x, z)
    if objective - bound > tolerance * (1.0 + abs(objective)):  # what stationarity leaves over is worth a correction
        bound = max(bound, lower_bound(problem.program, P, q, x, refined(problem.program, z, P * x + q)))
    return Outcome(x, z, objective, dual, bound, None)
