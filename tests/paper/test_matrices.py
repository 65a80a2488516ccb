"""A, B, M, u, I, C, tau; the complements side by side; the errata."""

import numpy as np
import pytest
from hypothesis import given, settings
from paper_cases import states

from fivebar_pin import paper
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.motion import Motion, combine, constant, cycloidal
from fivebar_pin.paper import matrices

ERRATA = paper.errata()


def apply(matrix, vector):
    return (matrix @ vector[..., None])[..., 0]


@settings(max_examples=80, deadline=None)
@given(states())
def test_repaired_u_is_an_orthogonal_complement(state):
    """A u = 0 and B = A^T on any linkage, both modes; t = u q', t' = u q'' + u' q'."""
    linkage, mode, q, v, a, _ = state
    s = paper.solve_states(linkage, q, v, a, mode=mode)
    size, turn = linkage.lengths.max(), 1.0 + np.abs(s.partials).max()
    A, u = matrices.A(s), matrices.u(s)
    assert A.shape == (1, 10, 12)
    assert np.abs(A @ u).max() <= 1e-13 * size * turn * 5
    np.testing.assert_array_equal(matrices.B(s), np.swapaxes(A, 1, 2))
    np.testing.assert_allclose(apply(u, v), matrices.twist(s), atol=1e-12 * np.abs(s.rates).max() * max(1, size))


@settings(max_examples=80, deadline=None)
@given(states())
def test_equations_of_motion_hold(state):
    """I q'' = C q' + tau, (46), and M t' = w + B f, (26), with the torques and forces of the closed form."""
    linkage, mode, q, v, a, _ = state
    s = paper.solve_states(linkage, q, v, a, mode=mode)
    inertia, C = apply(matrices.inertia(s), a), apply(matrices.C(s), v)
    scale = np.abs(inertia).max() + np.abs(C).max() + np.abs(s.joint_forces).max() * linkage.lengths.max()
    np.testing.assert_allclose(inertia - C, s.torque, rtol=0, atol=1e-11 * scale)
    np.testing.assert_allclose(matrices.tau(s), s.torque, rtol=0, atol=1e-11 * scale)
    w = np.zeros((1, 12))
    w[:, [0, 9]] = s.torque
    right = w + apply(matrices.B(s), s.joint_forces.reshape(1, 10))
    left = matrices.twist_rate(s) @ matrices.M(linkage)
    load = np.abs(s.joint_forces).max() * max(1.0, linkage.lengths.max())
    np.testing.assert_allclose(left, right, rtol=0, atol=1e-11 * load)


@settings(max_examples=60, deadline=None)
@given(states())
def test_u_dot_is_the_derivative_of_u(state):
    """Central difference along the motion, repaired and printed form."""
    linkage, mode, q, v, a, _ = state
    s = paper.solve_states(linkage, q, v, a, mode=mode)
    h = 1e-4 / (np.abs(s.rates).max() + np.sqrt(np.abs(s.accelerations).max()) + np.abs(v[0, 1] / v[0, 0]))
    ends = [paper.solve_states(linkage, q + e * v + e * e / 2 * a, v + e * a, a, mode=mode) for e in (h, -h)]
    for form in ("repaired", "printed"):
        ahead, behind = (matrices.u(x, form=form) for x in ends)
        tolerance = 1e-5 * np.abs(matrices.u(s, form=form)).max() / h
        np.testing.assert_allclose(matrices.u_dot(s, form=form), (ahead - behind) / (2 * h), rtol=0, atol=tolerance)


@settings(max_examples=60, deadline=None)
@given(states())
def test_repaired_ratios_and_their_rates_are_those_of_the_loop(state):
    """r = x'/psi' and r' = (x'' - r psi'')/psi' for theta and phi, (17), (20), (A9), (A13)."""
    linkage, mode, q, v, a, _ = state
    s = paper.solve_states(linkage, q, v, a, mode=mode)
    r, rate = paper.ratios(s), paper.ratio_rates(s)
    turn = 1.0 + np.abs(s.partials).max()
    size = (turn * (1.0 + np.abs(v / v[0, 0]).max())) ** 2
    speed = (np.abs(s.accelerations).max() + np.abs(s.rates).max() ** 2) / abs(v[0, 0])
    for value, slope, k in ((r.theta, rate.theta, 1), (r.phi, rate.phi, 2)):
        exact = s.rates[0, k] / s.rates[0, 0]
        assert value[0] == pytest.approx(exact, abs=1e-11 * size)
        exact = (s.accelerations[0, k] - exact * s.accelerations[0, 0]) / s.rates[0, 0]
        assert slope[0] == pytest.approx(exact, abs=1e-11 * size * speed)


