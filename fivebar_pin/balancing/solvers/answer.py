"""What a solver says; nothing in it is believed before `solve` has checked it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.solvers.program import Problem

__all__ = ["Answer", "Solver"]


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
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


Solver = Callable[[Problem, float], Iterator[Answer]]  # problem, tolerance -> answers, each tried harder for
