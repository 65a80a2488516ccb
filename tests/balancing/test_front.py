"""Pareto fronts, the objective of Alici and Shirinzadeh, comparisons, and mechanisms with special lengths."""

from __future__ import annotations

import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin import paper
from fivebar_pin.balancing import Ball, alici_shirinzadeh, balance, balance_conditions, compare, pareto
from fivebar_pin.balancing.branches import branches
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.errors import InfeasibleError, InvalidInputError, UnknownNameError

REACH = Ball(0.1)


def case_I() -> tuple[fb.ClosedChain, fb.Trajectory]:
    linkage = paper.table_1("I", "unbalanced")
    motion = paper.default_motion(samples=51)
    return linkage.chain(), fb.drive(linkage.chain(), motion, near=linkage.configuration(*motion.q[0]))


@pytest.mark.parametrize(
    ("first", "second"), [("added_mass", "rms_torque"), ("mean_square_torque", "peak_shaking_moment")]
)
def test_front_is_monotone_convex_and_starts_at_the_single_optima(first: str, second: str) -> None:
    chain, path = case_I()
    front = pareto(chain, "force", first, second, 6, motions=path, region=REACH)
    x, y = front.values.T
    assert (np.diff(x) > 0).all() and (np.diff(y) < 0).all()
    slopes = np.diff(y) / np.diff(x)
    assert (np.diff(slopes) >= -1e-6 * abs(slopes[0])).all()
    for term, value in ((first, x[0]), (second, y[-1])):
        alone = balance(chain, "force", minimise=term, motions=path, region=REACH)
        assert value == pytest.approx(alone.objective, rel=1e-4)
    assert all(design.residual < 1e-14 for design in front.designs)


def test_front_refuses_what_makes_no_sense() -> None:
    chain, path = case_I()
    with pytest.raises(InvalidInputError, match="differ"):
        pareto(chain, "force", "added_mass", "added_mass")
    with pytest.raises(InvalidInputError, match="at least 2"):
        pareto(chain, "force", "added_mass", "rms_torque", 1, motions=path)
    with pytest.raises(UnknownNameError, match="rms_torque"):
        pareto(chain, "force", "mass", "rms_torque")
    with pytest.raises(InfeasibleError, match="Farkas"):
        pareto(chain, "dynamic", "added_mass", "rms_torque", motions=path, region=REACH)


def test_alici_shirinzadeh_optimum_is_the_sum_of_squares_and_beats_the_papers_design() -> None:
    """At equal masses their objective, measured by inverse dynamics, is lower than at the paper's optimum (77)."""
    _, path = case_I()
    optimum = paper.balance_mass_centres(paper.table_1("I", "balanced")).linkage.chain()
    masses = {j: (m, m) for j, m in zip(optimum.joints, optimum.inertial_parameters[:, 0], strict=True)}
    design = alici_shirinzadeh(optimum, path, mode="redesign", masses=masses, region=REACH)
    assert design.feasible
    assert design.residual < 1e-14
    assert design.gap < 1e-6 * design.objective

    def objective(chain: fb.ClosedChain) -> float:
        loads = inverse_dynamics(chain, path)
        forces = np.concatenate([loads.joint_reactions[:, :, :2], loads.closure_reactions[:, :, :2]], axis=1)
        angular = loads.reactions.bodies.momentum.sum(axis=1)[:, 5]
        parts = [forces.reshape(len(path), -1), loads.torque, loads.shaking_moment, (angular - angular.mean())[:, None]]
        return float(sum((part**2).sum(axis=1).mean() for part in parts))

    assert design.objective == pytest.approx(objective(design.chain), rel=1e-9)
    assert objective(design.chain) < objective(optimum)


def test_designs_side_by_side() -> None:
    chain, path = case_I()
    optimum = paper.balance_mass_centres(paper.table_1("I", "balanced")).linkage.chain()
    least = balance(chain, "force", material=None, region=REACH)
    table = compare({"unbalanced": chain, "paper": optimum, "least mass": least}, path)
    np.testing.assert_allclose(table.values["mass"], [0.39, 0.40, 0.66], atol=1e-6)
    assert table.values["rms_shaking_force"][0] > 0.5
    assert table.values["rms_shaking_force"][1:].max() < 1e-13
    assert table.values["peak_torque"][2] == pytest.approx(np.abs(inverse_dynamics(least.chain, path).torque).max())
    assert "least mass" in str(table) and "peak_torque" in str(table)
    with pytest.raises(InvalidInputError, match="joints of four"):
        compare({"five": chain, "four": mechanisms.four_bar()}, path)


def antiparallelogram(
    offsets: tuple[float, float, float] = (-0.03, 0.15, -0.03),
    inertias: tuple[float, float, float] = (0.0051, 0.0045, 0.0051),
) -> tuple[fb.ClosedChain, np.ndarray]:
    """l1 = l3 = 0.1, l2 = d = 0.3 m, masses 1, 0.6, 1 kg; and a crossed configuration."""
    chain = mechanisms.four_bar((0.1, 0.3, 0.1, 0.3)).with_gravity((0.0, 0.0, 0.0))
    bodies = {
        joint: pin.Inertia(m, np.array([c, 0.0, 0.0]), np.diag([0.5 * i, 0.5 * i, i]))
        for joint, m, c, i in zip(("crank", "coupler", "rocker"), (1.0, 0.6, 1.0), offsets, inertias, strict=True)
    }
    modes = fb.assembly_modes(chain, [1.0])
    crossed = next(q for q in modes if abs(np.sin(q[0] + q[1])) > 1e-3)
    return chain.with_inertias(bodies), crossed


