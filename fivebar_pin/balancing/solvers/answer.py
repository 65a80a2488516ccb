"""What a solver says; nothing in it is believed before `solve` has checked it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.solvers.program import ConicProblem

__all__ = ["Answer", "Solver", "nothing"]


@dataclass(frozen=True, slots=True, eq=False)
class Answer(Immutable):
    """One answer of a solver to a problem.

    Attributes:
        kind: "solved", "infeasible" (z is a ray) or "unbounded".
        x, z: primal (n,) and dual (rows,) variables.
        status: the solver's own word.
    """

    kind: str
    x: Array
    z: Array
    status: str


def nothing(problem: ConicProblem, status: str) -> Answer:
    """Return the answer of a solver that has none."""
    return Answer("solved", np.full(problem.q.size, np.nan), np.full(problem.g.size, np.nan), status)


Solver = Callable[[ConicProblem, float], Iterator[Answer]]  # problem, tolerance -> answers, each tried harder for
