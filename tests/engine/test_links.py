"""The kernels of the tree are Pinocchio's kinematics and dynamics, for every joint that it has."""

from __future__ import annotations

import calls
import numpy as np
import pinocchio as pin
import pytest
from mechanisms import add, at, body
from sampled import Sampled

import fivebar_pin as fb
from fivebar_pin.engine import entries
from fivebar_pin.engine import tables as e
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.mechanism.links import links_of

SLANTED = np.array([0.2, -0.6, 0.77]) / np.linalg.norm([0.2, -0.6, 0.77])
TIGHT = 1e-12  # of the largest number: the same sums in another order
HERE, FAR = at(), at(300.0, -1000.0, 50.0, (0.3, -1.2, 2.0))
PLACES = {"at the origin": HERE, "far from it": FAR}


def composite(*joints: object) -> object:
    """Return several joints in one, each placed on the one before."""
    rng = np.random.default_rng(len(joints))
    made = pin.JointModelComposite(joints[0], at(*rng.normal(size=3), rng.normal(size=3)))
    for joint in joints[1:]:
        made.addJoint(joint, at(*rng.normal(size=3), rng.normal(size=3)))
    return made


def slanted_unbounded() -> object:
    """Return an unbounded hinge about a slanted axis; only the URDF reader makes one."""
    axis = " ".join(repr(float(x)) for x in SLANTED)
    links = '<link name="base"/><link name="arm"/>'
    hinge = f'<joint name="j" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="{axis}"/></joint>'
    return pin.buildModelFromXML(f'<robot name="r">{links}{hinge}</robot>').joints[1]


def nested() -> object:
    inner = composite(pin.JointModelRUBY(), pin.JointModelSpherical(), pin.JointModelHZ(0.2))
    return composite(pin.JointModelPX(), inner, pin.JointModelRX())


JOINTS = {
    "RX": pin.JointModelRX,
    "RY": pin.JointModelRY,
    "RZ": pin.JointModelRZ,
    "revolute": lambda: pin.JointModelRevoluteUnaligned(SLANTED),
    "revolute against z": lambda: pin.JointModelRevoluteUnaligned(np.array([0.0, 0.0, -1.0])),
    "RUBX": pin.JointModelRUBX,
    "RUBY": pin.JointModelRUBY,
    "RUBZ": pin.JointModelRUBZ,
    "revolute unbounded": lambda: slanted_unbounded(),
    "PX": pin.JointModelPX,
    "PY": pin.JointModelPY,
    "PZ": pin.JointModelPZ,
    "prismatic": lambda: pin.JointModelPrismaticUnaligned(SLANTED),
    "HX": lambda: pin.JointModelHX(-0.4),
    "HY": lambda: pin.JointModelHY(0.4),
    "HZ": lambda: pin.JointModelHZ(0.3),
    "helical": lambda: pin.JointModelHelicalUnaligned(SLANTED, -0.2),
    "spherical": pin.JointModelSpherical,
    "spherical ZYX": pin.JointModelSphericalZYX,
    "translation": pin.JointModelTranslation,
    "planar": pin.JointModelPlanar,
    "free flyer": pin.JointModelFreeFlyer,
    "universal": lambda: pin.JointModelUniversal(np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.6, 0.8])),
    "composite": lambda: composite(pin.JointModelRX(), pin.JointModelPY(), pin.JointModelRZ()),
    "composite of wide ones": lambda: composite(pin.JointModelFreeFlyer(), pin.JointModelPlanar()),
    "nested composite": nested,
}


def tree_with(joint: object, base: pin.SE3 = HERE) -> fb.ClosedChain:
    """Return a tree, not depth-first, that has the joint at its root, in its middle and at a tip."""
    model = pin.Model()
    root = add(model, 0, joint(), base * at(0.1, -0.2, 0.3, (0.3, 0.2, -0.5)), "root", body(1))
    middle = add(model, root, pin.JointModelRY(), at(0.4, 0.1, -0.1), "hinge", body(2))
    branch = add(model, middle, joint(), at(0.2, 0.3, 0.2, (-0.4, 0.9, 0.1)), "branch", body(3))
    add(model, root, pin.JointModelPX(), at(0.0, 0.3, 0.1, (0.9, 0.0, 0.3)), "slide", body(4))
    add(model, 0, joint(), base * at(0.5, 0.5, 0.1, (0.4, 0.8, 0.3)), "second root", body(6))
    add(model, branch, joint(), at(), "tip", body(5))
    model.gravity.linear = np.array([0.7, -9.81, 0.3])
    rng = np.random.default_rng(9)
    for losses in (model.armature, model.damping, model.upperDryFrictionLimit):
        losses[:] = rng.uniform(0.1, 1.0, model.nv)
    model.lowerDryFrictionLimit[:] = -model.upperDryFrictionLimit
    return fb.ClosedChain(model, (), ())


