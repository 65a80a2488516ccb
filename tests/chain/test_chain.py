"""A ClosedChain is checked once, copied in, and cannot be changed."""

from __future__ import annotations

import dataclasses

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import AT_ORIGIN, add, at, body, double_four_bar, five_bar, four_bar, point, rscr, slider_crank

import fivebar_pin as fb
from fivebar_pin import errors
from fivebar_pin.chain import Visual, find_frame
from fivebar_pin.errors import FiveBarPinError, InvalidInputError, UnknownNameError


def arms() -> pin.Model:
    """Return two hinged arms with a frame at each tip."""
    model = pin.Model()
    model.name = "arms"
    for name in ("a", "b"):
        joint = add(model, 0, pin.JointModelRZ(), at(), name, body())
        point(model, joint, f"tip_{name}", at(1.0))
    add(model, 0, pin.JointModelSpherical(), at(), "ball", body())
    return model


TIPS = fb.Closure(("tip_a", "tip_b"))


def test_model_is_copied_and_the_callers_stays_untouched():
    model = arms()
    chain = fb.ClosedChain(model, (TIPS,), ("a",))
    before = model.copy()
    chain.model.gravity.linear = np.array([1.0, 2.0, 3.0])
    chain.with_gravity([4.0, 5.0, 6.0])
    chain.with_inertias({"a": body(9)})
    assert model == before
    model.inertias[1] = pin.Inertia.Zero()
    assert chain.model.inertias[1].mass > 0.9


def test_fields_cannot_be_set():
    chain = fb.ClosedChain(arms(), (TIPS,), ("a",))
    for name in ("model", "closures", "actuated", "name"):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(chain, name, None)
    with pytest.raises(ValueError, match="read-only"):
        chain.inertial_parameters[0, 0] = 1.0


def test_sizes_and_indices_follow_pinocchio():
    chain, _ = rscr()
    assert (chain.nq, chain.nv, chain.na) == (chain.model.nq, chain.model.nv, 1)
    assert chain.joints == ("crank", "ball", "turn", "slide")
    assert chain.actuated_index.tolist() == [0]
    assert chain.passive_index.tolist() == [1, 2, 3, 4, 5]
    swapped = five_bar().with_actuated(["right_elbow", "left"])
    assert swapped.actuated_index.tolist() == [3, 0]
    assert swapped.passive_index.tolist() == [1, 2]


def test_mass_and_length_are_those_of_the_parts():
    chain = double_four_bar()
    assert chain.mass == pytest.approx(5.0, rel=1e-15)
    assert chain.length == pytest.approx(np.mean([1.0, 1.0, 1.0, 2.0, 1.0, 1.0, 1.0, 1.0]), rel=1e-15)
    model = pin.Model()
    add(model, 0, pin.JointModelRZ(), AT_ORIGIN, "only", body())
    assert fb.ClosedChain(model, (), ()).length == 1.0


def test_inertial_parameters_go_out_and_come_back():
    chain = five_bar()
    doubled = chain.with_inertial_parameters(2.0 * chain.inertial_parameters)
    np.testing.assert_allclose(doubled.inertial_parameters, 2.0 * chain.inertial_parameters, rtol=0.0, atol=1e-15)
    one = chain.with_inertias({"right": body(7, mass=3.0)})
    np.testing.assert_allclose(one.inertial_parameters[2], body(7, mass=3.0).toDynamicParameters(), rtol=0.0, atol=0.0)
    np.testing.assert_array_equal(one.inertial_parameters[[0, 1, 3]], chain.inertial_parameters[[0, 1, 3]])


def test_gravity_and_motors_are_exchanged_without_touching_the_rest():
    chain = five_bar()
    other = chain.with_gravity([1.0, 2.0, 3.0]).with_actuated(["right", "right_elbow"])
    np.testing.assert_array_equal(other.model.gravity.linear, [1.0, 2.0, 3.0])
    assert (other.actuated, other.closures, other.name) == (("right", "right_elbow"), chain.closures, chain.name)
    np.testing.assert_array_equal(chain.model.gravity.linear, [0.3, -9.81, 0.4])


def test_it_says_what_it_is():
    text = repr(fb.ClosedChain(arms(), (TIPS,), ("a",)))
    assert text == ("ClosedChain('arms': 3 joints, nq = 6, nv = 5; closures: tip_a~tip_b (3d); actuated: a)")
    assert "closures: none; actuated: none" in repr(fb.ClosedChain(pin.Model(), (), ()))
    assert fb.ClosedChain(pin.Model(), (), ()).name == "mechanism"


