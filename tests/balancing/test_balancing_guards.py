"""Bounds that decide what counts, in balancing, each on both of its sides."""

from __future__ import annotations

from dataclasses import replace

import balance_problems
import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin import JointSpring, Spring
from fivebar_pin.balancing import Ball, Box, Design, Disc, balance, balance_conditions, balance_problem
from fivebar_pin.balancing import solve as solving
from fivebar_pin.balancing.balanced import _on_one_branch
from fivebar_pin.balancing.branches import Branch, _alike
from fivebar_pin.balancing.facial_reduction import empty
from fivebar_pin.balancing.objectives.scale import typical
from fivebar_pin.balancing.regressors.measures import measure
from fivebar_pin.balancing.regressors.rows import Rows
from fivebar_pin.balancing.solvers import Block, Program
from fivebar_pin.balancing.solvers.certificate import certificate_of
from fivebar_pin.balancing.static import held_by_masses, same_springs
from fivebar_pin.balancing.variables.asked import material
from fivebar_pin.balancing.variables.material import Bounds
from fivebar_pin.balancing.variables.part import Placed
from fivebar_pin.balancing.walk import ground
from fivebar_pin.errors import InvalidInputError, SolverError, UnknownNameError
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import loops_of


@pytest.mark.parametrize(("crank", "sound"), [(1e-2, True), (1e-4, False), (-1e-4, False)])
def test_a_walk_does_not_stand_where_two_branches_are_too_near_to_be_told_apart(crank, sound):
    """A parallelogram near where it lies flat is closed, whatever the branch; only its singular value warns."""
    loops = loops_of(mechanisms.parallelogram())
    here = Configurations(loops, np.array([[crank, -crank, crank]]))
    assert here.gap[0] < 1e-15
    assert ground(here).sound[0] == sound


@pytest.mark.parametrize(("coefficient", "gone"), [(1e-5, False), (1e-11, True)])
def test_a_condition_that_any_other_variable_is_in_leaves_no_body_empty(coefficient, gone):
    """m(a) + m(b) + c h(a) = 0 holds no mass at zero unless c is round-off."""
    parts = [Placed(material(b, 1, f"{b}", Bounds(), planar=True), 4 * b) for b in range(2)]
    row = np.zeros((1, 8))
    row[0, [0, 4, 1]] = 1.0, 1.0, coefficient
    blocks = [Block("equal", "zero", row, np.zeros(1)), *(p.widened(b, 8) for p in parts for b in p.part.cones)]
    assert empty(blocks, parts, 8) == (gone, gone)


def program(*rows: tuple[float, float]) -> Program:
    """Return what asks for G x + g >= 0 of one variable without bounds, row by row."""
    G, g = np.array(rows).T
    return Program(1, [Block("rows", "nonneg", G[:, None], g)], np.full(1, np.inf))


@pytest.mark.parametrize(("slope", "proof"), [(1e-10, True), (1e-6, False)])
def test_without_bounds_on_the_variables_a_ray_has_to_vanish_to_round_off(slope, proof):
    """slope x >= 1 and x >= -5 hold for x = 1 / slope: a proof against them is one where slope is round-off alone."""
    given, ray = program((slope, -1.0), (1.0, 5.0)), np.array([1.0, 0.0])
    if proof:
        assert certificate_of(given, ray, given.g).stationarity == pytest.approx(slope)
    else:
        with pytest.raises(SolverError, match="leaves room for solutions"):
            certificate_of(given, ray, given.g)


def test_a_ray_of_which_nothing_is_left_proves_nothing():
    """x >= 1 by itself has solutions; moved to where it would have none, the ray is zero."""
    given = program((1.0, -1.0))
    with pytest.raises(SolverError, match="infeasibility"):
        certificate_of(given, np.ones(1), given.g)


@pytest.mark.parametrize(("turn", "alike"), [(1e-3, True), (0.1, False)])
def test_branches_are_two_where_a_condition_lies_outside_the_others(turn, alike):
    found = balance_conditions(mechanisms.four_bar(), "force")
    basis = np.array(found.basis)
    across = np.linalg.svd(basis)[2][found.rank]
    basis[0] = np.cos(turn) * basis[0] + np.sin(turn) * across
    assert _alike(found, replace(found, basis=basis)) is alike


def test_of_several_branches_that_are_meant_the_design_is_the_best_one():
    chain, _ = balance_problems.moved("five_bar_case_I")
    design = balance(chain, "force", region=Ball(0.1), material=None)
    conditions = design.conditions
    places = [np.full(chain.nq, float(k)) for k in range(4)]
    found = [Branch(q, conditions, k != 1) for k, q in enumerate(places)]

    def solved(conditions, near):
        return replace(design, objective=(3.0, 0.5, 1.0, 2.0)[int(near[0])], branch=near)

    chosen = _on_one_branch(replace(design, status="infeasible"), found, solved, any_branch=False)
    assert chosen.objective == 1.0 and len(chosen.alternatives) == 4
    assert _on_one_branch(SolverError("none"), found, solved, any_branch=True).objective == 0.5


