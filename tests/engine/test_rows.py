"""The rows of the engine are those of the closures: residual, Jacobian and drift, and laws that know neither."""

from __future__ import annotations

import calls
import numpy as np
import pinocchio as pin
import pytest
from equations import Equations
from mechanisms import bennett, double_four_bar, five_bar, point, rscr, rssr, slider_crank, spherical_four_bar
from mechanisms import welded_four_bar as welded
from random_chains import random_chain, random_placement
from sampled import Sampled
from test_links import FAR, JOINTS, close_to, everywhere, states, tree_with
from tied_chains import EXAMPLES

import fivebar_pin as fb
from fivebar_pin.closures import Coupling, Cylindrical, Distance
from fivebar_pin.engine import tables as e
from fivebar_pin.mechanism.loops import loops_of

CLOSED = {
    "five-bar": five_bar,
    "five-bar far away": lambda: five_bar(base=FAR),
    "slider-crank": slider_crank,
    "double four-bar": double_four_bar,
    "welded four-bar": welded,
    "RSSR": rssr,
    "RSSR with a ball": lambda: rssr(ball=True),
    "RSCR": lambda: rscr()[0],
    "Bennett": lambda: bennett()[0],
    "spherical four-bar": lambda: spherical_four_bar((0.5, 1.0, 0.9, 1.2)),
    "every kind": lambda: random_chain(3),
    **{name: (lambda make=make: make()[0]) for name, make in EXAMPLES.items()},
}


def closed_everyhow(joint: object, base: pin.SE3) -> fb.ClosedChain:
    """Return a tree with a closure of every kind, between frames placed at random on its bodies and the ground."""
    model, rng = tree_with(joint, base).model.copy(), np.random.default_rng(4)
    joints = {name: j for j, name in enumerate(model.names)}
    ends = [("tip", "slide"), ("universe", "branch"), ("second root", "hinge"), ("root", "tip"), ("tip", "second root")]
    axis = rng.normal(size=3)
    frames = [
        tuple(point(model, joints[name], f"end {k} {name}", random_placement(rng)) for name in pair)
        for k, pair in enumerate(ends)
    ]
    closures = (
        fb.Closure(frames[0], "3d"),
        fb.Closure(frames[1], "6d"),
        fb.Closure(frames[2], "revolute", axis=axis),
        Cylindrical(frames[3], axis=axis),
        Distance(frames[4], 0.7),
        Coupling({"hinge": 1.3, "slide": -0.4}, 0.2),
    )
    return fb.ClosedChain(model, closures, ())