@pytest.mark.parametrize(
    ("closures", "actuated", "kind", "message"),
    [
        ((fb.Closure(("tip_a", "tip_c")),), (), UnknownNameError, r"frame of closure .* 'tip_c'; known: .*tip_b"),
        ((fb.Closure(("tip_a", "a_body")),), (), InvalidInputError, r"joins two frames of one body \(a\)"),
        ((TIPS, fb.Closure(("tip_b", "tip_a"), name=TIPS.name)), (), InvalidInputError, "closure names .* must differ"),
        ((TIPS,), ("a", "A"), UnknownNameError, "Unknown actuated joint 'A'; known: a, b, ball"),
        ((TIPS,), ("a", "a"), InvalidInputError, "'a' is named twice"),
        ((TIPS,), ("ball",), InvalidInputError, r"actuated joint ball = 'nv = 3' but must have one degree of freedom"),
        ((TIPS,), ("universe",), UnknownNameError, "Unknown actuated joint 'universe'"),
    ],
)
def test_wrong_closures_and_motors_are_refused(closures, actuated, kind, message):
    with pytest.raises(kind, match=message):
        fb.ClosedChain(arms(), closures, actuated)


def test_close_names_are_suggested():
    with pytest.raises(UnknownNameError, match="Did you mean 'tip_b'"):
        fb.ClosedChain(arms(), (fb.Closure(("tip_a", "tip_bb")),), ())


def test_trees_with_impossible_numbers_are_refused():
    model = arms()
    model.jointPlacements[2] = pin.SE3(np.eye(3), np.array([np.nan, 0.0, 0.0]))
    with pytest.raises(InvalidInputError, match=r"placement of joint b .* must be finite"):
        fb.ClosedChain(model, (), ())
    model = arms()
    model.inertias[1] = pin.Inertia(np.inf, np.zeros(3), np.eye(3))
    with pytest.raises(InvalidInputError, match=r"inertia of joint a .* must be finite"):
        fb.ClosedChain(model, (), ())
    model = arms()
    model.inertias[3] = pin.Inertia(-1.0, np.zeros(3), np.eye(3))
    with pytest.raises(InvalidInputError, match=r"mass of the body of joint ball = -1\.0 but must not be negative"):
        fb.ClosedChain(model, (), ())


def test_replacements_are_checked_too():
    chain = slider_crank()
    with pytest.raises(UnknownNameError, match="Unknown joint 'piston'; known: crank, rod, slider"):
        chain.with_inertias({"piston": body()})
    with pytest.raises(InvalidInputError, match=r"shape of inertial parameters = \(2, 10\) but must be \(3, 10\)"):
        chain.with_inertial_parameters(np.ones((2, 10)))
    with pytest.raises(InvalidInputError, match=r"gravity\[1\] = nan but must be finite"):
        chain.with_gravity([0.0, np.nan, 0.0])
    with pytest.raises(UnknownNameError, match="actuated joint 'wheel'"):
        chain.with_actuated(["wheel"])


def test_visuals_are_checked():
    with pytest.raises(UnknownNameError, match="visual shape 'cone'; known: box, cylinder, capsule, sphere, mesh"):
        Visual("a_body", "cone", (1.0,))
    with pytest.raises(InvalidInputError, match=r"size of box on a_body = \(1,\) but must be \(3,\)"):
        Visual("a_body", "box", (1.0,))
    with pytest.raises(UnknownNameError, match="Unknown frame 'a_bod'"):
        fb.ClosedChain(arms(), (), (), visuals=(Visual("a_bod", "sphere", (1.0,)),))
    visual = Visual("a_body", "sphere", (1.0,))
    with pytest.raises(ValueError, match="read-only"):
        visual.placement[0, 0] = 2.0


def test_every_error_belongs_to_the_family():
    """One name catches them all, whoever adds another."""
    kinds = [getattr(errors, name) for name in errors.__all__]
    kinds = [kind for kind in kinds if not issubclass(kind, Warning)]
    assert len(kinds) >= 9
    assert [kind.__name__ for kind in kinds if not issubclass(kind, FiveBarPinError)] == []


def test_a_frame_name_shared_by_link_and_joint_means_the_link():
    """URDF lets a link and a joint share a name; a closure on that name is the link's frame."""
    model = pin.Model()
    one = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "arm")
    two = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "leg")
    for joint in (one, two):
        model.appendBodyToJoint(joint, body(joint), pin.SE3.Identity())
    model.addFrame(pin.Frame("arm", one, 0, pin.SE3.Identity(), pin.FrameType.JOINT))
    out = pin.SE3(np.eye(3), np.array([1.0, 0.0, 0.0]))
    model.addFrame(pin.Frame("arm", one, 0, out, pin.FrameType.BODY))
    model.addFrame(pin.Frame("leg_tip", two, 0, out, pin.FrameType.OP_FRAME))
    chain = fb.ClosedChain(model, (fb.Closure(("arm", "leg_tip")),), ("arm",))
    np.testing.assert_allclose(fb.closure_residual(chain, np.array([0.3, 0.3])), 0.0, atol=1e-15)
    assert np.abs(fb.closure_residual(chain, np.array([0.3, 0.0]))).max() > 0.2
    states = fb.simulate(chain, np.array([0.3, 0.3]), np.zeros(2), [0.1], np.linspace(0.0, 0.5, 3), initial="check")
    assert states.worst_closure < 1e-12


