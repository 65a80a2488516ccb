"""Random balancing problems against an independent program: verdicts, optima, bodies that exist, no errors.

FIVEBAR_PIN_RANDOM_PROBLEMS=500 tries that many; a few unless given.
"""

from __future__ import annotations

import os

import balance_problems
import numpy as np
import pytest

from fivebar_pin.balancing import balance_problem
from fivebar_pin.balancing._parameters import pseudo_inertia

COUNT = int(os.environ.get("FIVEBAR_PIN_RANDOM_PROBLEMS", "16"))
SEED = int(os.environ.get("FIVEBAR_PIN_RANDOM_SEED", "7"))
AGREE = 1e-5  # largest difference to cvxpy's optimum [of the optimum or its typical size]
GAP = 1e-5  # largest gap that is left [the same]


@pytest.mark.parametrize("k", range(COUNT))
def test_a_random_problem_ends_as_an_independent_program_says(k: int) -> None:
    case = balance_problems.draw(np.random.default_rng((SEED, k)))
    problem = balance_problem(case.chain, case.kind, **case.arguments)
    design = problem.solve(case.minimise)
    status, optimum, size = balance_problems.decided(case, problem.conditions)
    assert design.status == status, case
    if not design.feasible:
        return
    size = max(size, abs(optimum))
    assert design.objective == pytest.approx(optimum, abs=AGREE * size), case
    assert -GAP * size <= design.gap <= GAP * size, case
    assert design.residual < 1e-13
    for pi in (*design.parameters, *(c.parameters for c in design.added)):
        assert np.linalg.eigvalsh(pseudo_inertia(pi))[0] >= -1e-12, case