def test_of_two_solvers_the_better_design_and_the_better_bound_are_kept(monkeypatch):
    problem = balance_problem(balance_problems.moved("five_bar_case_I")[0], "force", region=Ball(0.1), material=None)
    design, answers = problem.solve("added_mass"), iter([(2.0, 0.5), (1.0, 0.25), (1.0, 0.25), (2.0, 0.5)])

    def inside(task: solving._Task) -> Design:
        objective, bound = next(answers)
        return replace(design, objective=objective, dual_bound=bound)

    monkeypatch.setattr(solving, "_inside", inside)
    for _ in range(2):  # whichever comes first
        found = problem.solve("added_mass")
        assert (found.objective, found.dual_bound, found.status) == (1.0, 0.5, "feasible")


@pytest.mark.parametrize(("share", "held"), [(1e-12, True), (1e-6, False)])
def test_what_no_masses_hold_is_told_from_round_off_by_its_share_of_what_the_springs_do(share, held):
    parts = 50.0
    column = np.array([2.0, 0.0, share * parts])
    inside, outside = held_by_masses(np.eye(3), np.array([4.0]), 1, column, parts)
    np.testing.assert_array_equal(inside, [0.5])
    assert outside == (0.0 if held else pytest.approx(share * parts))


def sprung(*springs: Spring | JointSpring) -> fb.ClosedChain:
    """Return a crank-rocker with a point at the same place on each of its links, and one that is a bit off."""
    chain = mechanisms.four_bar()
    model = chain.model.copy()
    mechanisms.point(model, 0, "base", mechanisms.at(0.1, 0.7))
    for k, joint in enumerate(chain.joints, 1):
        mechanisms.point(model, k, f"on_{joint}", mechanisms.at(0.1))
    mechanisms.point(model, 1, "beside", mechanisms.at(0.1 + 1e-6))
    return fb.ClosedChain(model, chain.closures, chain.actuated, springs=springs)


def test_springs_are_the_same_between_the_same_points_of_the_same_bodies():
    given = sprung(Spring("base", "on_crank", 30.0, 0.1, 2.0))
    assert same_springs(given, sprung(Spring("base", "on_crank", 30.0, 0.1)))
    for other in ("on_coupler", "beside"):
        assert not same_springs(given, sprung(Spring("base", other, 30.0, 0.1)))
    assert not same_springs(given, sprung(Spring("base", "on_crank", 31.0, 0.1)))
    hinge = sprung(JointSpring("crank", 3.0, 0.4, 0.6))
    assert same_springs(hinge, sprung(JointSpring("crank", 3.0, 0.4)))
    assert not same_springs(hinge, sprung(JointSpring("crank", 3.0, 0.5, 0.6)))


def test_bearings_that_only_springs_load_are_counted():
    """At rest without weight no mass does anything: what the hinge carries is the spring's pull."""
    model = pin.Model()
    joint = mechanisms.add(model, 0, pin.JointModelRZ(), mechanisms.at(), "hinge", mechanisms.body())
    mechanisms.point(model, joint, "end", mechanisms.at(0.5))
    mechanisms.point(model, 0, "base", mechanisms.at(0.5, 0.4))
    chain = fb.ClosedChain(model, (), ("hinge",), springs=(Spring("base", "end", 30.0, 0.1),))
    chain = chain.with_gravity(np.zeros(3))
    still = fb.Motion(np.array([0.0, 1.0]), np.zeros((2, 1)), np.zeros((2, 1)), np.zeros((2, 1)))
    rows = measure(chain, [fb.drive(chain, still)], "bearing_force", about=np.zeros(3))
    assert rows.peak(chain.inertial_parameters) == pytest.approx(30.0 * 0.3)


def test_a_trajectory_of_another_mechanism_measures_nothing():
    _, path = balance_problems.moved("five_bar_case_I")
    chain = mechanisms.four_bar()
    with pytest.raises(InvalidInputError, match="must belong to this chain"):
        measure(chain, [path], "shaking_force", about=np.zeros(3))


@pytest.mark.parametrize(("value", "size"), [(1e-2, 1e-2), (1e-4, 4.0), (0.0, 4.0)])
def test_a_term_is_measured_by_what_adds_up_to_it_where_it_is_next_to_nothing(value, size):
    rows = Rows("torque", np.array([[[2.0, -1.0]]]), np.zeros((1, 1)), (slice(0, 1),), ("motor",))
    assert typical(rows, value, np.array([2.0, 3.0])) == size


def test_a_point_sticks_out_of_a_box_by_the_face_that_it_is_farthest_beyond():
    shape = Box((0.2, 0.4, 0.6)).shape("body", np.zeros(3), np.eye(3), plane=None, unit=1.0)
    for point, out in (((0.15, 0.0, 0.0), 0.05), ((0.15, 0.3, 0.0), 0.1), ((0.0, 0.0, 0.35), 0.05), ((0.0,) * 3, 0.0)):
        assert shape.overhang(np.array([point]), 1.0) == pytest.approx(out, abs=1e-15)


def test_a_counterweight_for_a_body_that_does_not_exist_is_refused_by_name():
    chain, _ = balance_problems.moved("five_bar_case_I")
    with pytest.raises(UnknownNameError, match="body of a counterweight 'nose'"):
        balance(chain, "force", region=Ball(0.1), counterweight={"nose": Disc(7850.0, 0.01)})
