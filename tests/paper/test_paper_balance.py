"""The balancing conditions, their optimum, and the audit of Table 1."""

from dataclasses import replace
from fractions import Fraction as F

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fivebar_pin import paper
from fivebar_pin.errors import InfeasibleError, InvalidInputError, SolverError
from fivebar_pin.motion import Motion
from fivebar_pin.paper import optimum
from fivebar_pin.paper.audit import READINGS
from fivebar_pin.paper.polar import Problem, climb
from fivebar_pin.paper.rings import common_points
from fivebar_pin.paper.starts import balanced_points

CASE_I = paper.table_1("I", "balanced")
OPTIMUM = paper.balance_mass_centres(CASE_I)


def random_motion(linkage, seed, samples=200):
    """Return states that can be assembled, with rates and accelerations of any size."""
    rng = np.random.default_rng(seed)
    q = np.stack([rng.uniform(0, 2 * np.pi, samples), rng.uniform(1.0, 2.2, samples)], axis=1)
    return q, rng.normal(size=(samples, 2)) * 10, rng.normal(size=(samples, 2)) * 30


def balanced_with(linkage, s):
    """Return the linkage with mu2 l2 = s, which fixes the other l_i."""
    mu = linkage.mass_ratios
    l = (s + np.array([-mu[1], 0.0, mu[2], mu[2] + mu[3]])) / mu
    return replace(linkage, rho=np.abs(l), alpha=np.angle(l))


def best_on_grid(mu, weights, low=-np.inf, high=np.inf):
    """Return the least objective over a fine grid of balanced linkages, every side of every joint."""
    x = np.linspace(-1.5, 1.5, 401)
    s = (x[:, None] + 1j * x).ravel()
    l = (s[:, None] + np.array([-mu[1], 0.0, mu[2], mu[2] + mu[3]])) / mu
    best = 0.0
    cost = []
    for turn in (0.0, np.pi):
        alpha = np.angle(l * np.exp(1j * turn))
        rho = (l * np.exp(-1j * alpha)).real
        value = weights[0] * alpha**2 + weights[1] * (rho - 0.5) ** 2
        cost.append(np.where((rho >= low) & (rho <= high), value, np.inf))
    best = np.minimum(*cost).sum(axis=1)
    return best.min()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_conditions_hold_exactly_where_the_mass_centre_stands_still(seed):
    """Any point of the solution set of (60)-(69) makes the COM stationary; a step off it does not."""
    rng = np.random.default_rng(seed)
    linkage = replace(paper.table_1("I", "unbalanced"), masses=rng.uniform(0.05, 1.0, 4))
    linkage = balanced_with(linkage, complex(*rng.normal(size=2)))
    found = paper.conditions(linkage)
    assert found.hold(tolerance=1e-12)
    q = np.stack([rng.uniform(0, 6, 50), rng.uniform(1.0, 2.2, 50)], axis=1)
    still = paper.solve_states(linkage, q, 0 * q, 0 * q)
    reach = linkage.lengths.max() * np.abs(linkage.rho).max()
    assert np.ptp(still.com, axis=0).max() <= 1e-13 * max(1.0, reach)
    off = replace(linkage, rho=linkage.rho + rng.uniform(0.1, 0.3, 4) * rng.choice([-1, 1], 4))
    assert not paper.conditions(off).hold(tolerance=1e-3)
    assert np.ptp(paper.solve_states(off, q, 0 * q, 0 * q).com, axis=0).max() > 1e-5


def test_residuals_are_the_paper_s_left_sides_minus_right_sides():
    """(60)-(63), (68)-(70) written out, with a nonzero value in every term."""
    x = paper.FiveBar(CASE_I.lengths, (1, 2, 3, 4), CASE_I.inertias, (0.3, -0.6, 1.2, 0.7), (0.2, -0.9, 1.1, 0.4))
    mu, p = x.mass_ratios, x.mass_ratios * x.rho
    c, s = p * np.cos(x.alpha), p * np.sin(x.alpha)
    wanted = [
        c[1] - (c[2] - mu[2]),
        c[1] - (c[3] - mu[3] - mu[2]),
        s[1] - s[2],
        s[1] - s[3],
        c[1] - c[0] - mu[1],
        s[1] - s[0],
        mu.sum() - 1.0,
    ]
    found = paper.conditions(x)
    np.testing.assert_allclose(found.residuals, wanted, atol=1e-16)
    np.testing.assert_allclose(found.mass_residuals, 10.0 * np.array(wanted), atol=1e-15)
    assert found.equations == ("(60)", "(61)", "(62)", "(63)", "(68)", "(69)", "(70)")
    assert np.all(found.ratios > 0.0)
    assert "(60)" in str(found)
    assert "(71)" in str(found)


