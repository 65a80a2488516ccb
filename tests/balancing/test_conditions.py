"""Balancing conditions: known ranks, the paper's equations, independence of units, and what they promise in motion."""

from __future__ import annotations

import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin import paper
from fivebar_pin.balancing import conditions
from fivebar_pin.balancing.conditions import balance_conditions
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.errors import SolverError
from fivebar_pin.paper import table_1


def paper_equations(lengths: np.ndarray) -> np.ndarray:
    """(60)-(63), (68), (69) on the chain's parameters (m, mcx, mcy, I) of gamma, phi_gamma, psi, theta_psi.

    With the first moments about the tree's joints they read mc1/a1 + m2 = mc2/a2 = -mc3/a3 = -mc4/a4 - m3.
    """
    a1, a2, a3, a4, _ = lengths
    link = {4: 0, 3: 4, 1: 8, 2: 12}
    rows = []
    for part in (1, 2):  # real and imaginary part
        sides = np.zeros((4, 16))
        sides[0, link[1] + part], sides[1, link[2] + part] = 1.0 / a1, 1.0 / a2
        sides[2, link[3] + part], sides[3, link[4] + part] = -1.0 / a3, -1.0 / a4
        if part == 1:
            sides[0, link[2]], sides[3, link[3]] = 1.0, -1.0
        rows += [sides[k] - sides[1] for k in (0, 2, 3)]
    return np.array(rows)


@pytest.mark.parametrize("case", ["I", "II"])
def test_five_bar_force_conditions_span_the_papers_six_equations(case: str) -> None:
    linkage = table_1(case, "unbalanced")
    found = balance_conditions(linkage.chain(), "force")
    assert found.rank == 6
    assert found.freedom == 10
    assert np.max(found.angles(paper_equations(linkage.lengths))) <= 1e-9


@pytest.mark.parametrize(
    ("chain", "force", "dynamic"),
    [
        (table_1("I", "unbalanced").chain(), 6, 11),
        (mechanisms.five_bar(base=mechanisms.TILTED), 6, 11),
        (mechanisms.four_bar(), 4, 8),
        (mechanisms.four_bar(base=mechanisms.TILTED), 4, 8),
        (mechanisms.welded_four_bar(), 4, 8),
        (mechanisms.parallelogram(), 4, 8),
    ],
    ids=["paper", "five-bar tilted", "four-bar", "four-bar tilted", "welded", "parallelogram, all modes"],
)
def test_known_planar_ranks(chain: fb.ClosedChain, force: int, dynamic: int) -> None:
    for kind, rank in (("force", force), ("dynamic", dynamic), ("static", force)):
        found = balance_conditions(chain, kind)
        assert found.space.planar
        assert found.rank == rank
        assert found.gap > 1e6
        np.testing.assert_allclose(found.basis @ found.basis.T, np.eye(rank), atol=1e-12)


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
def test_ranks_do_not_depend_on_the_unit_of_length(size: float) -> None:
    for base in (mechanisms.AT_ORIGIN, mechanisms.TILTED):
        base = base.copy()
        base.translation *= size
        chain = mechanisms.four_bar(np.array([0.4, 1.1, 0.9, 1.0]) * size, base=base)
        assert [balance_conditions(chain, k).rank for k in ("force", "dynamic")] == [4, 8]


def test_ranks_do_not_depend_on_the_masses() -> None:
    chain = mechanisms.four_bar()
    heavy = chain.with_inertial_parameters(chain.inertial_parameters * np.array([1e6, 1.0, 1e-6])[:, None])
    np.testing.assert_allclose(
        balance_conditions(heavy, "dynamic").basis, balance_conditions(chain, "dynamic").basis, atol=1e-12
    )


def test_ranks_do_not_depend_on_how_far_the_motors_may_turn() -> None:
    """Limits of a tenth of a radian leave little room for samples, yet the conditions are the same."""
    chain = mechanisms.five_bar()
    q = fb.assembly_modes(chain, [1.5, 0.5])[0]
    model = chain.model.copy()
    model.lowerPositionLimit, model.upperPositionLimit = q - 0.05, q + 0.05
    narrow = fb.ClosedChain(model, chain.closures, chain.actuated)
    assert [balance_conditions(narrow, kind).rank for kind in ("force", "dynamic")] == [6, 11]


def test_too_many_motors_are_suspected_when_nothing_closes() -> None:
    locked = mechanisms.five_bar().with_actuated(("left", "right", "left_elbow"))
    with pytest.raises(fb.errors.AssemblyError, match="too many joints are actuated"):
        balance_conditions(locked, "force")


