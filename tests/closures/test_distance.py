"""A rod between two points: a pendulum, a coupler without mass, and what it refuses to be."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import TILTED, add, at, body, four_bar, point
from tied_chains import rod_four_bar, spatial_rod

import fivebar_pin as fb
from fivebar_pin.closures import Distance
from fivebar_pin.errors import AssemblyError, InvalidInputError, UnknownNameError
from fivebar_pin.mechanism.loops import loops_of

G, MASS, LENGTH = 9.81, 1.7, 0.8


def pendulum() -> fb.ClosedChain:
    """Return a point mass on two slides in the plane x-y, held by a rod from the origin."""
    model = pin.Model()
    model.gravity.linear = np.array([0.0, -G, 0.0])
    model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "x")
    j = model.addJoint(1, pin.JointModelPY(), pin.SE3.Identity(), "y")
    model.appendBodyToJoint(j, pin.Inertia(MASS, np.zeros(3), np.zeros((3, 3))), pin.SE3.Identity())
    return fb.ClosedChain(model, (Distance((point(model, 0, "peg", at()), point(model, j, "bob", at())), LENGTH),), ())


def test_a_mass_on_a_rod_is_a_pendulum():
    """Acceleration and rod force of theta'' = -g / l sin(theta), T = m (g cos(theta) + l theta'^2)."""
    chain, rng = pendulum(), np.random.default_rng(3)
    theta, rate = rng.uniform(-3.0, 3.0, 30), rng.normal(size=30)
    out, across = np.stack([np.sin(theta), -np.cos(theta)], 1), np.stack([np.cos(theta), np.sin(theta)], 1)
    q, v = LENGTH * out, LENGTH * rate[:, None] * across
    a = -G * np.sin(theta)[:, None] * across - LENGTH * rate[:, None] ** 2 * out
    np.testing.assert_allclose(fb.forward_dynamics(chain, q, v, np.zeros((30, 0))), a, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(fb.forward_dynamics(chain, q[0], v[0], np.zeros(0)), a[0], rtol=0.0, atol=1e-12)
    tension = MASS * (G * np.cos(theta) + LENGTH * rate**2)
    loops = loops_of(chain)
    poses = loops.tree.poses(q)
    J = loops.see(poses.q).J
    path = fb.Trajectory(np.arange(30.0), q, v, a, np.zeros((30, 2, 0)), np.zeros(30))
    loads = fb.inverse_dynamics(chain, path)
    (rod,) = loads.multipliers.values()
    np.testing.assert_allclose(rod[:, 0], -tension, rtol=0.0, atol=1e-12 * tension.max())
    np.testing.assert_allclose(loads.closure_reactions[:, 0, :2], -tension[:, None] * out, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(J[:, 0], out, rtol=0.0, atol=1e-14)


def test_the_pendulum_swings_with_the_period_of_one():
    """T = 4 sqrt(l / g) K(sin(theta_0 / 2)), here from rest at a right angle."""
    from scipy.special import ellipk

    quarter = np.sqrt(LENGTH / G) * ellipk(0.5)
    free = fb.simulate(pendulum(), np.array([LENGTH, 0.0]), np.zeros(2), np.zeros(0), np.linspace(0.0, quarter, 5))
    np.testing.assert_allclose(free.q[-1], [0.0, -LENGTH], rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("base", [at(), TILTED], ids=["at origin", "tilted"])
def test_a_rod_is_a_coupler_without_mass(base):
    """The four-bar with the rod needs the torque of the one whose coupler is a body of the tree that weighs nothing."""
    chain, q = rod_four_bar(base=base)
    full = four_bar(base=base)
    light = full.with_inertias({"coupler": pin.Inertia.Zero()}).with_gravity(np.array(chain.model.gravity.linear))
    motion = fb.motion.cycloidal(np.linspace(0.0, 1.0, 61), 0.9, 5.0)
    rod = fb.inverse_dynamics(chain, fb.drive(chain, motion, near=q))
    start = fb.assemble(light, [0.9], near=fb.assembly_modes(full, [0.9])[0])
    bar = fb.inverse_dynamics(light, fb.drive(light, motion, near=start))
    for name in ("torque", "shaking_force", "shaking_moment"):
        one, two = getattr(rod, name), getattr(bar, name)
        np.testing.assert_allclose(one, two, rtol=0.0, atol=1e-11 * np.abs(two).max())
    in_plane = np.array(base.rotation)[:, :2]  # across it the hinges of the bar share the force with its closure
    one, two = (np.matmul(x.bearing_force[:, -1], in_plane) for x in (rod, bar))
    np.testing.assert_allclose(one, two, rtol=0.0, atol=1e-11 * np.abs(two).max())


@pytest.mark.parametrize("kind", ["force", "dynamic", "static"])
def test_a_rod_has_the_conditions_of_a_coupler_without_mass(kind):
    (chain, _), bar = rod_four_bar(), four_bar()
    one, two = (fb.balance_conditions(c, kind) for c in (chain, bar))
    shared = [two.space.names.index(name) for name in one.space.names]
    rows = two.reduced[:, shared]
    assert np.linalg.matrix_rank(rows * one.space.scale, tol=1e-8) == one.rank
    assert one.angles(rows).max() < 1e-8


def test_the_force_is_along_the_rod_and_every_component_is_determinate():
    chain, q = spatial_rod()
    path = fb.drive(chain, fb.motion.cycloidal(np.linspace(0.0, 1.0, 21), 0.3, 0.8), near=q)
    loads = fb.inverse_dynamics(chain, path)
    wrench = loads.closure_reactions[:, 0]
    pair = loops_of(chain).see(path.q).pair(0)
    u = (pair.p2 - pair.p1) / chain.closures[0].length
    size = loads.multipliers["one~two"]
    np.testing.assert_allclose(wrench[:, :3], size * u, rtol=0.0, atol=1e-11 * np.abs(size).max())
    assert np.abs(wrench[:, 3:]).max() < 1e-11 * np.abs(size).max()
    found = fb.diagnose(chain, q)
    assert found.determinate_closures.all() and found.determinate("one~two") == "fx fy fz mx my mz"
    assert found.determinate_rows == (("length",),)


def test_a_second_rod_beside_the_first_is_named_and_its_share_left_open():
    """Three cranks abreast with two equal rods between each pair that keep them parallel: one rod is too many."""
    model = pin.Model()
    for k in range(2):
        crank = add(model, 0, pin.JointModelRZ(), at(float(k)), f"crank{k}", body(k))
        for n, where in enumerate((0.5, -0.5)):
            point(model, crank, f"end{k}{n}", at(where))
    rods = [Distance((f"end0{n}", f"end1{n}"), 1.0, name=f"rod{n}") for n in range(2)]
    chain = fb.ClosedChain(model, rods, ("crank0",))
    q = np.array([0.9, 0.9])
    found = fb.diagnose(chain, q)
    assert found.rows == 2 and found.mobility == 1
    assert [(row.row, row.scope) for row in found.redundant] == [("length", "closed")]
    assert found.determinate_rows == ((), ())
    still = fb.drive(chain, fb.motion.cycloidal(np.linspace(0.0, 1.0, 5), 0.9, 1.2), near=q)
    assert all(np.isnan(x).all() for x in fb.inverse_dynamics(chain, still).multipliers.values())


def test_points_that_coincide_are_a_start_like_any_other():
    """A rod of no length has no direction; the search leaves it along the first axis and closes."""
    chain = pendulum()
    loops = loops_of(chain)
    seen = loops.see(np.zeros((1, 2)))
    np.testing.assert_array_equal(seen.residual, [[-LENGTH]])
    np.testing.assert_array_equal(seen.J, [[[1.0, 0.0]]])
    assert fb.diagnose(chain).ok
    assert np.hypot(*fb.diagnose(chain).q) == pytest.approx(LENGTH, abs=1e-12)


def test_a_rod_that_is_too_short_does_not_assemble():
    chain, _ = rod_four_bar()
    short = fb.ClosedChain(chain.model, (Distance(chain.closures[0].ends, 1e-3, name="rod"),), ("crank",))
    with pytest.raises(AssemblyError, match="closure rod stays open"):
        fb.assemble(short, [0.9])


@pytest.mark.parametrize(
    ("length", "message"),
    [
        (None, "length of closure a~b = None but must be given: the distance of the two points"),
        (0.0, "must be positive .* Points that coincide are a closure of kind '3d'"),
        (-0.3, "must be positive"),
        (np.nan, "must be finite"),
        (np.inf, "must be finite"),
        ("long", "must be one number"),
        ((1.0, 2.0), "must be one number"),
    ],
)
def test_lengths_that_no_rod_has_are_refused(length, message):
    with pytest.raises(InvalidInputError, match=message):
        Distance(("a", "b"), length)


def test_frames_are_checked_as_for_every_closure_between_frames():
    chain, _ = rod_four_bar()
    with pytest.raises(UnknownNameError, match=r"frame of closure rod 'crank_tip'; known: .* Did you mean"):
        fb.ClosedChain(chain.model, (Distance(("crank_tip", "rocker_end"), 1.0, name="rod"),), ())
    with pytest.raises(InvalidInputError, match=r"closure rod = .* but joins two frames of one body \(crank\)"):
        fb.ClosedChain(chain.model, (Distance(("crank_end", "crank_body"), 1.0, name="rod"),), ())