def looked(s: Sampled, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return residual, Jacobian and drift of all rows."""
    s.set(q, v, np.zeros(len(v)))
    calls.closures(s.I, s.W)
    return s.per_row(e.RESIDUAL), s.J, s.per_row(e.LEAD)


@pytest.mark.parametrize("joint", JOINTS.values(), ids=JOINTS.keys())
@everywhere
def test_rows_of_every_closure_through_every_joint_equal_those_of_pinocchio(joint, base):
    """One by one; where joints slide only, two of the turned rows say all that three do."""
    chain = closed_everyhow(joint, base)
    s = Sampled(chain)
    for q, v, _ in states(chain.model, 3):
        found, expected = looked(s, q, v), Equations(chain, q, v)
        if len(s.rows) == len(expected.residual):
            close_to(found[0], expected.residual)
            close_to(found[1], expected.J)
            close_to(found[2], expected.drift)
        else:
            say_the_same(found, expected)


@pytest.mark.parametrize("make", CLOSED.values(), ids=CLOSED.keys())
def test_what_rows_say_together_is_what_all_rows_say(make):
    """The gradient J^T c, J^T J and J^T J': the same however rows are combined, open or closed."""
    chain = make()
    s = Sampled(chain)
    for q, v, _ in states(chain.model, 5):
        say_the_same(looked(s, q, v), Equations(chain, q, v))


def say_the_same(found: tuple[np.ndarray, np.ndarray, np.ndarray], expected: Equations) -> None:
    residual, J, drift = found
    close_to(J.T @ J, expected.J.T @ expected.J)
    close_to(J.T @ residual, expected.J.T @ expected.residual)
    close_to(J.T @ drift, expected.J.T @ expected.drift)


@pytest.mark.parametrize("joint", ["RZ", "helical", "spherical ZYX", "free flyer", "planar", "nested composite"])
def test_jacobian_and_drift_are_the_first_and_second_rates_of_residuals(joint):
    """Along q(t) = q + t v with constant v, by differences; turned rows have their drift where they are closed only."""
    chain = closed_everyhow(JOINTS[joint], FAR)
    s, h = Sampled(chain), 1e-3
    straight = [k for k, r in enumerate(s.rows) if s.of(r, e.SORT) != e.TURNED]
    for q, v, _ in states(chain.model, 2):
        _, J, drift = looked(s, q, v)
        at = [looked(s, pin.integrate(chain.model, q, k * h * v), v)[0] for k in range(-2, 3)]
        rate = (at[0] - 8.0 * at[1] + 8.0 * at[3] - at[4]) / (12.0 * h)
        second = (-at[0] + 16.0 * at[1] - 30.0 * at[2] + 16.0 * at[3] - at[4]) / (12.0 * h * h)
        close_to(J @ v, rate, 1e-9)
        close_to(drift[straight], second[straight], 1e-7)


def turning_ball() -> fb.ClosedChain:
    """Return a ball welded to the ground."""
    model = pin.Model()
    ball = model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    ends = point(model, 0, "ground", pin.SE3.Identity()), point(model, ball, "moving", pin.SE3.Identity())
    return fb.ClosedChain(model, (fb.Closure(ends, "6d"),), ())


AXES = [*np.eye(3), *(-np.eye(3)), [1, 1, 0], [0, 1, 1], [1, 0, 1], [1, 1, 1], [1, -2, 3], [1, 1e-8, 0], [1e-5, 0, 1]]


@pytest.mark.parametrize("axis", AXES, ids=str)
@pytest.mark.parametrize("from_half", [True, False])
def test_rotation_vectors_are_exact_up_to_half_a_turn(axis, from_half):
    """Turns near none and near half of one: as large as they are, about the axis they are about."""
    s, axis = Sampled(turning_ball()), np.array(axis) / np.linalg.norm(axis)
    for small in (1e-1, 1.1e-3, 9e-4, 1e-5, 1e-7, 1e-9, 1e-13):
        angle = np.pi - small if from_half else small
        q = np.r_[np.sin(0.5 * angle) * axis, np.cos(0.5 * angle)]
        residual, J, _ = looked(s, q, np.ones(3))
        np.testing.assert_allclose(residual[-3:], angle * axis, rtol=0.0, atol=2e-15 * max(1.0, angle))
        np.testing.assert_allclose(J[-3:], pin.Jlog3(pin.exp3(angle * axis)), rtol=0.0, atol=2e-9)


def test_half_a_turn_and_none_have_numbers():
    s = Sampled(turning_ball())
    for q in np.eye(4):
        for sign in (1.0, -1.0):
            residual, J, _ = looked(s, sign * q, np.ones(3))
            assert abs(np.linalg.norm(residual[-3:]) - (0.0 if q[3] else np.pi)) < 1e-15
            assert np.isfinite(J).all()


def test_a_rod_whose_ends_meet_lies_along_x_of_its_first_frame():
    """There it has no direction; nothing becomes nan, and the residual is minus its length."""
    model, rng = pin.Model(), np.random.default_rng(2)
    arm = model.addJoint(0, pin.JointModelTranslation(), pin.SE3.Identity(), "arm")
    where = random_placement(rng)
    ends = point(model, 0, "one", where), point(model, arm, "two", pin.SE3.Identity())
    chain = fb.ClosedChain(model, (Distance(ends, 0.7),), ())
    s = Sampled(chain)
    residual, J, drift = looked(s, where.translation, np.ones(3))
    unit = loops_of(chain).row_scale[0]
    np.testing.assert_allclose(residual, [-0.7 * unit], rtol=1e-15)
    np.testing.assert_allclose(J, unit * where.rotation[:, :1].T, rtol=0.0, atol=1e-15)
    assert drift == [0.0]


def test_rows_that_say_nothing_anywhere_are_gone():
    """A planar loop by points has two rows of three, by a weld three of six, by hinges two of five."""
    for kind, rows in (("3d", 2), ("6d", 3), ("revolute", 2)):
        assert len(Sampled(five_bar(kind=kind)).rows) == rows