def states(chain: fb.ClosedChain, near: np.ndarray, speed: float, acceleration: float) -> fb.Trajectory:
    """A path along the crossed branch, at every point of which the crank has this speed and acceleration."""
    x = np.linspace(0.6, 2.6, 41)
    t, v, a = np.arange(41.0), np.full((41, 1), speed), np.full((41, 1), acceleration)
    return fb.drive(chain, fb.Motion(t, x[:, None], v, a), near=fb.assemble(chain, [0.6], near=near))


def test_the_reactionless_four_bar_shakes_neither_by_force_nor_by_moment() -> None:
    """5 rad/s and -20 rad/s2: both <= 1e-12; a small change of one inertia shows."""
    chain, near = antiparallelogram()
    conditions = balance_conditions(chain, "dynamic", near=near)
    assert conditions.rank == 7  # one less than a generic four-bar
    assert np.abs(conditions.residual()).max() < 1e-12
    loads = inverse_dynamics(chain, states(chain, near, 5.0, -20.0))
    assert np.abs(loads.torque).max() > 0.1
    assert np.abs(loads.shaking_force).max() <= 1e-12
    assert np.abs(loads.shaking_moment).max() <= 1e-12
    other, _ = antiparallelogram(inertias=(0.0052, 0.0045, 0.0051))
    assert np.abs(inverse_dynamics(other, states(other, near, 5.0, -20.0)).shaking_moment).max() > 1e-4


def test_reactionless_designs_are_found_from_plain_rods() -> None:
    chain, near = antiparallelogram((0.05, 0.15, 0.05), (1.0 / 1200.0, 0.6 * 0.09 / 12.0, 1.0 / 1200.0))
    for mode in ("add", "redesign"):
        design = balance(chain, "dynamic", near=near, mode=mode)  # type: ignore[arg-type]
        assert design.feasible
        loads = inverse_dynamics(design.chain, states(chain, near, 5.0, -20.0))
        before = inverse_dynamics(chain, states(chain, near, 5.0, -20.0))
        assert np.abs(before.shaking_force).max() > 0.1
        assert np.abs(loads.shaking_force).max() <= 1e-11
        assert np.abs(loads.shaking_moment).max() <= 1e-11


def test_without_a_configuration_the_branch_that_can_be_balanced_is_found_and_named() -> None:
    """For all assembly modes together it is impossible, which stays proved; on the crossed branch it is not."""
    chain, near = antiparallelogram((0.05, 0.15, 0.05), (1.0 / 1200.0, 0.6 * 0.09 / 12.0, 1.0 / 1200.0))
    design = balance(chain, "dynamic")
    assert design.feasible and design.branch is not None and design.certificate is not None
    assert "only on the branch" in repr(design)
    assert len(design.alternatives) == 1
    loads = inverse_dynamics(design.chain, states(chain, near, 5.0, -20.0))
    assert np.abs(loads.shaking_force).max() <= 1e-11 and np.abs(loads.shaking_moment).max() <= 1e-11
    generic = balance(mechanisms.four_bar(), "dynamic")
    assert not generic.feasible and generic.alternatives == () and generic.branch is None


def test_a_design_is_for_the_branch_that_is_meant() -> None:
    """The same lengths, uncrossed by home configuration or trajectory: no design, the other branch is named."""
    home = fb.load(fb.io.shipped_path("four_bar_parallelogram"))
    plain, _ = antiparallelogram((0.05, 0.15, 0.05), (1.0 / 1200.0, 0.6 * 0.09 / 12.0, 1.0 / 1200.0))
    flat = np.array([1.0, -1.0, 1.0])
    for design in (balance(home, "dynamic"), balance(plain, "dynamic", motions=states(plain, flat, 5.0, -20.0))):
        assert not design.feasible
        assert len(design.alternatives) == 1
        assert balance(design.original, "dynamic", near=design.alternatives[0]).feasible
        assert "possible on the branch" in repr(design)


def test_a_front_of_objectives_that_agree_is_its_two_ends() -> None:
    """What is least in the one is least in the other: there is nothing to trade."""
    chain, path = case_I()
    front = pareto(chain, "force", "rms_torque", "mean_square_torque", 5, motions=path, region=REACH)
    assert len(front) == 2
    np.testing.assert_allclose(front.values[0], front.values[1], rtol=1e-5)


def test_a_mechanism_without_special_lengths_has_no_branch_with_fewer_conditions() -> None:
    chain = mechanisms.four_bar()
    assert branches(chain, balance_conditions(chain, "dynamic")) == ()
    special, _ = antiparallelogram()
    together = balance_conditions(special, "dynamic")
    found = branches(special, together)
    assert found and all(b.conditions.rank < together.rank for b in found)
