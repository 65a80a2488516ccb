"""Clarabel: an interior-point method for all our cones, the solver that is used unless another is asked for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from fivebar_pin.balancing.solvers.answer import Answer, nothing
from fivebar_pin.balancing.solvers.program import Block, ConicProblem
from fivebar_pin.balancing.solvers.registry import register
from fivebar_pin.errors import SolverError

__all__ = ["answers"]

_FIRMER = 1e-10  # constant added to the diagonal of the linear system, for ill-conditioned programs [-]
# The programs come well scaled, so the solver's own equilibration is left out at first; the others are for the rest.
_ATTEMPTS: tuple[dict[str, object], ...] = (
    {"equilibrate_enable": False},
    {},
    {"max_step_fraction": 0.9},
    {"static_regularization_constant": _FIRMER},
    {"equilibrate_enable": False, "max_step_fraction": 0.9},
)
_ITERATIONS = 300
_ASKED = 1e-2  # the solver is asked for this much of the tolerance that is accepted
_TOLERANCES = ("tol_gap_abs", "tol_gap_rel", "tol_feas", "tol_infeas_abs", "tol_infeas_rel")
_PANIC = "PanicException"  # what a panic in Rust arrives as; it is no Exception and has no importable class
_CONES = {"zero": "ZeroConeT", "nonneg": "NonnegativeConeT", "soc": "SecondOrderConeT"}


@register("clarabel")
def answers(problem: ConicProblem, tolerance: float) -> Iterator[Answer]:
    """Solve with one setting after the other, as long as answers are asked for.

    Raises:
        SolverError: Clarabel is not installed.
    """
    from scipy import sparse

    clarabel = _clarabel()
    program, P = problem.program, problem.P
    minus_G = sparse.csc_matrix(-program.G)
    diagonal = np.arange(P.size)
    quadratic = sparse.csc_matrix((P, (diagonal, diagonal)), shape=(P.size, P.size))
    cones = _cones(clarabel, program.blocks)
    for changes in _ATTEMPTS:
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_iter = _ITERATIONS
        for name in _TOLERANCES:
            setattr(settings, name, _ASKED * tolerance)
        for name, value in changes.items():
            setattr(settings, name, value)
        try:
            solution = clarabel.DefaultSolver(quadratic, problem.q, minus_G, problem.g, cones, settings).solve()
        except BaseException as error:
            if type(error).__name__ != _PANIC:
                raise
            yield nothing(problem, f"gave up: {error}")
            continue
        yield Answer(_kind(str(solution.status)), np.array(solution.x), np.array(solution.z), str(solution.status))


def _kind(status: str) -> str:
    if "PrimalInfeasible" in status:
        return "infeasible"
    return "unbounded" if "DualInfeasible" in status else "solved"


def _cones(clarabel: Any, blocks: Sequence[Block]) -> list[object]:
    out = []
    for block in blocks:
        if block.cone == "psd":
            out.append(clarabel.PSDTriangleConeT(int(np.sqrt(2 * block.g.size))))
        else:
            out.append(getattr(clarabel, _CONES[block.cone])(block.g.size))
    return out


def _clarabel() -> Any:
    try:
        import clarabel
    except ImportError as error:
        raise SolverError("the conic solver is not installed: pip install clarabel") from error
    return clarabel
