"""Inverse dynamics with springs: forward and backward, by energy, by virtual work, and by the forces they stand for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import TILTED, body, five_bar, point, rssr, slider_crank

import fivebar_pin as fb
from fivebar_pin import JointSpring, Motion, Spring
from fivebar_pin import motion as laws
from fivebar_pin.errors import InvalidInputError, SolverError, UnknownNameError


def anchored(chain: fb.ClosedChain) -> fb.ClosedChain:
    """Return the chain with a frame `hook` in the ground, armature, damping and dry friction."""
    model = chain.model.copy()
    point(model, 0, "hook", pin.SE3(np.eye(3), np.array([0.3, -0.8, 0.4])))
    model.armature = np.linspace(0.1, 0.3, model.nv)
    model.damping = np.linspace(0.2, 0.5, model.nv)
    model.upperDryFrictionLimit = np.linspace(0.3, 0.7, model.nv)
    return fb.ClosedChain(model, chain.closures, chain.actuated)


def swinging(*means: float, n: int = 30) -> Motion:
    t = np.linspace(0.0, 1.0, n)
    return laws.combine(*(laws.harmonic(t, m, 0.25, period=0.6, phase=k) for k, m in enumerate(means)))


CASES = {
    "five-bar": (
        anchored(five_bar(base=TILTED)),
        swinging(2.0, 1.0),
        (
            Spring("hook", "left_elbow_body", 40.0, 0.2, 3.0),
            Spring("left_body", "tip_right", 25.0, 0.1, 1.0),
            JointSpring("right_elbow", 7.0, 0.4, 0.6),
            JointSpring("left", 5.0, 1.0),
        ),
    ),
    "slider-crank": (
        anchored(slider_crank(base=TILTED)),
        swinging(0.9),
        (Spring("slider_body", "hook", 30.0, 0.3, 2.0), JointSpring("slider", 11.0, 0.2, 0.4)),
    ),
    "RSSR": (
        anchored(rssr()),
        swinging(0.3),
        (Spring("hook", "crank_body", 30.0, 0.0), JointSpring("crank", 4.0, 1.0)),
    ),
}
EACH = pytest.mark.parametrize(("chain", "motion", "springs"), CASES.values(), ids=CASES.keys())


@EACH
def test_inverse_of_forward_is_the_torque_with_springs(chain, motion, springs):
    """The torque that forward dynamics turns into an acceleration is the one inverse dynamics asks for."""
    moved = fb.drive(chain, motion)
    tau = np.random.default_rng(3).normal(size=(len(moved), chain.na))
    a = fb.forward_dynamics(chain, moved.q, moved.v, tau, springs=springs)
    loads = fb.inverse_dynamics(chain, replace(moved, a=a), springs=springs)
    np.testing.assert_allclose(loads.torque, tau, rtol=0, atol=1e-10 * max(1.0, np.abs(a).max()))
    without = fb.inverse_dynamics(chain, replace(moved, a=a))
    assert np.abs(without.torque - tau).max() > 0.1


@EACH
def test_power_is_accounted_for_with_springs(chain, motion, springs):
    """Motor power = rate of kinetic, potential and elastic energy + losses: two accounts, body by body."""
    moved = fb.drive(chain, motion)
    loads = fb.inverse_dynamics(chain, moved, springs=springs)
    assert loads.power_residual() < 1e-12
    account = fb.energy_balance(chain, moved, torque=loads.torque, springs=springs)
    assert account.residual() < 1e-12
    np.testing.assert_array_equal(loads.elastic_energy, account.elastic)
    assert loads.elastic_energy.min() > 0.0
    assert fb.inverse_dynamics(chain, moved).elastic_energy.max() == 0.0


@EACH
def test_springs_leave_the_force_on_the_frame_and_balance_every_body(chain, motion, springs):
    """Springs are inner forces of the mechanism and its frame: -dp/dt + m g stays; the joint torques balance."""
    moved = fb.drive(chain, motion)
    loads, bare = fb.inverse_dynamics(chain, moved, springs=springs), fb.inverse_dynamics(chain, moved)
    np.testing.assert_array_equal(loads.shaking_force, bare.shaking_force)
    np.testing.assert_array_equal(loads.shaking_moment, bare.shaking_moment)
    np.testing.assert_array_equal(loads.frame_force, bare.frame_force)
    np.testing.assert_array_equal(loads.frame_moment, bare.frame_moment)
    assert loads.momentum_residual() < 1e-12
    assert loads.reactions.mismatch < 1e-9
    assert np.nanmax(np.abs(loads.joint_reactions_local - bare.joint_reactions_local)) > 0.1


@EACH
def test_springs_between_frames_act_as_the_forces_they_stand_for(chain, motion, springs):
    """Pulls at both ends, put in as external forces, give the same torques and joint reactions."""
    moved = fb.drive(chain, motion)
    data, frames = chain.model.createData(), {f.name: k for k, f in enumerate(chain.model.frames)}
    external = {}
    pulls = [s for s in springs if isinstance(s, Spring)]
    for spring in pulls:
        for name, other in ((spring.frame1, spring.frame2), (spring.frame2, spring.frame1)):
            external.setdefault(name, np.zeros((len(moved), 6)))
            for k, (q, v) in enumerate(zip(moved.q, moved.v, strict=True)):
                pin.forwardKinematics(chain.model, data, q, v)
                pin.updateFramePlacements(chain.model, data)
                p, o = (data.oMf[frames[x]].translation for x in (name, other))
                vp, vo = (
                    pin.getFrameVelocity(chain.model, data, frames[x], pin.LOCAL_WORLD_ALIGNED).linear
                    for x in (name, other)
                )
                u = (o - p) / np.linalg.norm(o - p)
                stretch, rate = np.linalg.norm(o - p) - spring.length, u @ (vo - vp)
                external[name][k, :3] += (spring.stiffness * stretch + spring.damping * rate) * u
    sprung = fb.inverse_dynamics(chain, moved, springs=pulls)
    pushed = fb.inverse_dynamics(chain, moved, external=external)
    np.testing.assert_allclose(sprung.torque, pushed.torque, atol=1e-10)
    np.testing.assert_allclose(sprung.joint_reactions_local, pushed.joint_reactions_local, atol=1e-9)
    np.testing.assert_allclose(sprung.closure_reactions_local, pushed.closure_reactions_local, atol=1e-9)


def test_a_joint_spring_alone_is_the_torque_of_its_joint():
    """One hinge at rest without gravity: tau = k (q - rest), carried from the parent through the joint."""
    model = pin.Model()
    model.gravity.linear = np.zeros(3)
    hinge = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(hinge, body(1), pin.SE3.Identity())
    chain = fb.ClosedChain(model, (), ("hinge",))
    moved = fb.drive(chain, laws.constant(np.array([0.0]), 0.7))
    loads = fb.inverse_dynamics(chain, moved, springs=[JointSpring("hinge", 3.0, 0.2)])
    np.testing.assert_allclose(loads.torque, [[1.5]], rtol=1e-15)
    np.testing.assert_array_equal(loads.joint_reactions, np.zeros((1, 1, 6)))


def test_springs_of_inverse_dynamics_are_checked():
    chain, motion, _ = CASES["five-bar"]
    moved = fb.drive(chain, motion)
    with pytest.raises(UnknownNameError, match=r"frame of a spring 'hok'.*Did you mean 'hook'"):
        fb.inverse_dynamics(chain, moved, springs=[Spring("hok", "left_body", 1.0, 0.1)])
    with pytest.raises(InvalidInputError, match="must hold Spring and JointSpring objects"):
        fb.inverse_dynamics(chain, moved, springs=["hook"])


@pytest.mark.parametrize("turn", [-2.0 * np.pi, 0.0, 2.0 * np.pi, 6.0 * np.pi])
@pytest.mark.parametrize("away", [-3.0, -0.2, 0.5, 3.0])
def test_a_spring_on_a_continuous_joint_takes_the_short_way_round(turn, away):
    """tau = k x and E = k x^2 / 2 with the deflection x within half a turn, however the rest is counted."""
    model = pin.Model()
    model.gravity.linear = np.zeros(3)
    hinge = model.addJoint(0, pin.JointModelRUBZ(), pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(hinge, body(1), pin.SE3.Identity())
    chain = fb.ClosedChain(model, (), ("hinge",))
    moved = fb.drive(chain, laws.constant(np.array([0.0]), 2.5 + away))
    loads = fb.inverse_dynamics(chain, moved, springs=[JointSpring("hinge", 3.0, 2.5 + turn)])
    np.testing.assert_allclose(loads.torque, [[3.0 * away]], rtol=1e-13)
    np.testing.assert_allclose(loads.elastic_energy, [1.5 * away**2], rtol=1e-13)


def test_a_spring_without_length_may_have_its_ends_on_one_point_unless_it_is_damped():
    """Its force k d needs no direction; that of a damper does."""
    chain = five_bar()
    moved = fb.drive(chain, swinging(2.0, 1.0))
    bare = fb.inverse_dynamics(chain, moved)
    met = fb.inverse_dynamics(chain, moved, springs=[Spring("tip_left", "tip_right", 50.0, 0.0)])
    np.testing.assert_allclose(met.torque, bare.torque, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(met.elastic_energy, 0.0, rtol=0.0, atol=1e-20)
    for ends in ({"length": 0.1}, {"length": 0.0, "damping": 2.0}):
        with pytest.raises(SolverError, match="has its ends on one point"):
            fb.inverse_dynamics(chain, moved, springs=[Spring("tip_left", "tip_right", 50.0, **ends)])


def test_a_spring_on_a_joint_of_several_freedoms_is_refused():
    chain = rssr(ball=True)
    q = np.r_[0.3, pin.Quaternion(pin.rpy.rpyToMatrix(0.2, 0.3, 0.4)).coeffs(), 0.5]
    with pytest.raises(InvalidInputError, match="spring on joint coupler = 'nv = 3' but needs one degree of freedom"):
        fb.forward_dynamics(chain, q, np.zeros(5), springs=[JointSpring("coupler", 1.0, 0.0)])


def test_the_power_of_a_damper_is_its_coefficient_times_the_square_of_its_rate():
    """A slide pulls a damper of 3 N s/m in line with it at 2 m/s, a joint damper of 5 N s/m beside it."""
    model = pin.Model()
    model.gravity.linear = np.zeros(3)
    slide = model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "slide")
    model.appendBodyToJoint(slide, body(1), pin.SE3.Identity())
    point(model, slide, "end", pin.SE3.Identity())
    chain = fb.ClosedChain(model, (), ("slide",))
    moved = fb.drive(chain, Motion([0.0], [[0.5]], [[2.0]], [[0.0]]))
    for damper, lost in ((Spring("universe", "end", 0.0, 0.1, 3.0), 12.0), (JointSpring("slide", 0.0, 0.0, 5.0), 20.0)):
        account = fb.energy_balance(chain, moved, springs=[damper])
        np.testing.assert_allclose(account.dissipated, [lost], rtol=1e-14)
        np.testing.assert_allclose(account.stored_rate, [0.0], rtol=0.0, atol=1e-13)