@pytest.mark.parametrize("case", ["I", "II"])
@pytest.mark.parametrize("mode", paper.AssemblyMode)
def test_printed_u_agrees_in_the_twist_and_fails_in_the_columns(case, mode):
    """u q' = t for both; only the repaired u equals T N of Pinocchio, column by column, and its inertia matrix."""
    c = paper.compare_complements(paper.table_1(case, "unbalanced"), mode=mode)
    assert (c.samples, c.skipped) == (199, 2)
    assert c.twist_printed <= 1e-13
    assert c.twist <= 1e-14
    assert c.J_N <= 1e-15
    assert c.A_u <= 1e-15
    assert c.u_N <= 1e-12 * c.columns.max()
    assert c.inertia <= 1e-12
    assert c.torque <= 1e-12
    assert c.A_u_printed > 0.1
    assert c.inertia_printed > 10.0
    assert c.torque_printed > 0.5
    wrong = c.columns > 1e-9
    assert np.all(wrong[3:9]), "links 2 and 3 are wrong in both columns"
    assert not np.any(wrong[[0, 1, 2, 9, 10, 11]]), "links 1 and 4 are right"
    assert "printed" in str(c)
    assert len(c.rows()) == 6


def test_printed_u_fails_by_the_known_amount():
    """|A u| = 0.06 at psi = 0.7, gamma = 2, gamma'/psi' = 1.6."""
    s = paper.solve_states(paper.table_1("I", "unbalanced"), [[0.7, 2.0]], [[1.0, 1.6]], [[0.0, 0.0]])
    assert np.abs(matrices.A(s) @ matrices.u(s, form="printed")).max() == pytest.approx(0.06, abs=0.005)
    assert np.abs(matrices.A(s) @ matrices.u(s)).max() <= 1e-16


def test_comparison_on_a_linkage_with_offset_mass_centres():
    """Nonzero alpha and rho outside the links."""
    case = paper.table_1("II", "unbalanced")
    linkage = paper.FiveBar(case.lengths, case.masses, case.inertias, (-0.4, 1.6, 0.3, -0.7), (0.3, -0.5, 0.8, 2.2))
    c = paper.compare_complements(linkage, mode=paper.AssemblyMode.RIGHT)
    assert max(c.inertia, c.torque, c.u_N / c.columns.max()) <= 1e-12


def test_comparison_needs_a_moving_crank():
    """The printed u does not exist where psi' = 0, and a motion that never moves psi has nothing to compare."""
    t = np.linspace(0.0, 1.0, 5)
    still = combine(constant(t, 0.3), cycloidal(t, 1.0, 1.5))
    with pytest.raises(InvalidInputError, match=r"psi' = 0\.0 but must differ from zero"):
        paper.compare_complements(paper.table_1("I", "unbalanced"), still)


def test_printed_forms_refuse_a_crank_at_rest():
    """Printed u and the ratios divide by psi'; the repaired u does not."""
    s = paper.solve(paper.table_1("I", "unbalanced"), paper.default_motion(samples=5))
    for call in (paper.ratios, paper.ratio_rates, lambda x: matrices.u(x, form="printed")):
        with pytest.raises(InvalidInputError, match=r"psi' at sample 0 = 0.0 but the velocity ratios divide by it"):
            call(s)
    assert np.abs(matrices.A(s) @ matrices.u(s)).max() <= 1e-15
    assert np.all(np.isfinite(matrices.u_dot(s)))


@pytest.mark.parametrize("function", [matrices.A, matrices.u, matrices.u_dot, matrices.tau, paper.ratios])
def test_unknown_forms_list_the_known_ones(function):
    """repaired or printed."""
    m = paper.default_motion(samples=5)
    s = paper.solve(paper.table_1("I", "unbalanced"), Motion(m.t[1:4], m.q[1:4], m.v[1:4], m.a[1:4]))
    with pytest.raises(UnknownNameError, match="Unknown form 'fixed'; known: repaired, printed"):
        function(s, form="fixed")


@pytest.mark.parametrize("erratum", ERRATA, ids=[f"{e.equation} {k}" for k, e in enumerate(ERRATA)])
def test_printed_form_fails_and_repaired_form_passes(erratum):
    """Every erratum: the printed form is off by far more than the repaired form may be."""
    assert erratum.printed_error > 1e-2
    assert erratum.printed_error > 10.0 * erratum.tolerance
    assert erratum.repaired_error <= erratum.tolerance


def test_errata_cover_what_is_known():
    """The equations that do not hold as printed."""
    known = {
        "(7)",
        "(18a)",
        "(18c)",
        "(A10b)",
        "(A10c)",
        "(34)",
        "(36)",
        "(41)",
        "(46)",
        "(72)",
        "(52)",
        "(75)",
        "(80)",
    }
    assert known <= {e.equation for e in ERRATA}


def test_equations_that_hold_are_left_alone():
    """(18b) and (A10a) are the same in both forms."""
    from fivebar_pin.paper.velocity_ratios import phi_loop, theta_loop

    linkage, x = paper.table_1("II", "unbalanced"), (np.array([0.3]), np.array([1.1]), np.array([2.3]))
    assert phi_loop(linkage, *x, form="printed").gamma == phi_loop(linkage, *x).gamma
    assert theta_loop(linkage, *x, form="printed").psi == theta_loop(linkage, *x).psi