def test_a_link_wins_over_a_fixed_joint_of_its_name():
    """The frame of a name is the link's, even where a fixed joint elsewhere has that name and comes first."""
    model = pin.Model()
    one = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "arm")
    out = pin.SE3(np.eye(3), np.array([1.0, 0.0, 0.0]))
    model.addFrame(pin.Frame("tip", one, 0, pin.SE3.Identity(), pin.FrameType.FIXED_JOINT), False)
    model.addFrame(pin.Frame("tip", one, 0, out, pin.FrameType.BODY), False)
    np.testing.assert_array_equal(find_frame(model, "tip").placement.translation, [1.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("damping", -0.1, "damping of joint coupler = -0.1 but must be a number, not negative"),
        ("upperDryFrictionLimit", -1e-9, "dry friction of joint coupler"),
        ("armature", -1.0, "armature of joint coupler"),
        ("armature", np.nan, "armature of joint coupler = nan"),
        ("damping", np.nan, "damping of joint coupler = nan"),
        ("rotorInertia", -1.0, "rotor inertia of joint coupler"),
        ("upperEffortLimit", -1.0, "effort limit of joint coupler"),
        ("upperVelocityLimit", -1.0, "velocity limit of joint coupler"),
        ("upperPositionLimit", -1e9, "position limits of joint coupler"),
        ("lowerPositionLimit", np.nan, "position limits of joint coupler"),
        ("lowerEffortLimit", 1e9, "effort limits of joint coupler"),
    ],
)
def test_losses_and_limits_that_no_joint_has_are_refused(field: str, value: float, message: str) -> None:
    model = four_bar().model.copy()
    values = np.array(getattr(model, field))
    values[model.idx_vs[model.getJointId("coupler")]] = value
    setattr(model, field, values)
    with pytest.raises(InvalidInputError, match=message):
        fb.ClosedChain(model, (), ("crank",))


def test_gravity_that_is_no_number_is_refused() -> None:
    model = four_bar().model.copy()
    model.gravity.linear = np.array([0.0, np.nan, 0.0])
    with pytest.raises(InvalidInputError, match="gravity"):
        fb.ClosedChain(model, (), ("crank",))


def test_mimic_joints_of_a_given_model_are_refused_by_name() -> None:
    text = """<robot name="x"><link name="a"/><link name="b"/><link name="c"/>
    <joint name="first" type="continuous"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint>
    <joint name="second" type="continuous"><parent link="b"/><child link="c"/><axis xyz="0 0 1"/>
    <mimic joint="first" multiplier="-1"/></joint></robot>"""
    text = text.replace("continuous", "revolute").replace("<axis", '<limit effort="1" velocity="1"/><axis')
    model = pin.buildModelFromXML(text, mimic=True)
    with pytest.raises(InvalidInputError, match=r"mimic joints = \['second'\] but cannot be part of a chain"):
        fb.ClosedChain(model, (), ("first",))
    assert fb.ClosedChain(pin.buildModelFromXML(text), (), ("first",)).joints == ("first", "second")


@pytest.mark.parametrize(
    ("shape", "size"),
    [("box", (0.1, -0.1, 0.1)), ("cylinder", (-0.1, 1.0)), ("capsule", (0.1, -1.0)), ("sphere", (-1e-9,))],
)
def test_shapes_of_negative_size_are_refused(shape: str, size: tuple[float, ...]) -> None:
    with pytest.raises(InvalidInputError, match=f"size of {shape} on link = .* must not be negative"):
        fb.Visual("link", shape, size)


def test_a_mesh_may_be_mirrored_but_not_flattened() -> None:
    assert fb.Visual("link", "mesh", (1.0, -1.0, 1.0), mesh="a.stl").size[1] == -1.0
    with pytest.raises(InvalidInputError, match="must be scales other than zero"):
        fb.Visual("link", "mesh", (1.0, 0.0, 1.0), mesh="a.stl")


@pytest.mark.parametrize("axis", [(1e-10, 0.0, 0.0), (0.0, -1e-200, 0.0)])
def test_an_axis_of_next_to_nothing_is_none(axis):
    with pytest.raises(InvalidInputError, match=r"closure axis .* must not be zero"):
        fb.Closure(("a", "b"), "revolute", axis)


