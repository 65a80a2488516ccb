"""The batched open-tree kernel is Pinocchio's kinematics, for every joint type."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pinocchio as pin
import pytest
from joints import JOINTS, tree_with
from mechanisms import double_four_bar, five_bar, rscr, slider_crank

import fivebar_pin as fb
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.bodies import Bodies, accelerations, body_rates, total_centre
from fivebar_pin.mechanism.tree import Tree, motion_cross

SAMPLES = 25  # above the number up to which the kernel falls back on Pinocchio itself


def random_state(model: pin.Model, n: int = SAMPLES, seed: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return q (n, nq), v, a (n, nv) far from neutral."""
    rng = np.random.default_rng(seed)
    q = [pin.integrate(model, pin.neutral(model), rng.uniform(-1.2, 1.2, model.nv)) for _ in range(n)]
    return np.stack(q), rng.normal(size=(n, model.nv)), rng.normal(size=(n, model.nv))


@pytest.mark.parametrize("joint", JOINTS.values(), ids=JOINTS.keys())
@pytest.mark.parametrize("n", [1, SAMPLES], ids=["few", "batch"])
def test_poses_and_motion_subspaces_equal_pinocchio(joint, n):
    model = tree_with(joint)
    data, tree = model.createData(), Tree(model)
    q, _, _ = random_state(model, n)
    poses = tree.poses(q)
    for i in range(n):
        S = pin.computeJointJacobians(model, data, q[i])
        np.testing.assert_allclose(poses.S[i], S, rtol=0.0, atol=1e-13)
        for j in range(model.njoints):
            np.testing.assert_allclose(poses.R[j][i], data.oMi[j].rotation, rtol=0.0, atol=1e-13)
            np.testing.assert_allclose(poses.p[j][i], data.oMi[j].translation, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("joint", JOINTS.values(), ids=JOINTS.keys())
def test_velocities_and_bias_accelerations_equal_pinocchio(joint):
    model = tree_with(joint)
    data, tree = model.createData(), Tree(model)
    q, v, _ = random_state(model)
    rates = tree.rates(q, v)
    for i in range(SAMPLES):
        pin.forwardKinematics(model, data, q[i], v[i], np.zeros(model.nv))
        for j in range(1, model.njoints):
            V, A = data.oMi[j].act(data.v[j]).vector, data.oMi[j].act(data.a[j]).vector
            np.testing.assert_allclose(rates.V[j][i], V, rtol=0.0, atol=1e-13 * max(1.0, np.abs(V).max()))
            np.testing.assert_allclose(rates.A[j][i], A, rtol=0.0, atol=1e-13 * max(1.0, np.abs(A).max()))


@pytest.mark.parametrize("joint", JOINTS.values(), ids=JOINTS.keys())
def test_accelerations_equal_pinocchio(joint):
    model = tree_with(joint)
    data, tree = model.createData(), Tree(model)
    q, v, a = random_state(model)
    poses = tree.poses(q)
    A = accelerations(tree, poses, tree.rates(q, v), a)
    for i in range(SAMPLES):
        pin.forwardKinematics(model, data, q[i], v[i], a[i])
        expected = np.stack([data.oMi[j].act(data.a[j]).vector for j in range(1, model.njoints)])
        np.testing.assert_allclose(A[i], expected, rtol=0.0, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize("joint", JOINTS.values(), ids=JOINTS.keys())
def test_integrate_and_difference_equal_pinocchio(joint):
    model = tree_with(joint)
    tree = Tree(model)
    q, v, _ = random_state(model)
    moved = tree.integrate(q, v)
    expected = np.stack([pin.integrate(model, x, d) for x, d in zip(q, v, strict=True)])
    np.testing.assert_allclose(moved, expected, rtol=0.0, atol=1e-13)
    back = np.stack([pin.difference(model, x, y) for x, y in zip(q, expected, strict=True)])
    np.testing.assert_allclose(tree.difference(q, moved), back, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("joint", JOINTS.values(), ids=JOINTS.keys())
def test_momentum_and_its_rate_equal_pinocchio(joint):
    model = tree_with(joint)
    model.gravity.linear = np.zeros(3)
    chain = ClosedChain(model, (), ())
    data, tree, bodies = model.createData(), Tree(chain.model), Bodies.of(chain)
    q, v, a = random_state(model)
    poses = tree.poses(q)
    moving = body_rates(tree, bodies, poses, tree.rates(q, v), a)
    centre = total_centre(bodies, poses)
    for i in range(SAMPLES):
        pin.computeCentroidalMomentumTimeVariation(model, data, q[i], v[i], a[i])
        np.testing.assert_allclose(centre[i], data.com[0], rtol=0.0, atol=1e-13)
        for own, theirs in ((moving.momentum, data.hg), (moving.rate, data.dhg)):
            total = own[i].sum(axis=0)
            np.testing.assert_allclose(total[:3], theirs.linear, rtol=0.0, atol=2e-13 * np.abs(total).max())
            about_com = total[3:] - np.cross(data.com[0], total[:3])
            np.testing.assert_allclose(about_com, theirs.angular, rtol=0.0, atol=1e-12 * np.abs(total).max())


def test_spatial_cross_product_is_the_action_of_motions():
    rng = np.random.default_rng(0)
    V, W = rng.normal(size=(2, 6))
    np.testing.assert_allclose(motion_cross(V, W), (pin.Motion(V) ^ pin.Motion(W)).vector, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("kind", [pin.JointModelRZ, pin.JointModelRUBZ, pin.JointModelPX])
def test_single_coordinates_are_read_back_as_written(kind):
    model = tree_with(kind)
    tree = Tree(model)
    q, _, _ = random_state(model)
    values = np.linspace(-3.0, 3.0, SAMPLES)
    k = int(model.idx_vs[model.getJointId("branch")])
    root = np.array(tree.poses(q).R[1])
    tree.set_coordinate(q, k, values)
    np.testing.assert_allclose(tree.coordinate(q, k), values, rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(tree.poses(q).R[1], root)
    assert tree.is_angle(k) is (kind is not pin.JointModelPX)


@pytest.mark.parametrize("chain", [five_bar(), slider_crank(), double_four_bar(), rscr()[0]], ids=lambda c: c.name)
def test_support_lists_the_joints_that_move_a_body(chain):
    tree, model = Tree(chain.model), chain.model
    for j in range(1, model.njoints):
        moving = set()
        for i in list(model.supports[j])[1:]:
            moving |= set(range(model.idx_vs[i], model.idx_vs[i] + model.joints[i].nv))
        assert set(np.flatnonzero(tree.support[j])) == moving


def test_threads_do_not_share_a_workspace(monkeypatch):
    """All have computed before any reads its result: the worst order that the interpreter may choose."""
    chain = five_bar()
    Q = np.random.default_rng(8).uniform(-np.pi, np.pi, (4, chain.nq))
    alone = [fb.closure_residual(chain, q) for q in Q]
    barrier, compute = threading.Barrier(4, timeout=30.0), pin.computeJointJacobians

    def compute_and_wait(*args):
        J = np.array(compute(*args))
        barrier.wait()
        return J

    monkeypatch.setattr(pin, "computeJointJacobians", compute_and_wait)
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda q: fb.closure_residual(chain, q), Q))
    np.testing.assert_array_equal(together, alone)


@pytest.mark.parametrize("ball", [False, True])
def test_the_smallest_turn_of_a_continuous_joint_is_not_lost(ball):
    """The way there and back, for turns from 1e-14 rad on, beside joints of every other kind."""
    model = pin.Model()
    for name, kind in (("wheel", pin.JointModelRUBZ()), ("hinge", pin.JointModelRX()), ("slide", pin.JointModelPY())):
        model.addJoint(model.njoints - 1, kind, pin.SE3.Identity(), name)
    if ball:
        model.addJoint(3, pin.JointModelSpherical(), pin.SE3.Identity(), "ball")
    tree, rng = Tree(model), np.random.default_rng(3)
    q0 = np.stack([pin.integrate(model, pin.neutral(model), rng.uniform(-3.0, 3.0, model.nv)) for _ in range(400)])
    dv = 10.0 ** rng.uniform(-14.0, 0.2, (400, 1)) * rng.choice([-1.0, 1.0], (400, model.nv))
    found = tree.difference(q0, tree.integrate(q0, dv))
    np.testing.assert_allclose(found, dv, rtol=1e-12, atol=2e-15)
