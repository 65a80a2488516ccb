"""Loads of the engine: Pinocchio's inverse dynamics through the complement, energies of springs, work of wrenches."""

from __future__ import annotations

from dataclasses import replace

import calls
import numpy as np
import pinocchio as pin
import pytest
from mechanisms import at, point
from sampled import Driven, Sampled
from test_following import swing
from test_links import JOINTS, close_to, states, tree_with
from test_newton import every_mechanism, shipped

import fivebar_pin as fb
from fivebar_pin.engine import entries
from fivebar_pin.springs import JointSpring, Spring

NONE = (np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
ABOUT = np.array([0.3, -0.2, 0.7])


class Loads:
    """What `entries.loads` says of a motion: tau, shaking, carried, joint, and a spring that is lost."""

    def __init__(self, chain: fb.ClosedChain, q, v, a, N, *, links=NONE[0], points=NONE[1], wrenches=None) -> None:
        self.s, n = Sampled(chain), len(q)
        out = [np.full((n, k), np.nan) for k in (chain.na, 6, 6, chain.nv)]
        given = (links, points, np.zeros((n, 0, 6)) if wrenches is None else wrenches)
        self.lost = entries.loads(self.s.I, self.s.W, q, v, a, N, ABOUT, *given, *out)
        self.tau, self.shaking, self.carried, self.joint = out


def free(chain: fb.ClosedChain, n: int) -> tuple[np.ndarray, ...]:
    """Return unrelated configurations, velocities and accelerations, and the complement of no motors."""
    q, v, a = (np.stack(x) for x in zip(*states(chain.model, n), strict=True))
    return q, v, a, np.zeros((n, chain.nv, 0))


@every_mechanism
def test_torques_are_those_of_the_tree_through_the_complement(make):
    """tau = N^T (inverse dynamics of the tree, losses), at rest of friction too; M = N^T M N."""
    chain, q = make()
    model = chain.model.copy()
    rng = np.random.default_rng(2)
    for losses in (model.armature, model.damping, model.upperDryFrictionLimit):
        losses[:] = rng.uniform(0.1, 1.0, model.nv)
    model.lowerDryFrictionLimit[:] = -model.upperDryFrictionLimit
    lossy = replace(chain, model=model)
    x, v, a = swing(chain, q, 12)
    v[3] = 0.0
    d = Driven(lossy, x, q, v=v, a=a)
    found, data = Loads(lossy, d.q, d.v, d.a, d.N), model.createData()
    for i in range(len(x)):
        tree = pin.rnea(model, data, d.q[i], d.v[i], d.a[i])
        tree = tree + model.damping * d.v[i] + model.upperDryFrictionLimit * np.sign(d.v[i])
        close_to(found.joint[i], tree, 1e-11)
        close_to(found.tau[i], d.N[i].T @ tree, 1e-11)
    s, M = found.s, np.full((chain.na, chain.na), np.nan)
    calls.mass_matrix(s.I, s.W, M)
    unit = np.column_stack([pin.rnea(model, data, d.q[-1], 0.0 * d.v[-1], n) for n in d.N[-1].T])
    weight = pin.rnea(model, data, d.q[-1], 0.0 * d.v[-1], 0.0 * d.v[-1])
    close_to(M, d.N[-1].T @ (unit - weight[:, None]), 1e-11)


@pytest.mark.parametrize("joint", ["RZ", "RUBX", "PX", "helical", "spherical ZYX", "free flyer", "nested composite"])
def test_springs_between_frames_are_the_slope_of_their_energy_and_their_dampers_take_power(joint):
    chain = tree_with(JOINTS[joint])
    model, rng = chain.model.copy(), np.random.default_rng(0)
    frames = [point(model, j, f"end{j}", at(*rng.normal(size=3))) for j in (0, 3, 4, 6)]
    springs = (
        Spring(frames[0], frames[1], 30.0, 0.4, 2.0),
        Spring(frames[2], frames[3], 20.0, 0.0, 0.0),
        Spring(frames[3], frames[1], 10.0, 0.0, 1.5),
    )
    plain, sprung = replace(chain, model=model), replace(chain, model=model, springs=springs)
    q, v, a, N = free(chain, 3)
    ends, data = [model.getFrameId(name) for name in frames], model.createData()

    def length(k: int, q: np.ndarray) -> float:
        pin.framesForwardKinematics(model, data, q)
        one, two = ((0, 1), (2, 3), (3, 1))[k]
        return float(np.linalg.norm(data.oMf[ends[two]].translation - data.oMf[ends[one]].translation))

    for i in range(len(q)):
        found = Loads(sprung, q, v, a, N).joint[i] - Loads(plain, q, v, a, N).joint[i]
        expected = np.zeros(chain.nv)
        for k, one in enumerate(springs):
            slope = np.array([_slope(lambda x: length(k, pin.integrate(model, q[i], x)), d) for d in np.eye(chain.nv)])  # noqa: B023
            expected += (one.stiffness * (length(k, q[i]) - one.length) + one.damping * slope @ v[i]) * slope
        close_to(found, expected, 1e-8)


def _slope(f, direction: np.ndarray, h: float = 1e-4) -> float:
    return float(
        (f(-2 * h * direction) - 8 * f(-h * direction) + 8 * f(h * direction) - f(2 * h * direction)) / (12 * h)
    )


@pytest.mark.parametrize(
    "kind", [pin.JointModelRZ, pin.JointModelRUBZ, pin.JointModelPX, lambda: pin.JointModelHX(0.2)]
)
def test_springs_of_joints_pull_to_their_rest_the_shorter_way_where_turns_are_not_counted(kind):
    model = pin.Model()
    model.addJoint(0, pin.JointModelSpherical(), at(), "ball")
    model.addJoint(1, kind(), at(0.3), "sprung")
    chain = fb.ClosedChain(model, (), (), springs=(JointSpring("sprung", 5.0, 2.5, 0.7),))
    cyclic = kind is pin.JointModelRUBZ
    for x in (-3.0, -1.0, 0.0, 2.5, 3.1):
        turn = np.array([0.0, 0.0, 0.0, x])
        q, v, a = pin.integrate(model, pin.neutral(model), turn), np.array([0.1, 0.2, 0.3, -1.4]), np.zeros(4)
        found = Loads(chain, q[None], v[None], a[None], np.zeros((1, 4, 0))).joint[0]
        stretch = (x - 2.5 + np.pi) % (2.0 * np.pi) - np.pi if cyclic else x - 2.5
        close_to(found, np.array([0.0, 0.0, 0.0, 5.0 * stretch - 0.7 * 1.4]))


def test_a_spring_whose_ends_meet_is_told_unless_it_needs_no_direction():
    """With a length, or a damper, its force has none there."""
    model = pin.Model()
    arm = model.addJoint(0, pin.JointModelTranslation(), at(), "arm")
    frames = point(model, 0, "one", at(0.2)), point(model, arm, "two", at())
    met = np.array([[0.2 + 1e-15, 0.0, 0.0], [0.4, 0.0, 0.0]])
    for length, damping, lost in ((0.0, 0.0, -1), (0.1, 0.0, 1), (0.0, 0.1, 1)):
        springs = (Spring(*frames, 1.0, 0.0, 0.0), Spring(*frames, 1.0, length, damping))
        chain = fb.ClosedChain(model, (), (), springs=springs)
        for order in (met, met[::-1]):
            assert Loads(chain, order, 0.0 * order, 0.0 * order, np.zeros((2, 3, 0))).lost == lost


@pytest.mark.parametrize("joint", ["RUBX", "PX", "helical", "free flyer", "nested composite"])
def test_wrenches_from_outside_do_work_on_what_they_act_on(joint):
    """At points of links: J^T w off the joints, all of it on the frame."""
    chain = tree_with(JOINTS[joint])
    model, data = chain.model, chain.model.createData()
    q, v, a, N = free(chain, 3)
    rng, s = np.random.default_rng(5), Sampled(chain)
    joints = [3, 6, 3]
    links = np.array([s.last[j][0] for j in joints])
    local, w = rng.normal(size=(3, 3)), rng.normal(size=(3, 3, 6))
    points = np.stack([s.last[j][1].T @ p for j, p in zip(joints, local, strict=True)])
    loaded, unloaded = Loads(chain, q, v, a, N, links=links, points=points, wrenches=w), Loads(chain, q, v, a, N)
    close_to(loaded.shaking, unloaded.shaking)
    for i in range(len(q)):
        pin.computeJointJacobians(model, data, q[i])
        expected, carried = np.zeros(chain.nv), np.zeros(6)
        for k, j in enumerate(joints):
            J = pin.getJointJacobian(model, data, j, pin.ReferenceFrame.WORLD)
            p, f, m = data.oMi[j].act(local[k]), w[i, k, :3], w[i, k, 3:]
            expected -= J.T @ np.r_[f, m + np.cross(p, f)]
            carried += np.r_[f, m + np.cross(p - ABOUT, f)]
        close_to(loaded.joint[i] - unloaded.joint[i], expected, 1e-11)
        close_to(loaded.carried[i] - unloaded.carried[i], carried, 1e-11)


@pytest.mark.parametrize("axis", range(3))
def test_weight_along_each_axis_is_carried(axis):
    g = 9.0 * np.eye(3)[axis]
    chain = tree_with(JOINTS["RZ"]).with_gravity(g)
    q, v, a, N = free(chain, 1)
    found = Loads(chain, q, v, a, N)
    np.testing.assert_allclose(found.carried[0, :3], chain.mass * g, rtol=1e-12, atol=1e-12)


def test_without_gravity_nothing_is_carried():
    chain, q = shipped("delta")
    still = chain.with_gravity([0.0, 0.0, 0.0])
    d = Driven(still, swing(chain, q, 5)[0], q)
    found = Loads(still, d.q, d.v, d.a, d.N)
    assert not found.carried.any() and not found.tau.any()
