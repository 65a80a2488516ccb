"""Conic programs and who solves them: a problem is data, a solver is one file, an answer is checked by us.

    program = Program(n, blocks)                     # g + G x in K, once
    outcome = solve(program, P, q, solver="clarabel")

A new solver is a module here with a function `answers(problem, tolerance)` and its name in `SOLVERS`.
"""

from __future__ import annotations

from fivebar_pin.balancing.solvers.certificate import Certificate
from fivebar_pin.balancing.solvers.cones import smat, svec
from fivebar_pin.balancing.solvers.program import Block, Program
from fivebar_pin.balancing.solvers.solving import DEFAULT, SECOND, SOLVERS, Outcome, solve, solver_named

__all__ = [
    "DEFAULT",
    "SECOND",
    "SOLVERS",
    "Block",
    "Certificate",
    "Outcome",
    "Program",
    "smat",
    "solve",
    "solver_named",
    "svec",
]
