"""Who solves conic programs, by name."""

from __future__ import annotations

from collections.abc import Callable

from fivebar_pin.balancing.solvers.answer import Solver
from fivebar_pin.errors import UnknownNameError

__all__ = ["DEFAULT", "SECOND", "SOLVERS", "register", "solver_named"]

DEFAULT = "clarabel"
SECOND = "scipy"  # asked where another has no acceptable answer
SOLVERS: dict[str, Solver] = {}


def register(name: str) -> Callable[[Solver], Solver]:
    """Let a name stand for a solver."""

    def add(solver: Solver) -> Solver:
        SOLVERS[name] = solver
        return solver

    return add


def solver_named(name: str) -> Solver:
    """Return a solver.

    Raises:
        UnknownNameError: there is none of this name.
    """
    if name not in SOLVERS:
        raise UnknownNameError("solver", name, SOLVERS)
    return SOLVERS[name]