def states(model: pin.Model, n: int, seed: int = 3) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return q, v, a far from neutral, n times."""
    rng = np.random.default_rng(seed)
    turned = [pin.integrate(model, pin.neutral(model), rng.uniform(-3.0, 3.0, model.nv)) for _ in range(n)]
    return [(q, *rng.normal(size=(2, model.nv))) for q in turned]


def close_to(found: np.ndarray, expected: np.ndarray, tolerance: float = TIGHT) -> None:
    atol = tolerance * max(1.0, float(np.abs(expected).max(initial=0.0)))
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=atol)


every_joint = pytest.mark.parametrize("joint", JOINTS.values(), ids=JOINTS.keys())
everywhere = pytest.mark.parametrize("base", PLACES.values(), ids=PLACES.keys())


@every_joint
@everywhere
def test_poses_velocities_and_accelerations_equal_pinocchio(joint, base):
    chain = tree_with(joint, base)
    s, model, data = Sampled(chain), chain.model, chain.model.createData()
    for q, v, a in states(model, 4):
        s.set(q, v, a)
        calls.tree(s.I, s.W)
        pin.forwardKinematics(model, data, q, v, a)
        for j in range(1, model.njoints):
            R, p = s.pose(j)
            close_to(R, data.oMi[j].rotation)
            close_to(p, data.oMi[j].translation)
            local = data.v[j].angular, data.v[j].linear, data.a[j].angular
            spatial = [data.oMi[j].rotation @ x for x in (*local, data.a[j].linear + np.cross(*local[:2]))]
            close_to(s.rate(j), np.stack(spatial))


@every_joint
@everywhere
def test_every_column_is_the_motion_of_its_coordinate(joint, base):
    """A turn about, a shift along or both along the axis that its record names: Pinocchio's joint Jacobian."""
    chain = tree_with(joint, base)
    s, model, data = Sampled(chain), chain.model, chain.model.createData()
    for q, v, a in states(model, 2):
        s.set(q, v, a)
        calls.tree(s.I, s.W)
        expected = pin.computeJointJacobians(model, data, q)
        for k, c in enumerate(s.records(e.COLUMNS, e.COLUMN_SIZE)):
            axis, centre = s.W[s.of(c, e.AXIS) :][:9:3][:3], s.W[s.of(c, e.CENTRE) :][:3]
            motion, lead = s.of(c, e.MOTION), s.W[s.of(c, e.PITCH)]
            linear = axis if motion == e.SHIFT else np.cross(centre, axis) + (lead if motion == e.HELIX else 0.0) * axis
            angular = 0.0 * axis if motion == e.SHIFT else axis
            close_to(np.r_[linear, angular], expected[:, k])


@every_joint
@pytest.mark.parametrize("size", [1e-9, 1e-5, 9e-5, 1.1e-4, 1e-2, 1.0, 3.0])
def test_integration_equals_pinocchio(joint, size):
    """On either side of where series take over; quaternions have Pinocchio's sign."""
    chain = tree_with(joint)
    s, model = Sampled(chain), chain.model
    for q, v, _ in states(model, 2):
        s.set(q)
        s.numbers(e.X, model.nv)[:] = size * v
        calls.integrate(s.I, s.W, int(s.I[e.X]))
        close_to(s.q, pin.integrate(model, q, size * v), 1e-13)


def test_many_steps_leave_rotations_rotations():
    """Quaternions, cosines and sines keep their length."""
    chain = tree_with(JOINTS["composite of wide ones"])
    s, model = Sampled(chain), chain.model
    (q, v, _), *_ = states(model, 1)
    s.set(q)
    s.numbers(e.X, model.nv)[:] = 0.1 * v
    for _ in range(1000):
        calls.integrate(s.I, s.W, int(s.I[e.X]))
    assert np.abs(s.q - pin.normalize(model, s.q)).max() < 1e-15 * np.abs(s.q).max()


@every_joint
@everywhere
def test_loads_of_a_tree_are_those_of_pinocchio(joint, base):
    """Inverse dynamics with losses, rate of momentum about a point, and weight."""
    chain = tree_with(joint, base)
    s, model, data = Sampled(chain), chain.model, chain.model.createData()
    about, n = np.array([0.3, -0.2, 0.7]), 3
    q, v, a = (np.stack(x) for x in zip(*states(model, n), strict=True))
    out = [np.zeros((n, k)) for k in (0, 6, 6, model.nv)]
    N, none = np.zeros((n, model.nv, 0)), (np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros((n, 0, 6)))
    assert entries.loads(s.I, s.W, q, v, a, N, about, *none, *out) == -1
    _, shaking, carried, joints = out
    for i in range(n):
        needed = pin.rnea(model, data, q[i], v[i], a[i])  # armature is among it
        lost = model.damping * v[i] + model.upperDryFrictionLimit * np.sign(v[i])
        close_to(joints[i], needed + lost, 5e-12)
        pin.computeCentroidalMomentumTimeVariation(model, data, q[i], v[i], a[i])
        force, moment, centre = -data.dhg.linear, -data.dhg.angular, data.com[0] - about
        close_to(shaking[i], np.r_[force, moment + np.cross(centre, force)], 5e-12)
        weight = data.mass[0] * np.array(model.gravity.linear)
        close_to(carried[i], np.r_[weight, np.cross(centre, weight)])


def test_a_joint_that_moves_its_own_axes_is_refused_by_name():
    model = pin.Model()
    model.addJoint(0, pin.JointModelEllipsoid(0.3, 0.4, 0.5), at(), "egg")
    with pytest.raises(InvalidInputError, match=r"JointModelEllipsoid.* is not known"):
        links_of(model)


def test_a_joint_that_does_not_move_carries_its_body():
    """A body on a joint of a chain of several is that of its last link."""
    model = tree_with(JOINTS["universal"]).model
    links = links_of(model)
    assert [x.joint for x in links] == [1, 1, 2, 3, 3, 4, 5, 5, 6, 6]
    assert [x.parent for x in links] == [0, 1, 2, 3, 4, 2, 0, 7, 5, 9]
