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
EACH = pytest.mark.parametrize(
    ("chain", "motion"), [(c.with_springs(s), m) for c, m, s in CASES.values()], ids=CASES.keys()
)


@EACH
def test_inverse_of_forward_is_the_torque_with_springs(chain, motion):
    """The torque that forward dynamics turns into an acceleration is the one inverse dynamics asks for."""
    moved = fb.drive(chain, motion)
    tau = np.random.default_rng(3).normal(size=(len(moved), chain.na))
    a = fb.forward_dynamics(chain, moved.q, moved.v, tau)
    loads = fb.inverse_dynamics(chain, replace(moved, a=a))
    np.testing.assert_allclose(loads.torque, tau, rtol=0, atol=1e-10 * max(1.0, np.abs(a).max()))
    without = fb.inverse_dynamics(chain.with_springs(()), replace(moved, a=a))
    assert np.abs(without.torque - tau).max() > 0.1


@EACH
def test_power_is_accounted_for_with_springs(chain, motion):
    """Motor power = rate of kinetic, potential and elastic energy + losses: two accounts, body by body."""
    moved = fb.drive(chain, motion)
    loads = fb.inverse_dynamics(chain, moved)
    assert loads.power_residual() < 1e-12
    account = fb.energy_balance(chain, moved, torque=loads.torque)
    assert account.residual() < 1e-12
    np.testing.assert_array_equal(loads.elastic_energy, account.elastic)
    assert loads.elastic_energy.min() > 0.0
    assert fb.inverse_dynamics(chain.with_springs(()), moved).elastic_energy.max() == 0.0


@EACH
def test_springs_leave_the_force_on_the_frame_and_balance_every_body(chain, motion):
    """Springs are inner forces of the mechanism and its frame: -dp/dt + m g stays; the joint torques balance."""
    moved = fb.drive(chain, motion)
    loads, bare = fb.inverse_dynamics(chain, moved), fb.inverse_dynamics(chain.with_springs(()), moved)
    np.testing.assert_array_equal(loads.shaking_force, bare.shaking_force)
    np.testing.assert_array_equal(loads.shaking_moment, bare.shaking_moment)
    np.testing.assert_array_equal(loads.frame_force, bare.frame_force)
    np.testing.assert_array_equal(loads.frame_moment, bare.frame_moment)
    assert loads.momentum_residual() < 1e-12
    assert loads.reactions.mismatch < 1e-9
    assert np.nanmax(np.abs(loads.joint_reactions_local - bare.joint_reactions_local)) > 0.1


@EACH
def test_springs_between_frames_act_as_the_forces_they_stand_for(chain, motion):
    """Pulls at both ends, put in as external forces, give the same torques and joint reactions."""
    moved = fb.drive(chain, motion)
    data, frames = chain.model.createData(), {f.name: k for k, f in enumerate(chain.model.frames)}
    external = {}
    pulls = [s for s in chain.springs if isinstance(s, Spring)]
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
    sprung = fb.inverse_dynamics(chain.with_springs(pulls), moved)
    pushed = fb.inverse_dynamics(chain.with_springs(()), moved, external=external)
    np.testing.assert_allclose(sprung.torque, pushed.torque, atol=1e-10)
    np.testing.assert_allclose(sprung.joint_reactions_local, pushed.joint_reactions_local, atol=1e-9)
    np.testing.assert_allclose(sprung.closure_reactions_local, pushed.closure_reactions_local, atol=1e-9)