def test_reduced_form_reads_as_the_textbook_equations() -> None:
    """Berkof and Lowen's conditions of the four-bar 0.4, 1.1, 0.9: coefficients are ratios of lengths."""
    equations = balance_conditions(mechanisms.four_bar(), "force").equations
    assert "mcx(coupler) - 2.75 mcx(crank) - 1.1 m(coupler) = 0" in equations
    assert "mcy(rocker) + 2.25 mcy(crank) = 0" in equations
    found = balance_conditions(mechanisms.four_bar(), "force")
    assert np.max(found.angles(found.reduced)) < 1e-9


def test_a_reducible_mechanism_has_fewer_conditions_on_one_branch() -> None:
    """The parallelogram's coupler only translates: on that branch 3 of the 8 dynamic conditions fall away."""
    chain = mechanisms.parallelogram()
    near = np.array([1.0, -1.0, 1.0])
    branch = balance_conditions(chain, "dynamic", near=near)
    everywhere = balance_conditions(chain, "dynamic")
    assert branch.rank < everywhere.rank
    np.testing.assert_allclose(everywhere.basis.T @ (everywhere.basis @ branch.basis.T), branch.basis.T, atol=1e-9)


def test_spatial_force_conditions_hold_momentum_still_for_parameters_that_meet_them() -> None:
    """Projecting any parameters onto the conditions makes the shaking force and moment vanish (a free witness)."""
    chain = mechanisms.rssr()
    found = balance_conditions(chain, "dynamic")
    assert not found.space.planar
    x = chain.inertial_parameters.reshape(-1) / found.space.scale
    pi = ((x - found.basis.T @ (found.basis @ x)) * found.space.scale).reshape(-1, 10)
    t = np.linspace(0.0, 1.0, 21)
    motion = fb.motion.harmonic(t, 0.0, 0.3, period=1.0)
    trajectory = fb.drive(chain.with_gravity((0.0, 0.0, 0.0)), motion, near=[0.3, 0.2, 0.4, 0.5])
    force = fb.balancing.regressors.regressor(chain.with_gravity((0.0, 0.0, 0.0)), trajectory, "shaking_force")
    moment = fb.balancing.regressors.regressor(chain.with_gravity((0.0, 0.0, 0.0)), trajectory, "shaking_moment")
    for part in (force, moment):
        before = np.abs(part(chain.inertial_parameters)).max()
        assert before > 0.1
        assert np.abs(part(pi)).max() < 1e-11 * before
    assert np.abs(found.residual(pi)).max() < 1e-14
    assert np.abs(found.residual()).max() > 1e-2


def test_static_conditions_under_one_gravity_direction_remove_the_gravity_torque() -> None:
    linkage = table_1("I", "unbalanced")
    chain = linkage.chain(gravity=(0.0, -9.81, 0.0))
    one = balance_conditions(chain, "static", gravity="model")
    assert 0 < one.rank <= balance_conditions(chain, "static").rank
    x = (one.space.of(chain.inertial_parameters)).reshape(-1) / one.space.scale
    x = ((x - one.basis.T @ (one.basis @ x)) * one.space.scale).reshape(-1, 4)
    pi = chain.inertial_parameters.copy()
    pi[:, [0, 1, 2, 9]] = x
    motion = paper.default_motion(samples=21)
    trajectory = fb.drive(chain, motion, near=linkage.configuration(*motion.q[0]))
    Y = fb.balancing.regressors.regressor(chain, trajectory, "gravity_torque")
    assert np.abs(inverse_dynamics(chain, trajectory).torque).max() > 1e-3
    assert np.abs(Y(pi)).max() < 1e-14


def test_bad_requests_are_refused_with_what_is_known() -> None:
    chain = mechanisms.four_bar()
    with pytest.raises(fb.errors.UnknownNameError, match="force, moment, dynamic, static"):
        balance_conditions(chain, "forces")
    with pytest.raises(fb.errors.UnknownNameError, match="planar"):
        balance_conditions(chain, "force", space="flat")  # type: ignore[arg-type]
    with pytest.raises(fb.errors.InvalidInputError, match="parallel planes"):
        balance_conditions(mechanisms.rssr(), "force", space="planar")
    with pytest.raises(fb.errors.AssemblyError, match="not closed"):
        balance_conditions(chain, "force", near=[0.0, 0.0, 0.0])
    with pytest.raises(fb.errors.AssemblyError, match="random configurations"):
        balance_conditions(mechanisms.four_bar((0.1, 0.1, 0.1, 5.0)), "force")
    with pytest.raises(fb.errors.InvalidInputError, match="must not be zero"):
        balance_conditions(chain, "static", gravity=(0.0, 0.0, 0.0))
    with pytest.raises(fb.errors.InvalidInputError, match="samples"):
        balance_conditions(chain, "force", samples=3)