@pytest.mark.parametrize("size", [1e-8, 1.0, 1e200])
def test_the_size_of_an_axis_does_not_matter(size):
    axis = fb.Closure(("a", "b"), "revolute", np.array([3.0, 0.0, -4.0]) * size).axis
    np.testing.assert_allclose(axis, [0.6, 0.0, -0.8], rtol=0.0, atol=1e-15)


def test_frames_that_both_stand_on_the_ground_close_nothing():
    model = arms()
    point(model, 0, "here", at(1.0))
    with pytest.raises(InvalidInputError, match=r"joins two frames of one body \(universe\)"):
        fb.ClosedChain(model, (fb.Closure(("universe", "here")),), ())


@pytest.mark.parametrize("away", [(100.0, 0.0, 0.0), (-3.0, 2.0, 5.0)])
def test_the_length_of_a_mechanism_does_not_depend_on_where_it_stands(away):
    assert five_bar(base=at(*away)).length == pytest.approx(five_bar().length, rel=1e-12)
    assert double_four_bar().length == pytest.approx(9.0 / 8.0, rel=1e-12)  # eight spans; the first joint is none


def test_a_body_without_mass_keeps_its_moments_of_inertia_and_has_no_first_moment():
    chain = four_bar()
    pi = np.array(chain.inertial_parameters)
    pi[1] = [0.0, 0.0, 0.0, 0.0, 0.5, 0.01, 0.6, 0.02, 0.03, 0.7]
    np.testing.assert_array_equal(chain.with_inertial_parameters(pi).inertial_parameters, pi)
    for k in (1, 2, 3):
        wrong = pi.copy()
        wrong[1, k] = 0.1
        with pytest.raises(InvalidInputError, match=r"first moment of the body of joint coupler .* must be zero"):
            chain.with_inertial_parameters(wrong)


def test_a_body_without_mass_has_no_negative_moments():
    chain = four_bar()
    pi = np.array(chain.inertial_parameters)
    pi[1] = [0.0, 0.0, 0.0, 0.0, -1e-3, 0.0, 0.0, 0.0, 0.0, 0.0]
    with pytest.raises(InvalidInputError, match=r"inertia of the body of joint coupler.*no negative moments"):
        chain.with_inertial_parameters(pi)


def test_a_floating_base_is_fixed_where_it_stands():
    """The loops, the motors and the motion of the joints are those of the base held; what it carries stays."""
    model = pin.Model()
    root = add(model, 0, pin.JointModelFreeFlyer(), at(), "root", body(9))
    bars = [add(model, root, pin.JointModelRZ(), at(x), f"hip{k}", body(k)) for k, x in enumerate((0.0, 1.2))]
    knees = [add(model, j, pin.JointModelRZ(), at(1.0), f"knee{k}", body(2 + k)) for k, j in enumerate(bars)]
    ends = [point(model, j, f"tip{j}", at(1.0)) for j in knees]
    stands = np.r_[0.3, 0.2, 0.1, pin.Quaternion(pin.rpy.rpyToMatrix(0.3, -0.2, 0.4)).coeffs(), np.zeros(4)]
    model.referenceConfigurations["stance"] = stands
    chain = fb.ClosedChain(model, (fb.Closure(ends),), ("hip0", "hip1"))
    fixed = chain.with_fixed_base()
    assert fixed.joints == ("hip0", "hip1", "knee0", "knee1")
    assert fixed.references["stance"].shape == (4,)
    mode = fb.diagnose(fixed).q
    x = mode[:2]
    t = np.linspace(0.0, 1.0, 9)
    motion = fb.motion.combine(*(fb.motion.harmonic(t, a, 0.1, period=1.0) for a in x))
    held, floats = fb.drive(fixed, motion, mode), fb.drive(chain, motion, np.r_[stands[:7], mode])
    np.testing.assert_allclose(floats.q[:, 7:], held.q, rtol=0.0, atol=1e-12)
    one, two = fb.inverse_dynamics(fixed, held), fb.inverse_dynamics(chain, floats)
    np.testing.assert_allclose(one.torque, two.torque, rtol=0.0, atol=1e-12 * np.abs(two.torque).max())
    np.testing.assert_allclose(one.shaking_force, two.shaking_force, rtol=0.0, atol=1e-11)
    neutral = chain.with_fixed_base(pin.neutral(chain.model))
    np.testing.assert_allclose(neutral.model.jointPlacements[2].translation, [1.2, 0.0, 0.0], rtol=0.0, atol=1e-15)
    with pytest.raises(InvalidInputError, match="base = 'fixed' but does not float"):
        fixed.with_fixed_base()