def test_a_joint_spring_alone_is_the_torque_of_its_joint():
    """One hinge at rest without gravity: tau = k (q - rest), carried from the parent through the joint."""
    model = pin.Model()
    model.gravity.linear = np.zeros(3)
    hinge = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(hinge, body(1), pin.SE3.Identity())
    chain = fb.ClosedChain(model, (), ("hinge",), springs=[JointSpring("hinge", 3.0, 0.2)])
    moved = fb.drive(chain, laws.constant(np.array([0.0]), 0.7))
    loads = fb.inverse_dynamics(chain, moved)
    np.testing.assert_allclose(loads.torque, [[1.5]], rtol=1e-15)
    np.testing.assert_array_equal(loads.joint_reactions, np.zeros((1, 1, 6)))


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ([Spring("hok", "left_body", 1.0, 0.1)], UnknownNameError, r"frame of a spring 'hok'.*Did you mean 'hook'"),
        ([JointSpring("elbow", 1.0, 0.1)], UnknownNameError, "joint of a spring 'elbow'"),
        ([JointSpring("universe", 1.0, 0.1)], UnknownNameError, "joint of a spring 'universe'"),
        (["hook"], InvalidInputError, "must hold Spring and JointSpring objects"),
        (JointSpring("left", 1.0, 0.1), InvalidInputError, "must hold Spring and JointSpring objects"),
        ([Spring("hook", "universe", 1.0, 0.1)], InvalidInputError, r"one body \(universe\): it does nothing"),
        ([Spring("left", "left_body", 1.0, 0.1)], InvalidInputError, r"one body \(left\): it does nothing"),
    ],
)
def test_springs_that_a_chain_cannot_have_are_refused(given, error, message):
    with pytest.raises(error, match=message):
        CASES["five-bar"][0].with_springs(given)