@pytest.mark.parametrize(
    ("spectrum", "rank"),
    [
        ((1.0, 1e-1, 1e-5, 1e-8, 1e-12, 1e-15), 4),  # the widest gap
        ((1.0, 1e-5, 1e-9, 1e-12, 1e-15), 2),  # a gap above a millionth is none, however wide
        ((1.0, 2e-3, 4e-6, 8e-9, 1.6e-11, 3.2e-14, 6.4e-17), None),  # 500 to one everywhere: no decision
        ((1.0, 5e-4, 2e-7, 1e-10, 5e-14, 2.5e-17), 2),  # 2500 to one once
    ],
)
def test_a_rank_is_where_the_spectrum_has_a_clear_gap(
    spectrum: tuple[float, ...], rank: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What counts as a condition is decided by a gap of a thousand that begins below a millionth, or not at all."""
    rows = np.zeros((20, 12))
    rows[range(len(spectrum)), range(len(spectrum))] = spectrum
    monkeypatch.setattr(conditions, "_rows", lambda *_: rows)
    if rank is None:
        with pytest.raises(SolverError, match=r"show no clear gap \(best ratio 500 after"):
            balance_conditions(mechanisms.four_bar(), "force")
    else:
        assert balance_conditions(mechanisms.four_bar(), "force").rank == rank


def test_ratios_that_are_no_simple_fractions_keep_all_their_digits() -> None:
    """The factor of the crank's first moment is b / a, also where a fraction lies close to it."""
    a, b = 0.4, 1.1 + 1e-6
    found = balance_conditions(mechanisms.four_bar((a, b, 0.9, 1.0)), "force")
    names = list(found.space.names)
    row = next(row for row in found.reduced if row[names.index("mcx(coupler)")] == 1.0)
    assert row[names.index("mcx(crank)")] == pytest.approx(-b / a, rel=1e-9)
    assert row[names.index("mcx(crank)")] != -2.75


def test_moment_conditions_hold_angular_momentum_about_their_own_point() -> None:
    """About any other point it changes by the lever times the momentum, which these conditions leave."""
    chain, about = mechanisms.slider_crank(), np.array([0.3, -0.5, 0.0])
    found, from_origin = (balance_conditions(chain, "moment", about=point) for point in (about, np.zeros(3)))
    moved = fb.drive(chain, fb.motion.harmonic(np.linspace(0.0, 1.0, 21), 0.9, 0.4, period=1.0))
    momentum = fb.balancing.regressors.regressor(chain, moved, "angular_momentum", about=about)
    sizes = []
    for those in (found, from_origin):
        x = those.space.of(chain.inertial_parameters).reshape(-1) / those.space.scale
        x = ((x - those.basis.T @ (those.basis @ x)) * those.space.scale).reshape(-1, 4)
        pi = np.zeros((3, 10))
        pi[:, [0, 1, 2, 9]] = x
        sizes.append(np.abs(momentum(pi)[:, 2]).max())
    assert sizes[0] < 1e-12
    assert sizes[1] > 1e-2


def test_a_slide_out_of_the_plane_makes_the_conditions_spatial() -> None:
    model = pin.Model()
    arm = mechanisms.add(model, 0, pin.JointModelRZ(), mechanisms.at(), "arm", mechanisms.body(1))
    mechanisms.add(model, arm, pin.JointModelPZ(), mechanisms.at(0.5), "lift", mechanisms.body(2))
    chain = fb.ClosedChain(model, (), ("arm", "lift"))
    found = balance_conditions(chain, "force")
    assert not found.space.planar
    assert "m(lift) = 0" in found.equations  # nothing else can hold the mass centre at its height
    flat = balance_conditions(chain.with_actuated(("arm", "lift")), "force", space="spatial")
    assert flat.rank == found.rank
    with pytest.raises(fb.errors.InvalidInputError, match="parallel planes"):
        balance_conditions(chain, "force", space="planar")


@pytest.mark.parametrize("off", [1e-2, 1e-4])
def test_a_branch_begins_at_a_configuration_that_is_closed(off: float) -> None:
    chain = mechanisms.four_bar()
    near = fb.assemble(chain, [0.8])
    with pytest.raises(fb.errors.AssemblyError, match="near is not closed: closure pin stays open by"):
        balance_conditions(chain, "force", near=near + off * np.array([0.0, 1.0, 0.0]))
    assert balance_conditions(chain, "force", near=near + 1e-9).rank == 4