def test_case_I_optimum_is_the_exact_one():
    """rho = (-406/277, 161/277, 438/277, 2087/554), alpha = 0, optimal to round-off, a strict minimum."""
    exact = [float(x) for x in (F(-406, 277), F(161, 277), F(438, 277), F(2087, 554))]
    np.testing.assert_allclose(OPTIMUM.linkage.rho, exact, rtol=0, atol=1e-12)
    np.testing.assert_allclose(OPTIMUM.linkage.alpha, 0.0, atol=1e-12)
    assert OPTIMUM.kkt_residual <= 1e-14
    assert OPTIMUM.curvature > 0.0
    assert np.abs(OPTIMUM.residuals).max() <= 1e-15
    assert OPTIMUM.minima[0] == OPTIMUM.objective
    assert OPTIMUM.reached > len(OPTIMUM.minima)  # many starts end at one
    assert (np.diff(OPTIMUM.minima) > 1e-9).all()
    assert OPTIMUM.reached > 1
    for field in ("lengths", "masses", "inertias"):
        np.testing.assert_array_equal(getattr(OPTIMUM.linkage, field), getattr(CASE_I, field))
    assert "objective" in repr(OPTIMUM)


def test_optimum_leaves_no_shaking_force():
    """At most 1e-13 N on random motions, in both modes; the printed column shakes by newtons."""
    q, v, a = random_motion(CASE_I, 3)
    for mode in paper.AssemblyMode:
        balanced = paper.solve_states(OPTIMUM.linkage, q, v, a, mode=mode)
        printed = paper.solve_states(CASE_I, q, v, a, mode=mode)
        scale = np.abs(balanced.joint_forces).max()
        assert np.abs(balanced.shaking_force).max() <= 1e-13 * max(1.0, scale)
        ground = balanced.joint_forces[:, 4] - balanced.joint_forces[:, 0]  # (75), repaired
        assert np.abs(ground).max() <= 1e-13 * max(1.0, scale)
        assert np.abs(printed.shaking_force).max() > 1.0


@pytest.mark.parametrize("weights", [(0.5, 0.5), (0.9, 0.1), (0.05, 0.95), (0.2, 0.8)])
@pytest.mark.parametrize("case", [("I", "printed"), ("II", "printed"), ("II", "corrected")])
def test_no_balanced_linkage_on_a_fine_grid_is_better(weights, case):
    """The optimum lies at or below the best of 160801 balanced linkages, each with every side of every joint."""
    linkage = paper.table_1(case[0], "balanced", reading=case[1])
    found = paper.balance_mass_centres(linkage, weights=weights)
    grid = best_on_grid(linkage.mass_ratios, weights)
    assert found.objective <= grid + 1e-12
    assert found.objective == pytest.approx(grid, rel=0.05)


