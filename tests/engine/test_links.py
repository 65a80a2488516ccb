"""The kernels of the tree are Pinocchio's kinematics and dynamics, for every joint that it has."""

from __future__ import annotations

import calls
import joints
import numpy as np
import pinocchio as pin
import pytest
from joints import JOINTS
from mechanisms import at
from sampled import Sampled

import fivebar_pin as fb
from fivebar_pin.engine import entries
from fivebar_pin.engine import tables as e
from fivebar_pin.mechanism.links import links_of

TIGHT = 1e-12  # of the largest number: the same sums in another order
HERE, FAR = at(), at(300.0, -1000.0, 50.0, (0.3, -1.2, 2.0))
PLACES = {"at the origin": HERE, "far from it": FAR}


def tree_with(joint: object, base: pin.SE3 = HERE) -> fb.ClosedChain:
    """Return a tree with the joint under a tilted gravity, with losses."""
    model = joints.tree_with(joint, base)
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
            way = s.W[s.of(c, e.WAY) :][:9:3][:3]
            slide = 0.0 * way if motion == e.TURN else lead * way
            linear = slide if motion == e.SHIFT else np.cross(centre, axis) + slide
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
    table = np.zeros((n, 12 + model.nv))
    N, none = np.zeros((n, model.nv, 0)), (np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros((n, 0, 6)))
    assert entries.loads(s.I, s.W, q, v, a, N, about, *none, table) == -1
    shaking, frame, joints = np.split(table, [6, 12], axis=1)
    carried = frame - shaking
    for i in range(n):
        needed = pin.rnea(model, data, q[i], v[i], a[i])  # armature is among it
        lost = model.damping * v[i] + model.upperDryFrictionLimit * np.sign(v[i])
        close_to(joints[i], needed + lost, 5e-12)
        pin.computeCentroidalMomentumTimeVariation(model, data, q[i], v[i], a[i])
        force, moment, centre = -data.dhg.linear, -data.dhg.angular, data.com[0] - about
        close_to(shaking[i], np.r_[force, moment + np.cross(centre, force)], 5e-12)
        weight = data.mass[0] * np.array(model.gravity.linear)
        close_to(
            carried[i],
            np.r_[weight, np.cross(centre, weight)],
            5e-12 * max(1.0, np.abs(frame[i]).max() / np.abs(weight).max()),
        )


def test_a_joint_that_does_not_move_carries_its_body():
    """A body on a joint of a chain of several is that of its last link."""
    model = tree_with(JOINTS["universal"]).model
    links = links_of(model)
    assert [x.joint for x in links] == [1, 1, 2, 3, 3, 4, 5, 5, 6, 6]
    assert [x.parent for x in links] == [0, 1, 2, 3, 4, 2, 0, 7, 5, 9]
