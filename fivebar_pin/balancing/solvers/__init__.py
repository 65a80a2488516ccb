"""Conic programs and who solves them: a problem is data, a solver is one file, an answer is checked by us.

    program = Program(n, blocks)                     # g + G x in K, once
    outcome = solve(program, P, q, solver="clarabel")

A new solver is a module with a function `answers(problem, tolerance)` that is registered under its name.
"""

from __future__ import annotations

from fivebar_pin.balancing.solvers import clarabel, scipy
from fivebar_pin.balancing.solvers.answer import Answer, nothing
from fivebar_pin.balancing.solvers.certificate import Certificate
from fivebar_pin.balancing.solvers.cones import smat, svec
from fivebar_pin.balancing.solvers.program import Block, ConicProblem, Program
from fivebar_pin.balancing.solvers.registry import DEFAULT, SECOND, SOLVERS, register, solver_named
from fivebar_pin.balancing.solvers.solving import Outcome, solve

__all__ = [
    "DEFAULT",
    "SECOND",
    "SOLVERS",
    "Answer",
    "Block",
    "Certificate",
    "ConicProblem",
    "Outcome",
    "Program",
    "clarabel",
    "nothing",
    "register",
    "scipy",
    "smat",
    "solve",
    "solver_named",
    "svec",
]
