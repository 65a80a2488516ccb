"""Random balancing problems against an independent program: verdicts, optima, bodies that exist, no errors.

FIVEBAR_PIN_RANDOM_PROBLEMS=500 tries that many; a few unless given.
"""

from __future__ import annotations

import os

import balance_problems
import numpy as np
import pytest

from fivebar_pin.balancing import balance_problem, realise
from fivebar_pin.balancing.parameters import pseudo_inertia

COUNT = int(os.environ.get("FIVEBAR_PIN_RANDOM_PROBLEMS", "16"))
SEED = int(os.environ.get("FIVEBAR_PIN_RANDOM_SEED", "7"))
AGREE = 1e-5  # largest difference to cvxpy's optimum [of the optimum or its typical size]
ROUGHLY = 2e-3  # the same where cvxpy calls its own answer inaccurate
GAP = 1e-5  # largest gap that is left [the same]
BODY = 1e-12  # smallest eigenvalue of a pseudo-inertia that counts as zero [kg, kg m, kg m2]


@pytest.mark.parametrize("k", range(COUNT))
def test_a_random_problem_ends_as_an_independent_program_says(k: int) -> None:
    """Of discs, cvxpy says what none can be better than; what was found can be made, and is no better."""
    case = balance_problems.draw(np.random.default_rng((SEED, k)))
    problem = balance_problem(case.chain, case.kind, **case.arguments)
    design = problem.solve(case.minimise)
    status, optimum, size = balance_problems.decided(case, problem.conditions)
    assert ("optimal" if design.feasible else "infeasible") == status.removesuffix("_inaccurate"), case
    if not design.feasible:
        return
    size, agree = max(size, abs(optimum)), ROUGHLY if status.endswith("_inaccurate") else AGREE
    assert design.dual_bound == pytest.approx(optimum, abs=(agree + GAP) * size), case
    assert design.gap >= -GAP * size, case
    if design.status == "optimal":
        assert design.objective == pytest.approx(optimum, abs=agree * size), case
        assert design.gap <= GAP * size, case
    else:
        assert design.pieces or design.gap <= ROUGHLY * size, case
    assert design.residual < 1e-13
    left = [case.chain.inertial_parameters[case.chain.joints.index(c.body)] - c.parameters for c in design.removed]
    for pi in (*design.parameters, *left, *(c.parameters for c in (*design.added, *design.removed))):
        assert np.linalg.eigvalsh(pseudo_inertia(pi))[0] >= -BODY, case
    if design.pieces:
        made = realise(design)
        assert made.attained, case
        assert all(w.overhang <= 2e-5 * case.chain.length for w in made.weights), case