@settings(max_examples=6, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_optimum_of_random_masses_is_stationary_and_balanced(seed):
    """KKT residual, conditions and the grid bound for any masses and weights."""
    rng = np.random.default_rng(seed)
    linkage = replace(CASE_I, masses=rng.uniform(0.02, 1.0, 4))
    w = rng.uniform(0.05, 0.95)
    found = paper.balance_mass_centres(linkage, weights=(w, 1.0 - w))
    assert found.kkt_residual <= 1e-12
    assert found.conditions.hold()
    assert found.objective <= best_on_grid(linkage.mass_ratios, (w, 1.0 - w)) + 1e-12


def test_bounds_on_rho_are_kept_and_their_multipliers_told():
    """rho_4 <= 3.7 is active: its multiplier pulls inwards, the optimum is worse than the free one."""
    found = paper.balance_mass_centres(CASE_I, rho_bounds=(-3.0, 3.7))
    assert found.linkage.rho[3] == 3.7
    assert found.bound_multipliers[7] < 0.0
    assert np.count_nonzero(found.bound_multipliers) == 1
    assert found.objective > OPTIMUM.objective
    positive = paper.balance_mass_centres(CASE_I, rho_bounds=([0.0] * 4, [4.0] * 4))
    assert np.all(positive.linkage.rho >= 0.0)
    assert positive.conditions.hold()
    grid = best_on_grid(CASE_I.mass_ratios, (0.5, 0.5), 0.0, 4.0)
    assert positive.objective <= grid + 1e-12


def test_a_single_linkage_within_the_bounds_is_the_optimum():
    """The rings of rho_1 and rho_4 touch in one point: no multipliers exist there, but nothing else is left."""
    found = paper.balance_mass_centres(CASE_I, rho_bounds=(-1.2, 3.0))
    np.testing.assert_allclose(found.linkage.rho, [3.0, 1.0 / 7.0, 8.0 / 7.0, 3.0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(found.linkage.alpha, [np.pi, 0.0, 0.0, 0.0], rtol=0, atol=1e-7)
    assert found.conditions.hold() and found.kkt_residual <= 1e-12
    assert np.all(np.isnan(found.multipliers)) and found.curvature == np.inf
    pinned = paper.balance_mass_centres(CASE_I, rho_bounds=(OPTIMUM.linkage.rho, OPTIMUM.linkage.rho))
    np.testing.assert_allclose(pinned.linkage.rho, OPTIMUM.linkage.rho, rtol=0, atol=1e-12)


@pytest.mark.parametrize("room", [1e-3, 1e-6, 1e-9, 1e-12])
def test_bounds_that_leave_next_to_nothing_have_an_optimum_still(room):
    """The region is a lens sqrt(room) high; rho_1 and rho_4 stop at their bounds, the multipliers are large."""
    found = paper.balance_mass_centres(CASE_I, rho_bounds=(-1.2, 3.0 + room))
    assert found.conditions.hold() and found.kkt_residual <= 1e-12
    np.testing.assert_allclose(found.linkage.rho[[0, 3]], 3.0 + room, rtol=0, atol=1e-12)
    assert found.objective < paper.balance_mass_centres(CASE_I, rho_bounds=(-1.2, 3.0)).objective


def test_a_bound_may_be_missing_on_one_side():
    """Infinity means that there is none."""
    found = paper.balance_mass_centres(CASE_I, rho_bounds=(-np.inf, 3.7))
    np.testing.assert_allclose(
        found.linkage.rho, paper.balance_mass_centres(CASE_I, rho_bounds=(-9.0, 3.7)).linkage.rho, atol=1e-12
    )
    free = paper.balance_mass_centres(CASE_I, rho_bounds=(-np.inf, np.inf))
    np.testing.assert_allclose(free.linkage.rho, OPTIMUM.linkage.rho, rtol=0, atol=1e-12)


def test_masses_held_by_their_bounds_give_the_optimum_of_eight_variables():
    """Bounds that leave no freedom, up to round-off in their sum, are those of `balance`."""
    held = paper.balance_masses(CASE_I, mass_bounds=(CASE_I.masses, CASE_I.masses))
    np.testing.assert_allclose(held.linkage.rho, OPTIMUM.linkage.rho, rtol=0, atol=1e-12)
    again = paper.balance_masses(CASE_I, mass_bounds=(CASE_I.masses, CASE_I.masses), total_mass=0.4 * (1.0 - 1e-15))
    np.testing.assert_allclose(again.linkage.masses, CASE_I.masses, rtol=1e-12)


def test_bounds_that_forbid_balance_are_called_infeasible():
    """No linkage with every mass centre within its link is balanced with these masses."""
    with pytest.raises(InfeasibleError, match=r"No balanced linkage has rho between .* Widen rho_bounds or change"):
        paper.balance_mass_centres(CASE_I, rho_bounds=(0.0, 1.0))


def test_rings_with_a_common_point_are_never_missed():
    """Against a fine grid: what the grid finds the rule finds, and its points are common."""
    rng = np.random.default_rng(5)
    x = np.linspace(-3, 3, 241)
    grid = (x[:, None] + 1j * x).ravel()
    outcomes = set()
    for _ in range(200):
        c = rng.normal(size=4)
        inner = rng.uniform(0, 1.0, 4) * rng.integers(0, 2, 4)
        outer = inner + rng.uniform(0.1, 1.0, 4)
        found, violation = common_points(c, inner, outer)
        d = np.abs(grid[:, None] - c)
        seen = bool(np.any(np.all((d >= inner) & (d <= outer), axis=1)))
        outcomes.add(violation == 0.0)
        assert not (seen and found.size == 0)
        assert (found.size > 0) == (violation <= 1e-12)
        d = np.abs(found[:, None] - c)
        assert np.all((d >= inner - 1e-12) & (d <= outer + 1e-12))
    assert outcomes == {True, False}


@pytest.mark.parametrize("weights", [(0.0, 1.0), (0.5, 0.6), (1.5, -0.5), (np.nan, 0.5), (0.2, 0.3, 0.5)])
def test_weights_outside_78_are_refused(weights):
    """Both strictly between 0 and 1, sum 1."""
    with pytest.raises(InvalidInputError, match="weights"):
        paper.balance_mass_centres(CASE_I, weights=weights)


def test_bad_bounds_and_totals_are_refused():
    """Crossed, not positive, or impossible together."""
    with pytest.raises(InvalidInputError, match="the lowest must not exceed the highest"):
        paper.balance_mass_centres(CASE_I, rho_bounds=(1.0, 0.0))
    for bounds in (3.0, (1.0, 2.0, 3.0), None, "ab"):
        with pytest.raises(InvalidInputError, match="mass_bounds"):
            paper.balance_masses(CASE_I, mass_bounds=bounds)
    for low, high in ((np.inf, np.inf), (-np.inf, -np.inf), (np.nan, 1.0), ("a", 1.0)):
        with pytest.raises(InvalidInputError, match="rho_bounds"):
            paper.balance_mass_centres(CASE_I, rho_bounds=(low, high))
    for tolerance in (-1.0, 0.0, np.nan, "tight"):
        with pytest.raises(InvalidInputError, match="tolerance"):
            paper.balance_mass_centres(CASE_I, tolerance=tolerance)
    with pytest.raises(InvalidInputError, match=r"shape of rho_bounds\[0\]"):
        paper.balance_mass_centres(CASE_I, rho_bounds=([0.0, 1.0], 2.0))
    with pytest.raises(InvalidInputError, match=r"mass_bounds\[0\] = .* must be positive, \(71\)"):
        paper.balance_masses(CASE_I, mass_bounds=(0.0, 0.3))
    with pytest.raises(InvalidInputError, match=r"total_mass = -1\.0 but must be positive"):
        paper.balance_masses(CASE_I, mass_bounds=(0.01, 0.3), total_mass=-1.0)
    with pytest.raises(InfeasibleError, match=r"never to the total mass of 0\.4 kg"):
        paper.balance_masses(CASE_I, mass_bounds=(0.2, 0.3))
    with pytest.raises(InfeasibleError, match="No mass distribution tried can be balanced within rho_bounds"):
        paper.balance_masses(CASE_I, mass_bounds=(0.05, 0.3), rho_bounds=(0.4, 0.6))


def test_an_unreachable_tolerance_is_an_error_not_an_answer():
    """A half-converged iterate is never returned."""
    with pytest.raises(SolverError, match=r"None of \d+ starts reached a minimum") as caught:
        paper.balance_mass_centres(CASE_I, tolerance=1e-30)
    assert caught.value.tolerance == 1e-30
    assert 0.0 < caught.value.residual < 1e-12


def test_free_masses_do_better_than_given_ones():
    """Twelve variables: (70) and the mass bounds hold, the optimum is no worse than with any given masses tried."""
    found = paper.balance_masses(CASE_I, mass_bounds=(0.02, 0.3))
    assert found.conditions.hold()
    assert found.kkt_residual <= 1e-12
    assert found.multipliers.shape == (7,)
    masses = found.linkage.masses
    assert masses.sum() == pytest.approx(CASE_I.masses.sum(), rel=1e-14)
    assert np.all((masses >= 0.02 * (1 - 1e-12)) & (masses <= 0.3 * (1 + 1e-12)))
    assert np.all(found.conditions.ratios > 0.0)
    again = paper.balance_mass_centres(found.linkage)
    assert again.objective == pytest.approx(found.objective, abs=1e-12)
    rng = np.random.default_rng(2)
    for _ in range(200):
        mu = 0.05 + 0.8 * rng.dirichlet(np.ones(4))
        s = np.linspace(-1, 1, 401)[:, None]
        rho = (s + np.array([-mu[1], 0.0, mu[2], mu[2] + mu[3]])) / mu
        assert found.objective <= 0.5 * ((rho - 0.5) ** 2).sum(axis=1).min() + 1e-12
    heavier = paper.balance_masses(CASE_I, mass_bounds=([0.1] * 4, [1.0] * 4), total_mass=2.0)
    assert heavier.linkage.masses.sum() == pytest.approx(2.0)
    assert heavier.objective == pytest.approx(found.objective, abs=1e-12)


def test_derivatives_of_the_problem_are_exact():
    """Gradient, Jacobian and Hessian against central differences, all twelve variables free."""
    problem = Problem((0.3, 0.7), np.full(12, -np.inf), np.full(12, np.inf))
    rng = np.random.default_rng(8)
    x, multipliers = rng.normal(size=12), rng.normal(size=7)
    h = 1e-6
    for k in range(12):
        e = h * np.eye(12)[k]
        slope = (problem.objective(x + e) - problem.objective(x - e)) / (2 * h)
        assert problem.gradient(x)[k] == pytest.approx(slope, abs=1e-8)
        column = (problem.residual(x + e) - problem.residual(x - e)) / (2 * h)
        np.testing.assert_allclose(problem.jacobian(x)[:, k], column, atol=1e-8)
        ahead, behind = (problem.gradient(y) + problem.jacobian(y).T @ multipliers for y in (x + e, x - e))
        np.testing.assert_allclose(problem.hessian(x, multipliers)[:, k], (ahead - behind) / (2 * h), atol=1e-8)


def test_audit_tells_what_the_printed_columns_do():
    """Case I: the printed column shakes more than the unbalanced linkage; the exact optimum not at all."""
    one, two, corrected = paper.audit_table_1()
    assert [(r.case, r.reading) for r in (one, two, corrected)] == [
        ("I", "printed"),
        ("II", "printed"),
        ("II", "corrected"),
    ]
    for row in (one, two, corrected):
        assert row.conditions.worst > 0.1
        assert row.closest > 0.01, "no reading of the four rho satisfies the conditions"
        assert set(row.closest_reading) <= set(READINGS)
        assert row.optimum.shaking_force <= 1e-13
    assert np.abs(one.conditions.mass_residuals).max() == pytest.approx(0.206008, abs=1e-12)
    assert one.printed.shaking_force > one.unbalanced.shaking_force
    assert corrected.printed.shaking_force > corrected.unbalanced.shaking_force


def test_force_balance_raises_torque_and_shaking_moment_of_case_I():
    """|tau_1| from 0.0243 to 0.0366 N m, the shaking moment from 0.0859 to 0.0880 N m: not negligible."""
    row = paper.audit_table_1()[0]
    assert row.unbalanced.torque_1 == pytest.approx(0.0243, abs=5e-5)
    assert row.optimum.torque_1 == pytest.approx(0.0366, abs=5e-5)
    assert row.unbalanced.shaking_moment == pytest.approx(0.0859, abs=5e-5)
    assert row.optimum.shaking_moment == pytest.approx(0.0880, abs=5e-5)


def test_audit_takes_another_motion_and_mode():
    """Half as fast: a quarter of every load."""
    fast, slow = (paper.audit_table_1(paper.default_motion(period=T), mode=paper.AssemblyMode.RIGHT)[0] for T in (1, 2))
    assert slow.printed.shaking_force == pytest.approx(fast.printed.shaking_force / 4)
    assert slow.printed.torque_4 == pytest.approx(fast.printed.torque_4 / 4)
    assert isinstance(paper.default_motion(), Motion)


@pytest.mark.parametrize("bounds", [(0.01, 0.05), (0.2, 1.0)])
def test_masses_that_cannot_add_up_to_the_total_are_infeasible(bounds):
    """Four links of at most 50 g are never 0.4 kg, four of at least 200 g are more."""
    with pytest.raises(InfeasibleError, match=r"never to the total mass of 0\.4 kg"):
        paper.balance_masses(paper.table_1("I", "balanced"), mass_bounds=bounds, total_mass=0.4)


def stationary_points():
    """Return the problem of case I, its starts and the points that they lead to, the best one first."""
    mu = CASE_I.mass_ratios
    problem = optimum._problem((0.5, 0.5), None, (mu, mu))
    starts = balanced_points(problem, mu, each=1)
    points = sorted((climb(problem, x) for x in starts), key=lambda p: problem.objective(p.x))
    return problem, starts, points


def test_a_stationary_point_that_is_no_minimum_is_not_returned():
    """However well the conditions hold there: along a direction of negative curvature it gets better."""
    problem, starts, points = stationary_points()
    best = points[0]
    saddle = replace(best, curvature=-1e-3)
    assert optimum._best(CASE_I, problem, starts, [replace(best, curvature=-1e-12)], 1e-9).reached == 1
    with pytest.raises(SolverError, match=r"None of .* starts reached a minimum"):
        optimum._best(CASE_I, problem, starts, [saddle], 1e-9)


def test_a_minimum_that_is_worse_than_a_balanced_linkage_that_is_known_is_not_the_optimum():
    problem, starts, points = stationary_points()
    worse = max(starts, key=problem.objective)
    assert problem.objective(worse) > problem.objective(points[0].x) + 1e-6
    with pytest.raises(SolverError, match="the search missed a minimum"):
        optimum._best(CASE_I, problem, [points[0].x], [replace(points[0], x=worse)], 1e-9)