def test_a_spring_on_a_joint_of_several_freedoms_is_refused():
    model = pin.Model()
    ball = model.addJoint(0, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    model.appendBodyToJoint(ball, body(1), pin.SE3.Identity())
    with pytest.raises(InvalidInputError, match=r"spring on joint ball.*needs one degree of freedom"):
        fb.ClosedChain(model, (), (), springs=[JointSpring("ball", 1.0, 0.0)])


def test_springs_stay_with_the_chain_through_every_change():
    chain, _, springs = CASES["five-bar"]
    chain = chain.with_springs(springs)
    changed = (
        chain.with_gravity([0.0, -1.0, 0.0])
        .with_actuated(["left"])
        .with_inertial_parameters(2.0 * chain.inertial_parameters)
        .with_inertias({"left": body(3)})
    )
    assert changed.springs == springs
    assert replace(chain, name="other").springs == springs
    assert "springs: hook~left_elbow_body, left_body~tip_right, on right_elbow, on left)" in repr(chain)
    assert "springs" not in repr(chain.with_springs(()))


def hinged(joint: pin.JointModel, *springs: Spring | JointSpring) -> fb.ClosedChain:
    """One body on one joint in no gravity; `anchor` is 0.5 m from it in the ground, `tip` 0.5 m along the body."""
    model = pin.Model()
    model.gravity.linear = np.zeros(3)
    index = model.addJoint(0, joint, pin.SE3.Identity(), "hinge")
    model.appendBodyToJoint(index, body(1), pin.SE3.Identity())
    for parent, name in ((0, "anchor"), (index, "tip")):
        point(model, parent, name, pin.SE3(np.eye(3), np.array([0.5, 0.0, 0.0])))
    return fb.ClosedChain(model, (), ("hinge",), springs=springs)


def at_angle(chain: fb.ClosedChain, angle: float, speed: float = 0.0, road: str | None = None) -> fb.Loads:
    """Return the loads of the hinge at one angle."""
    q = [np.cos(angle), np.sin(angle)] if chain.nq == 2 else [angle]
    v = np.full((1, 1), speed)
    path = fb.Trajectory(np.zeros(1), np.array([q]), v, 0.0 * v, np.ones((1, 1, 1)), np.zeros(1))
    return fb.inverse_dynamics(chain, path, road=road)


@pytest.mark.parametrize("rest", [2.5, 2.5 - 2.0 * np.pi, 2.5 + 6.0 * np.pi])
@pytest.mark.parametrize("turned", [-3.0, -1.0, 0.0, 1.0, 3.0])
def test_a_spring_on_a_joint_without_turns_pulls_the_shorter_way_round(rest, turned):
    """Such a joint knows no turns: the deflection lies within half of one, whatever turn the rest is stated in."""
    chain = hinged(pin.JointModelRUBZ(), JointSpring("hinge", 3.0, rest))
    loads = at_angle(chain, rest + turned)
    np.testing.assert_allclose(loads.torque, [[3.0 * turned]], atol=1e-13)
    np.testing.assert_allclose(loads.elastic_energy, [1.5 * turned**2], atol=1e-13)


@pytest.mark.parametrize("turned", [-7.0, 4.0, 20.0])
def test_a_spring_on_a_hinge_counts_its_turns(turned):
    chain = hinged(pin.JointModelRZ(), JointSpring("hinge", 3.0, 2.5))
    np.testing.assert_allclose(at_angle(chain, 2.5 + turned).torque, [[3.0 * turned]], rtol=1e-15)


def test_a_spring_of_no_length_whose_ends_meet_pulls_nowhere():
    chain = hinged(pin.JointModelRZ(), Spring("anchor", "tip", 40.0, 0.0))
    loads = at_angle(chain, 0.0, speed=2.0, road="pinocchio")
    np.testing.assert_array_equal(loads.torque, [[0.0]])
    for road in ("pinocchio", "complement"):
        bare = at_angle(chain.with_springs(()), 0.0, speed=2.0, road=road)
        np.testing.assert_array_equal(at_angle(chain, 0.0, speed=2.0, road=road).torque, bare.torque)
    np.testing.assert_array_equal(loads.elastic_energy, [0.0])
    np.testing.assert_array_equal(loads.reactions.sprung, np.zeros((1, 1, 6)))
    small = at_angle(chain, 1e-9)  # and close by as the law says, k a^2 sin
    np.testing.assert_allclose(small.torque, [[40.0 * 0.25 * 1e-9]], rtol=1e-6)


@pytest.mark.parametrize(("length", "damping"), [(0.1, 0.0), (0.0, 2.0), (0.1, 2.0)])
def test_a_force_without_a_direction_is_an_error(length, damping):
    chain = hinged(pin.JointModelRZ(), Spring("anchor", "tip", 40.0, length, damping))
    with pytest.raises(SolverError, match=r"spring anchor~tip has its ends on one point.*free length of zero"):
        at_angle(chain, 0.0)
    assert np.isfinite(at_angle(chain, 1e-6).torque).all()
    with pytest.raises(SolverError, match="spring anchor~tip has its ends on one point"):
        fb.forward_dynamics(chain, [0.0], [0.0])


def test_a_diagnosis_does_not_ask_what_springs_pull():
    chain = hinged(pin.JointModelRZ(), Spring("anchor", "tip", 40.0, 0.1))
    found = fb.diagnose(chain, [0.0])
    assert found.springs == ("anchor~tip",)
    bare = fb.diagnose(chain.with_springs(()), [0.0])
    np.testing.assert_array_equal(found.determinate_joints, bare.determinate_joints)


def test_what_springs_leave_of_each_other_is_round_off_and_told_as_none():
    pulls = [JointSpring("hinge", 1e9 / 3.0, rest) for rest in (0.1, 0.2, -0.3)]
    loads = at_angle(hinged(pin.JointModelRZ(), *pulls), 0.0)
    assert 0.0 < np.abs(loads.torque).max() < 1e-6
    assert loads.peak("torque") == 0.0
    alone = at_angle(hinged(pin.JointModelRZ(), pulls[0]), 0.0)
    assert alone.peak("torque") == pytest.approx(1e8 / 3.0)


@pytest.mark.parametrize("bad", ["stiffness", "damping", "length"])
def test_an_infinite_or_negative_spring_is_refused(bad):
    for value in (np.nan, np.inf, -1.0):
        with pytest.raises(InvalidInputError, match=bad if bad != "length" or value == -1.0 else "rest"):
            Spring("a", "b", **{"stiffness": 1.0, "length": 1.0, "damping": 0.0, bad: value})


def test_the_power_of_a_damper_is_its_coefficient_times_the_square_of_its_rate():
    """A slide pulls a damper of 3 N s/m in line with it at 2 m/s, a joint damper of 5 N s/m beside it."""
    model = pin.Model()
    model.gravity.linear = np.zeros(3)
    slide = model.addJoint(0, pin.JointModelPX(), pin.SE3.Identity(), "slide")
    model.appendBodyToJoint(slide, body(1), pin.SE3.Identity())
    point(model, slide, "end", pin.SE3.Identity())
    for damper, lost in ((Spring("universe", "end", 0.0, 0.1, 3.0), 12.0), (JointSpring("slide", 0.0, 0.0, 5.0), 20.0)):
        chain = fb.ClosedChain(model, (), ("slide",), springs=[damper])
        moved = fb.drive(chain, Motion([0.0], [[0.5]], [[2.0]], [[0.0]]))
        account = fb.energy_balance(chain, moved)
        np.testing.assert_allclose(account.dissipated, [lost], rtol=1e-14)
        np.testing.assert_allclose(account.stored_rate, [0.0], rtol=0.0, atol=1e-13)
