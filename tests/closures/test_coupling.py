"""Gears, belts and mimic joints: ratios over several turns, planetary trains, MuJoCo, and what a coupling refuses."""

from __future__ import annotations

import re
import time
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mechanisms import TILTED, add, at, body, five_bar, parallelogram, point
from tied_chains import PLANET, RING, SUN, geared_five_bar, planetary_train, rack_and_pinion

import fivebar_pin as fb
from fivebar_pin.closures import Coupling
from fivebar_pin.errors import AssemblyError, FileFormatError, InvalidInputError, UnknownNameError
from fivebar_pin.mechanism.loops import loops_of

HINGES = pytest.mark.parametrize("joint", [pin.JointModelRZ, pin.JointModelRUBZ], ids=["angle", "cosine and sine"])


def pair(ratio: float, joint: type = pin.JointModelRZ, driven: str = "a", **other: object) -> fb.ClosedChain:
    """Return two wheels on the ground, ratio q_a + q_b = 0.2, with bodies out of balance."""
    model = pin.Model()
    model.gravity.linear = np.array([0.0, -9.81, 0.0])
    add(model, 0, joint(), at(), "a", body(1))
    add(model, 0, joint(), at(1.0), "b", body(2))
    return fb.ClosedChain(model, (Coupling({"a": ratio, "b": 1.0}, 0.2, name="gear"),), (driven,), **other)


@HINGES
@pytest.mark.parametrize("driven", ["a", "b"])
@pytest.mark.parametrize("ratio", [3.7, 2.5])
def test_ratios_that_are_not_whole_hold_over_five_turns(ratio, driven, joint):
    chain = pair(ratio, joint, driven)
    turns = 10.0 * np.pi
    path = fb.drive(chain, fb.motion.cycloidal(np.linspace(0.0, 1.0, 201), 0.3, 0.3 + turns))
    a, b = path.q.T
    assert (chain.nq, chain.nv) == (2, 2)
    assert abs(np.ptp(a if driven == "a" else b) - turns) < 1e-12
    assert np.ptp(b if driven == "a" else a) == pytest.approx(turns * (ratio if driven == "a" else 1 / ratio))
    np.testing.assert_allclose(ratio * a + b, 0.2, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(ratio * path.v[:, 0] + path.v[:, 1], 0.0, rtol=0.0, atol=1e-11)
    # After the turns the wheels are where the ratio has them, not where a whole one would.
    loads = fb.inverse_dynamics(chain, path)
    assert loads.power_residual() < 1e-12
    wheel = chain.model.inertias[2]
    at_end = np.exp(1j * (0.2 - ratio * a[-1] if driven == "a" else b[-1])) * complex(*wheel.lever[:2])
    com = (loads.com[-1] * chain.mass - chain.model.inertias[1].mass * _com_of_first(chain, a[-1])) / wheel.mass
    np.testing.assert_allclose(com[:2], [1.0 + at_end.real, at_end.imag], rtol=0.0, atol=1e-12)


def _com_of_first(chain: fb.ClosedChain, angle: float) -> np.ndarray:
    lever = chain.model.inertias[1].lever
    turned = np.exp(1j * angle) * complex(*lever[:2])
    return np.array([turned.real, turned.imag, lever[2]])


@HINGES
def test_a_geared_pair_has_the_inertia_of_one_shaft(joint):
    """I_eff = I_a + r^2 I_b, tau_eff = tau - m g dh/dq; the multiplier is what b needs."""
    ratio, chain = 3.7, pair(3.7, joint)
    rng = np.random.default_rng(0)
    inertia = [I.inertia[2, 2] + I.mass * (I.lever[:2] @ I.lever[:2]) for I in list(chain.model.inertias)[1:]]
    for _ in range(5):
        qa, va, tau = rng.normal(size=3)
        q, v = np.array([qa, 0.2 - ratio * qa]), np.array([va, -ratio * va])
        weight = [
            I.mass * 9.81 * (np.exp(1j * x) * complex(*I.lever[:2])).real
            for I, x in zip(_bodies(chain), q, strict=True)
        ]
        expected = (tau - weight[0] + ratio * weight[1]) / (inertia[0] + ratio**2 * inertia[1])
        a = fb.forward_dynamics(chain, q, v, np.array([tau]))
        np.testing.assert_allclose(a, [expected, -ratio * expected], rtol=1e-12)
        path = fb.Trajectory(np.zeros(1), q[None], v[None], a[None], fb.complement(chain, q)[None], np.zeros(1))
        loads = fb.inverse_dynamics(chain, path)
        assert loads.torque[0, 0] == pytest.approx(tau, rel=1e-11)
        transmitted = loads.multipliers["gear"]
        np.testing.assert_allclose(transmitted, [[inertia[1] * a[1] + weight[1]]], rtol=1e-10)


def _bodies(chain: fb.ClosedChain) -> list[pin.Inertia]:
    return list(chain.model.inertias)[1:]


@settings(max_examples=25, deadline=None, derandomize=True)
@given(data=st.data())
def test_any_train_of_wheels_moves_as_its_ratios_and_inertias_say(data):
    """Wheels on fixed shafts tied by random rows C q = c: I a = tau + C^T f, C a = 0, against linear algebra."""
    n = data.draw(st.integers(2, 6), label="wheels")
    r = data.draw(st.integers(1, n - 1), label="rows")
    rng = np.random.default_rng(data.draw(st.integers(0, 10**6), label="seed"))
    C = rng.uniform(0.3, 4.0, (r, n)) * rng.choice([-1.0, 1.0], (r, n)) * (rng.random((r, n)) < 0.7)
    C[np.arange(r), np.arange(r)] = rng.uniform(1.0, 3.0, r)
    c, inertia = rng.normal(size=r), rng.uniform(0.1, 2.0, n)
    model = pin.Model()
    model.gravity.linear = np.zeros(3)
    for k in range(n):
        wheel = pin.Inertia(1.0, np.zeros(3), np.diag([1.0, 1.0, inertia[k]]))
        add(model, 0, pin.JointModelRUBZ() if k % 2 else pin.JointModelRZ(), at(float(k)), f"w{k}", wheel)
    rows = [Coupling({f"w{k}": C[i, k] for k in range(n) if C[i, k]}, c[i], name=f"row{i}") for i in range(r)]
    chain = fb.ClosedChain(model, rows, tuple(f"w{k}" for k in range(n)))
    used = [k for k in range(n) if f"w{k}" in {name for row in rows for name in row.ratios} or not k % 2]
    free = np.linalg.svd(C)[2][np.linalg.matrix_rank(C, tol=1e-9) :].T
    assume(np.linalg.cond(C) < 1e4 and len(used) == n)
    q, v, tau = np.linalg.lstsq(C, c, rcond=None)[0], free @ rng.normal(size=n - r), rng.normal(size=n)
    Ct = C / inertia
    f = np.linalg.solve(C @ Ct.T, -Ct @ tau)
    a = fb.forward_dynamics(chain, q, v, tau)
    np.testing.assert_allclose(a, (tau + C.T @ f) / inertia, rtol=0.0, atol=1e-11 * np.abs(tau).max() / inertia.min())
    assert fb.diagnose(chain, q).mobility == n - r


def test_the_transmitted_torque_is_in_the_joints_as_a_motor_is():
    """About its axis each joint passes on what its body needs; the coupling has no wrench of its own."""
    chain = pair(2.5)
    path = fb.drive(chain, fb.motion.cycloidal(np.linspace(0.0, 1.0, 21), 0.0, 2.0))
    loads = fb.inverse_dynamics(chain, path)
    gear, motor = loads.multipliers["gear"][:, 0], loads.torque[:, 0]
    np.testing.assert_allclose(loads.joint_reactions[:, 0, 5], motor + 2.5 * gear, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(loads.joint_reactions[:, 1, 5], gear, rtol=0.0, atol=1e-12)
    assert not loads.closure_reactions.any() and np.isfinite(loads.joint_reactions).all()
    np.testing.assert_allclose(loads.reactions.joint[:, :, :3].sum(axis=1), -loads.frame_force, rtol=0.0, atol=1e-11)


def test_a_planetary_train_obeys_willis():
    """(w_s - w_c) / (w_r - w_c) = -z_r / z_s with the ring at rest, and I_eff from the kinetic energy."""
    chain = planetary_train()
    path = fb.drive(chain, fb.motion.cycloidal(np.linspace(0.0, 1.0, 101), 0.0, 6.0 * np.pi))
    sun, carrier, planet = (path.v[:, k] for k in range(3))
    np.testing.assert_allclose((sun - carrier) * SUN, carrier * RING, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(planet * PLANET, -carrier * RING, rtol=0.0, atol=1e-10)
    assert path.q[-1, 1] == pytest.approx(6.0 * np.pi * SUN / (SUN + RING), abs=1e-12)
    # Balanced wheels without weight: a constant inertia at the sun.
    round_ = {name: pin.Inertia(m, np.zeros(3), np.diag([1.0, 1.0, i])) for name, m, i in WHEELS}
    even = chain.with_inertias(round_)
    k = SUN / (SUN + RING)  # carrier for each turn of the sun
    absolute = k * (1.0 - RING / PLANET)
    inertia = WHEELS[0][2] + (WHEELS[1][2] + WHEELS[2][1] * 0.1**2) * k**2 + WHEELS[2][2] * absolute**2
    a = fb.forward_dynamics(even.with_gravity((0.0, 0.0, 0.0)), np.zeros(3), np.zeros(3), np.array([2.0]))
    np.testing.assert_allclose(a[0], 2.0 / inertia, rtol=1e-12)


WHEELS = (("sun", 1.0, 0.02), ("carrier", 2.0, 0.05), ("planet", 0.5, 0.01))


def test_rack_and_pinion_tie_metres_to_radians():
    chain, q = rack_and_pinion()
    assert q[1] == pytest.approx(0.02 - 0.05 * 0.3)
    N = fb.complement(chain, q)
    np.testing.assert_allclose(N[:, 0], [1.0, -0.05], rtol=1e-12)


@pytest.mark.parametrize("factor", [1e-6, 1.0, -3.0, 1e6])
def test_the_factor_of_the_row_does_not_matter(factor):
    chain, q = geared_five_bar()
    c = chain.closures[1]
    other = fb.ClosedChain(
        chain.model,
        (chain.closures[0], Coupling({k: factor * x for k, x in c.ratios.items()}, factor * c.offset, name="gear")),
        chain.actuated,
    )
    assert loops_of(other).rank(_jacobian(other, q)) == loops_of(chain).rank(_jacobian(chain, q)) == 3
    np.testing.assert_allclose(fb.complement(other, q), fb.complement(chain, q), rtol=0.0, atol=1e-12)
    path = fb.drive(chain, fb.motion.cycloidal(np.linspace(0.0, 1.0, 11), 0.9, 1.4), near=q)
    one, two = (fb.inverse_dynamics(x, path_of(x, path)).multipliers["gear"] for x in (chain, other))
    np.testing.assert_allclose(factor * two, one, rtol=1e-9, atol=1e-9 * np.abs(one).max())


def path_of(chain: fb.ClosedChain, path: fb.Trajectory) -> fb.Trajectory:
    motion = fb.Motion(path.t, path.q[:, :1], path.v[:, :1], path.a[:, :1])
    return fb.drive(chain, motion, near=path.q[0])


def _jacobian(chain: fb.ClosedChain, q: np.ndarray) -> np.ndarray:
    loops = loops_of(chain)
    poses = loops.tree.poses(q[None])
    return loops.see(poses.q).J[0]


def test_a_coupling_joins_the_loops_it_touches():
    """Two loops without a common joint are worked on apart; a gear between passive joints of both makes them one."""
    first, second = five_bar().model, five_bar(base=at(3.0)).model
    model = pin.Model()
    for k, part in enumerate((first, second)):
        shift = model.njoints - 1
        for j in range(1, part.njoints):
            parent = part.parents[j] + shift if part.parents[j] else 0
            add(model, parent, pin.JointModelRZ(), part.jointPlacements[j], f"{part.names[j]}{k}", body(j))
        for side in ("left", "right"):
            frame = part.frames[part.getFrameId(f"tip_{side}")]
            point(model, frame.parentJoint + shift, f"tip_{side}{k}", frame.placement)
    pins = tuple(fb.Closure((f"tip_left{k}", f"tip_right{k}"), name=f"pin{k}") for k in range(2))
    driven = ("left0", "right0", "left1", "right1")
    apart = fb.ClosedChain(model, pins, driven)
    gear = Coupling({"left_elbow0": 1.0, "right_elbow1": -1.5}, name="gear")
    together = fb.ClosedChain(model, (*pins, gear), driven[:3])
    between = fb.ClosedChain(model, (*pins, Coupling({"left0": 1.0, "left1": 1.0})), driven[:2] + driven[3:])
    assert [g.members for g in loops_of(apart).independent] == [(0,), (1,)]
    assert [g.members for g in loops_of(together).independent] == [(0, 1, 2)]
    assert [g.members for g in loops_of(between).independent] == [(0,), (1, 2)]
    assert "2 parts" in str(fb.diagnose(apart)) and "parts that do not" not in str(fb.diagnose(together))


def test_a_coupling_that_follows_from_the_loop_is_named():
    """The cranks of a parallelogram turn alike: gearing them one to one is one row too many, wherever it is closed."""
    free = parallelogram()
    chain = fb.ClosedChain(
        free.model, (*free.closures, Coupling({"crank": 1.0, "rocker": -1.0}, name="belt")), ("crank",)
    )
    q = fb.assemble(free, [0.9], near=np.array([0.9, -0.9, 0.9]))
    found = fb.diagnose(chain, q)
    assert found.mobility == 1 and found.ok
    (row,) = [r for r in found.redundant if r.scope == "closed"]
    assert "belt.ratio" in row.weights
    assert found.determinate("belt") == ""
    path = fb.drive(chain, fb.motion.cycloidal(np.linspace(0.0, 1.0, 5), 0.9, 1.2), near=q)
    loads = fb.inverse_dynamics(chain, path)
    assert np.isnan(loads.multipliers["belt"]).all() and np.isfinite(loads.torque).all()


def test_the_diagnosis_of_a_coupling_says_that_its_torque_is_determinate():
    chain, q = geared_five_bar()
    found = fb.diagnose(chain, q)
    assert found.determinate("gear") == "ratio" and not found.determinate_closures[1].any()
    assert re.search(r"^ +gear +ratio$", str(found), re.MULTILINE)


@pytest.mark.parametrize("joint", [pin.JointModelRZ, pin.JointModelRUBZ], ids=["angle", "cosine and sine"])
@pytest.mark.parametrize("which", ["five-bar", "planetary", "rack"])
def test_mujoco_finds_the_same_accelerations(which, joint, tmp_path: Path):
    """Its mass matrix, bias and equality rows, with the rows held exactly instead of softly: M a = tau - h - J^T f."""
    chain, q = {
        "five-bar": lambda: geared_five_bar(joint=joint),
        "planetary": lambda: (planetary_train(joint), np.array([0.3, 0.3 * SUN / (SUN + RING), -0.3 * SUN / PLANET])),
        "rack": rack_and_pinion,
    }[which]()
    if which == "planetary":
        q = fb.assemble(chain, [0.3])
    fb.save(chain, tmp_path / "geared.xml")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "geared.xml"))
    data = mujoco.MjData(model)
    again = fb.load(tmp_path / "geared.xml")
    tree = loops_of(again).tree
    order = [again.joints.index(mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, j)) for j in range(model.njnt)]
    v = fb.complement(chain, q)[:, 0] * 1.3
    angles = np.array([tree.coordinate(_again(chain, again, q)[None], k)[0] for k in range(again.nv)])
    data.qpos[:], data.qvel[:] = angles[order], v[order]
    mujoco.mj_forward(model, data)
    M = np.zeros((model.nv, model.nv))
    for k in range(model.nv):
        mujoco.mj_mulM(model, data, M[k], np.eye(model.nv)[k])
    J = data.efc_J.reshape(-1, model.nv)
    assert np.abs(data.efc_pos).max() < 1e-12 and np.abs(J @ data.qvel).max() < 1e-11
    tau = np.zeros(model.nv)
    tau[order.index(int(chain.actuated_index[0]))] = 2.0
    # J'v by the change of the rows along the motion; MuJoCo keeps the drift of a connect to itself.
    drift, h = np.zeros(J.shape[0]), 1e-4
    for sign in (1.0, -1.0):
        data.qpos[:] = angles[order] + sign * h * v[order]
        mujoco.mj_forward(model, data)
        drift += sign * (data.efc_J.reshape(-1, model.nv) @ v[order]) / (2.0 * h)
    data.qpos[:] = angles[order]
    mujoco.mj_forward(model, data)
    right = tau - data.qfrc_bias
    Mi = np.linalg.inv(M)
    f = np.linalg.lstsq(J @ Mi @ J.T, drift + J @ Mi @ right, rcond=1e-10)[0]
    theirs = Mi @ (right - J.T @ f)
    ours = fb.forward_dynamics(chain, q, v, np.array([2.0]))
    np.testing.assert_allclose(theirs, ours[order], rtol=0.0, atol=1e-6 * np.abs(ours).max())


def _again(chain: fb.ClosedChain, again: fb.ClosedChain, q: np.ndarray) -> np.ndarray:
    """Return the configuration of the chain that was read, which has the same coordinates."""
    assert (again.nq, again.joints) == (chain.nq, chain.joints)
    return q


def test_the_conditions_of_a_geared_five_bar_have_the_rank_that_geometry_gives():
    """Regressors of the total momentum, written from the planar geometry alone, over one revolution."""
    for ratio, ranks in ((2.5, RANKS[0]), (-1.0, RANKS[1])):
        chain, _ = geared_five_bar(ratio)
        force, moment = _planar_momenta(ratio)
        for kind, rank, rows in zip(("force", "dynamic"), ranks, (force, np.concatenate([force, moment])), strict=True):
            s = np.linalg.svd(rows / np.maximum(np.abs(rows).max(axis=0), 1e-12), compute_uv=False)
            assert (s[rank - 1] > 1e-6 * s[0]) and (s[rank:] < 1e-9 * s[0]).all(), (ratio, kind, s / s[0])
            assert fb.balance_conditions(chain, kind).rank == rank, (ratio, kind)


RANKS = ((6, 10), (4, 10))  # force and dynamic: of any ratio; of cranks that turn alike


def _planar_momenta(ratio: float) -> tuple[np.ndarray, np.ndarray]:
    """Return linear (2 n, k) and angular (n, k) momenta of each parameter m, m x, m y, I of the bodies that has any."""
    a1, a2, a3, a4, a5 = 0.3, 1.2, 1.0, 0.25, 0.9
    psi = np.linspace(0.0, 2.0 * np.pi, 400) + 0.123

    def points(psi):
        gamma = 1.4 - ratio * psi
        A, B = a1 * np.exp(1j * psi), a5 + a4 * np.exp(1j * gamma)
        d = np.abs(B - A)
        x = (d * d + a2 * a2 - a3 * a3) / (2.0 * d)
        tip = A + (B - A) / d * (x + 1j * np.sqrt(a2 * a2 - x * x))
        turns = np.exp(1j * psi), (tip - A) / a2, np.exp(1j * gamma), (tip - B) / a3
        return (np.zeros_like(A), A, a5 + 0.0 * A, B), turns

    h = 1e-3
    far = {k: points(psi + k * h) for k in (-3, -2, -1, 1, 2, 3)}
    origins, turns = points(psi)

    def rate(part, b):
        d1, d2, d3 = (far[k][part][b] - far[-k][part][b] for k in (1, 2, 3))
        return (45.0 * d1 - 9.0 * d2 + d3) / (60.0 * h)

    linear, angular = [], []
    for b in range(4):
        p, u, pv, uv = origins[b], turns[b], rate(0, b), rate(1, b)
        w = (uv / (1j * u)).real
        columns = [pv, uv, 1j * uv]  # of m, m x, m y
        about = [(np.conj(p) * pv).imag, (np.conj(p) * uv + np.conj(u) * pv).imag]
        about.append((np.conj(p) * 1j * uv + np.conj(1j * u) * pv).imag)
        linear.append(np.stack([*columns, np.zeros_like(pv)], axis=1))
        angular.append(np.stack([*about, w], axis=1))
    linear, angular = np.concatenate(linear, axis=1), np.concatenate(angular, axis=1)
    used = np.abs(linear).max(axis=0) + np.abs(angular).max(axis=0) > 1e-12
    return np.concatenate([linear.real, linear.imag])[:, used], angular[:, used]


def test_a_balanced_geared_five_bar_shakes_nothing():
    chain, q = geared_five_bar(2.5)
    design = fb.balance(chain, "force", region=fb.balancing.Ball(0.3))
    motion = fb.motion.cycloidal(np.linspace(0.0, 1.0, 101), 0.9, 5.9)
    before, after = (fb.inverse_dynamics(c, fb.drive(c, motion, near=q)) for c in (chain, design.chain))
    assert after.peak("shaking_force") < 1e-9 * before.peak("shaking_force")
    assert before.peak("shaking_force") > 1.0


def test_ratios_are_those_of_their_joints_in_whatever_order_they_are_said():
    one = fb.drive(pair(3.7), fb.motion.cycloidal(np.linspace(0.0, 1.0, 11), 0.3, 1.3))
    chain = pair(3.7)
    turned = fb.ClosedChain(chain.model, (Coupling({"b": 1.0, "a": 3.7}, 0.2, name="gear"),), ("a",))
    other = fb.drive(turned, fb.motion.cycloidal(np.linspace(0.0, 1.0, 11), 0.3, 1.3))
    np.testing.assert_array_equal(other.q, one.q)
    loads = [fb.inverse_dynamics(c, path).torque for c, path in ((chain, one), (turned, other))]
    np.testing.assert_array_equal(loads[1], loads[0])
    assert loops_of(turned).anchored[0].tied == (1, 2)


@HINGES
def test_joints_of_a_coupling_count_their_turns(joint):
    """A joint of cosine and sine becomes a revolute one about the same axis; the rest of the model stays."""
    free = five_bar(base=TILTED, joint=joint).model
    free.referenceConfigurations["home"] = pin.integrate(free, pin.neutral(free), np.array([-0.3, -0.4, -2.0, 0.1]))
    for k, word in enumerate(OF_VELOCITY):
        setattr(free, word, 0.1 + k + 0.1 * np.arange(4.0))
    passive = free.idx_qs[2]
    free.lowerPositionLimit[passive], free.upperPositionLimit[passive] = -0.7, 0.8
    free.positionLimitMargin[passive] = 0.05
    before = free.nq
    chain = fb.ClosedChain(free, (Coupling({"left": 1.0, "right": 2.0}),), ())
    assert free.nq == before and chain.nq == (4 if joint is pin.JointModelRZ else 6)
    model = chain.model
    rng = np.random.default_rng(1)
    tangent, v, a = rng.normal(size=(3, 4))
    one, two = pin.integrate(free, pin.neutral(free), tangent), pin.integrate(model, pin.neutral(model), tangent)
    torque = [pin.rnea(m, m.createData(), q, v, a) for m, q in ((free, one), (model, two))]
    np.testing.assert_allclose(torque[1], torque[0], rtol=0.0, atol=1e-12)
    home = pin.difference(model, pin.neutral(model), chain.references["home"])
    np.testing.assert_allclose(home, [-0.3, -0.4, -2.0, 0.1], rtol=0.0, atol=1e-12)
    assert [f.name for f in model.frames] == [f.name for f in free.frames]
    assert [f.placement for f in model.frames] == [f.placement for f in free.frames]
    assert [f.parentJoint for f in model.frames] == [f.parentJoint for f in free.frames]
    for word in OF_VELOCITY:
        np.testing.assert_array_equal(getattr(model, word), getattr(free, word), err_msg=word)
    kept = model.idx_qs[2]
    assert (model.lowerPositionLimit[kept], model.upperPositionLimit[kept]) == (-0.7, 0.8)
    assert model.positionLimitMargin[kept] == 0.05
    assert model.gravity == free.gravity and model.name == free.name
    oblique = pin.buildModelFromXML(OBLIQUE)
    load = pin.Inertia(2.0, np.array([0.1, 0.2, 0.3]), np.eye(3))  # frames remember what was fixed to them
    oblique.inertias[0] = load  # as a file may say of the ground
    oblique.addFrame(pin.Frame("load", 1, 0, pin.SE3.Identity(), pin.FrameType.BODY, load))
    turned = fb.ClosedChain(oblique, (Coupling({"j": 1.0}),), ()).model
    x = 2.3
    poses = [m.createData() for m in (oblique, turned)]
    pin.forwardKinematics(oblique, poses[0], np.array([np.cos(x), np.sin(x)]))
    pin.forwardKinematics(turned, poses[1], np.array([x]))
    np.testing.assert_allclose(poses[1].oMi[1].homogeneous, poses[0].oMi[1].homogeneous, rtol=0.0, atol=1e-14)
    assert [I.toDynamicParameters().tolist() for I in turned.inertias] == [
        I.toDynamicParameters().tolist() for I in oblique.inertias
    ]
    limits = turned.lowerPositionLimit[0], turned.upperPositionLimit[0]
    assert limits[0] < -1e300 and limits[1] > 1e300


TURNS = {
    "a pair": ({"a": 3.0, "b": 1.0}, 0.0, {"a": 2.0, "b": -6.0}),
    "the slow wheel leads": ({"a": 1.0, "b": -0.5}, 0.2, {"a": 3.2, "b": 6.0}),
    "both have turned": ({"a": 2.5, "b": 1.0}, 0.0, {"a": 4.0, "b": -10.0}),
    "a rack tells the turns": ({"rack": 1.0, "a": -0.05}, 0.0, {"rack": 1.0, "a": 20.0}),
}


def _coupled_home(ratios: dict[str, float], offset: float, angles: dict[str, float], off: float) -> fb.ClosedChain:
    """Return joints that turn, of cosine and sine, and a rack, with a reference whose angles are off [rad]."""
    model, q = pin.Model(), []
    for k, (name, x) in enumerate(angles.items()):
        add(model, 0, pin.JointModelPX() if name == "rack" else pin.JointModelRUBZ(), at(float(k)), name, body(k))
        q += [x] if name == "rack" else [np.cos(x + off), np.sin(x + off)]
    model.referenceConfigurations["home"] = np.array(q)
    return fb.ClosedChain(model, (Coupling(ratios, offset),), ())


@pytest.mark.parametrize(("ratios", "offset", "angles"), TURNS.values(), ids=TURNS)
@pytest.mark.parametrize("off", [0.0, 1e-7])
def test_a_configuration_of_cosines_and_sines_gets_the_turns_that_close_it(ratios, offset, angles, off):
    """Written with seven digits it closes as well as these say."""
    chain = _coupled_home(ratios, offset, angles, off)
    home = dict(zip(chain.joints, chain.references["home"], strict=True))
    assert abs(fb.closure_residual(chain, chain.references["home"])[0]) < 4.0 * off + 1e-12
    for name, x in angles.items():
        assert abs(np.exp(1j * home[name]) - np.exp(1j * (x + off * (name != "rack")))) < 1e-12


@pytest.mark.parametrize(("ratios", "offset", "angles"), TURNS.values(), ids=TURNS)
def test_no_turns_are_invented_for_a_configuration_that_is_open(ratios, offset, angles):
    home = _coupled_home(ratios, offset, angles, 1e-3).references["home"]
    assert np.abs(home).max() <= np.pi


def test_a_belt_over_five_wheels_knows_all_their_turns():
    model, radii = pin.Model(), np.array([0.1, 0.05, 0.2, 0.15, 0.03])
    for k in range(5):
        add(model, 0, pin.JointModelRUBZ(), at(float(k)), f"p{k}", body(k))
    angles = 1.0 / radii
    model.referenceConfigurations["home"] = np.stack([np.cos(angles), np.sin(angles)], axis=1).ravel()
    belt = [Coupling({f"p{k}": radii[k], f"p{k + 1}": -radii[k + 1]}) for k in range(4)]
    chain = fb.ClosedChain(model, belt, ("p0",))
    np.testing.assert_allclose(chain.references["home"], angles, rtol=0.0, atol=1e-12)


def test_couplings_that_contradict_each_other_are_told_to_be_looked_at():
    """Two gears of one pair with other offsets: lengths are named only where there are some."""
    one = pair(2.5)
    two = fb.ClosedChain(one.model, (*one.closures, Coupling({"a": 5.0, "b": 2.0}, 0.6, name="other")), ("a",))
    (error,) = [str(p) for p in fb.diagnose(two).problems if p.severity == "error"]
    assert error.endswith("m or rad. Check the ratios and offsets of the couplings.")
    with pytest.raises(AssemblyError, match=r"or check the ratios and offsets of the couplings\."):
        fb.assemble(two, [0.3])
    free = five_bar((0.3, 0.2, 0.2, 0.25, 2.0))
    far = fb.ClosedChain(free.model, (*free.closures, Coupling({"left": 1.0, "right": 1.0})), ("left",))
    with pytest.raises(AssemblyError, match=r"link lengths and the frames of the closures, and the ratios and offsets"):
        fb.assemble(far, [0.3])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("ratio", "elbow"), [(2.5, 0.1), (2.0, 0.1), (-1.5, 0.2)])
def test_the_modes_of_a_geared_five_bar_are_the_roots_over_all_turns_of_its_gear(ratio, elbow, seed):
    """Driven at an elbow it closes where the right crank, which follows the left one, is a3 away from the left arm."""
    a1, a2, a3, a4, a5 = 0.3, 1.2, 1.0, 0.25, 0.9
    chain = geared_five_bar(ratio, offset=0.4)[0].with_actuated(("left_elbow",))
    left = np.linspace(0.0, 4.0 * np.pi, 20_001)
    tip = a1 * np.exp(1j * left) + a2 * np.exp(1j * (left + elbow))
    gap = np.abs(tip - a5 - a4 * np.exp(1j * (0.4 - ratio * left))) - a3
    roots = np.count_nonzero(np.diff(np.sign(gap)))
    roots = roots if ratio % 1.0 else roots // 2
    assert len(fb.assembly_modes(chain, [elbow], seed=seed)) == roots > 0


def test_forty_wheels_that_do_not_mesh_are_given_up_soon():
    """The search for their turns would go on for a minute if nothing ended it."""
    radii, model = np.random.default_rng(0).uniform(0.5, 2.0, 41), pin.Model()
    for k in range(41):
        add(model, 0, pin.JointModelRUBZ(), at(float(k)), f"w{k}", body(k))
    angles = 10.0 / radii + 1e-3 * np.arange(41) ** 2
    model.referenceConfigurations["home"] = np.stack([np.cos(angles), np.sin(angles)], axis=1).ravel()
    start = time.perf_counter()
    chain = fb.ClosedChain(model, [Coupling({f"w{k}": radii[k], f"w{k + 1}": -radii[k + 1]}) for k in range(40)], ())
    assert time.perf_counter() - start < 15.0
    assert np.abs(chain.references["home"]).max() <= np.pi


OF_VELOCITY = (
    "armature", "damping", "rotorGearRatio", "rotorInertia", "lowerDryFrictionLimit", "upperDryFrictionLimit",
    "lowerEffortLimit", "upperEffortLimit", "lowerVelocityLimit", "upperVelocityLimit",
)  # fmt: skip

OBLIQUE = """<robot name="one"><link name="a"/><link name="b"><inertial><mass value="1"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="j" type="continuous">
<parent link="a"/><child link="b"/><axis xyz="1 2 -2"/></joint></robot>"""

URDF = """<robot name="gears"><link name="base"/><link name="one"/><link name="two"/>
<joint name="a" type="continuous"><parent link="base"/><child link="one"/><axis xyz="0 0 1"/></joint>
<joint name="b" type="{kind}"><parent link="base"/><child link="two"/><axis xyz="0 0 1"/></joint></robot>"""
SIDECAR = """closed_loop: [[a, b]]
type: [coupling]
ratio: [[3.7, 1]]
name_mot: [a]
"""


def written(folder: Path, sidecar: str = SIDECAR, kind: str = "continuous") -> Path:
    (folder / "gears.urdf").write_text(URDF.format(kind=kind))
    (folder / "gears.yaml").write_text(sidecar)
    return folder / "gears.urdf"


def test_files_say_continuous_and_the_chain_counts_turns(tmp_path: Path):
    chain = fb.load(written(tmp_path, SIDECAR + "reference_configurations: {far: [-31.4, 116.18]}\n"))
    assert chain.nq == 2 and chain.closures[0].offset == 0.0
    assert np.abs(fb.closure_residual(chain, chain.references["far"])).max() < 1e-12
    fb.save(chain, tmp_path / "again.urdf")
    text = (tmp_path / "again.urdf").read_text()
    assert text.count('type="continuous"') == 2 and "lower" not in text
    again = fb.load(tmp_path / "again.urdf")
    assert again.model == chain.model
    np.testing.assert_array_equal(again.references["far"], chain.references["far"])
    fb.save(chain, tmp_path / "again.xml")
    np.testing.assert_array_equal(fb.load(tmp_path / "again.xml").references["far"], chain.references["far"])


def test_limits_of_a_coupled_joint_are_kept(tmp_path: Path):
    model = pair(2.0).model.copy()
    model.lowerPositionLimit[0], model.upperPositionLimit[0] = -1.0, 2.0
    chain = fb.ClosedChain(model, pair(2.0).closures, ("a",))
    for file in ("limited.urdf", "limited.xml"):
        fb.save(chain, tmp_path / file)
        assert 'type="continuous"' not in (tmp_path / file).read_text().split('name="b"')[0]
        again = fb.load(tmp_path / file).model
        assert (again.lowerPositionLimit[0], again.upperPositionLimit[0]) == (-1.0, 2.0)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("ratio: [[3.7, 1]]\n", "", r"ratio\[0\]: is missing; a coupling needs the ratio of each of its joints"),
        ("[[3.7, 1]]", "[[3.7]]", r"ratio\[0\]: has 1 entries; expected 2"),
        ("[[3.7, 1]]", "[[3.7, x]]", r"ratio\[0\]: 'x' must be a finite number"),
        ("[[3.7, 1]]", "[[3.7, 0]]", "ratio of joint b = 0.0 but must not be zero. Leave the joint out"),
        ("[[a, b]]", "[[a, c]]", "Unknown joint of closure a~c 'c'; known: a, b"),
        ("[[a, b]]", "[[a, a]]", "must differ. Add the ratios of one joint"),
        ("name_mot", "ratios: [1]\nname_mot", "Unknown sidecar key 'ratios'; .* Did you mean 'ratio'"),
        ("name_mot", "offset: [far]\nname_mot", r"offset\[0\]: 'far' must be a finite number"),
        ("name_mot", "offset: [1, 2]\nname_mot", "offset: has 2 entries; expected 1"),
        ("[coupling]", "[distance]", r"length\[0\]: is missing; a distance closure needs the length of its rod"),
    ],
)
def test_a_sidecar_that_couples_badly_is_refused_by_key(old, new, message, tmp_path: Path):
    assert old in SIDECAR
    with pytest.raises(FileFormatError, match=message):
        fb.load(written(tmp_path, SIDECAR.replace(old, new)))


MIMIC = '<axis xyz="0 0 1"/><mimic joint="a" multiplier="{}" offset="0.2"/></joint></robot>'


@pytest.mark.parametrize("multiplier", [3.7, -1.0, 0.0])
def test_mimic_joints_of_a_urdf_are_couplings(multiplier, tmp_path: Path):
    """q_b = multiplier q_a + offset, as URDF says; over several turns, and after saving."""
    path = written(tmp_path, "closed_loop: []\ntype: []\nname_mot: [a]\n")
    path.write_text(path.read_text().replace('<axis xyz="0 0 1"/></joint></robot>', MIMIC.format(multiplier)))
    chain = fb.load(path)
    fb.save(chain, tmp_path / "again.urdf")
    for each in (chain, fb.load(tmp_path / "again.urdf")):
        assert [c.name for c in each.closures] == ["b mimic"]
        moved = fb.drive(each, fb.motion.cycloidal(np.linspace(0.0, 1.0, 101), 0.0, 20.0))
        a, b = (moved.q[:, each.model.idx_qs[each.model.getJointId(name)]] for name in "ab")
        np.testing.assert_allclose(b, multiplier * a + 0.2, rtol=0.0, atol=1e-12)
    assert not fb.load(path, closures=()).closures
    path.with_suffix(".yaml").write_text(
        "closed_loop: []\ntype: []\nname_mot: [a]\njoint_name: [b]\njoint_type: [FIXED]\n"
    )
    assert fb.load(path).closures == () and fb.load(path).joints == ("a",)


MJCF = """<mujoco><compiler angle="radian"/><worldbody>
<body name="one"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="a"/></body>
<body name="two"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="b"/></body>
<body name="three"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="c" type="slide"/>
  <site name="s3" pos="0 0.5 0"/></body>
<body name="four"><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><joint name="d" type="ball"/>
  <site name="s4" pos="0 0 0.5"/></body></worldbody>{}</mujoco>"""


@pytest.mark.parametrize(
    ("text", "ratios", "offset"),
    [
        ('<equality><joint joint1="a"/></equality>', {"a": 1.0}, 0.0),
        ('<equality><joint joint1="a" polycoef="0.3"/></equality>', {"a": 1.0}, 0.3),
        ('<equality><joint joint1="a" joint2="b"/></equality>', {"a": 1.0, "b": -1.0}, 0.0),
        ('<equality><joint joint1="a" joint2="c" polycoef="0.2 -3 0 0 0"/></equality>', {"a": 1.0, "c": 3.0}, 0.2),
        ('<equality><joint joint1="a" joint2="b" polycoef="0.2 0"/></equality>', {"a": 1.0}, 0.2),
        (
            '<tendon><fixed name="t"><joint joint="a" coef="2"/><joint joint="b" coef="-1"/></fixed></tendon>'
            '<equality><tendon tendon1="t" polycoef="0.1 0 0 0 0"/></equality>',
            {"a": 2.0, "b": -1.0},
            0.1,
        ),
        (
            '<tendon><fixed name="t"><joint joint="a" coef="2"/></fixed><fixed name="u"><joint joint="b" coef="3"/>'
            '<joint joint="a" coef="0.5"/></fixed></tendon>'
            '<equality><tendon tendon1="t" tendon2="u" polycoef="0.1 2 0 0 0"/></equality>',
            {"a": 1.0, "b": -6.0},
            0.1,
        ),
    ],
)
def test_mujoco_and_we_read_the_same_equality(text, ratios, offset, tmp_path: Path):
    (tmp_path / "m.xml").write_text(MJCF.format(text))
    chain = fb.load(tmp_path / "m.xml", actuated=())
    (closure,) = chain.closures
    assert dict(closure.ratios) == ratios and closure.offset == offset
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "m.xml"))
    data = mujoco.MjData(model)
    data.qpos[:3] = [0.3, -0.7, 0.4]
    mujoco.mj_forward(model, data)
    q = np.r_[0.3, -0.7, 0.4, 0.0, 0.0, 0.0, 1.0]
    np.testing.assert_allclose(fb.closure_residual(chain, q), data.efc_pos, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(_jacobian(chain, q), data.efc_J.reshape(1, -1), rtol=0.0, atol=1e-14)


def test_mujoco_and_we_read_the_same_rod(tmp_path: Path):
    text = (
        '<tendon><spatial name="t"><site site="s3"/><site site="s4"/></spatial></tendon>'
        '<equality><tendon name="rod" tendon1="t" polycoef="0.1 0 0 0 0"/></equality>'
    )
    (tmp_path / "m.xml").write_text(MJCF.format(text))
    chain = fb.load(tmp_path / "m.xml", actuated=())
    assert chain.closures[0].length == pytest.approx(np.sqrt(0.5) + 0.1, abs=1e-15)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "m.xml"))
    data = mujoco.MjData(model)
    turn = pin.Quaternion(pin.rpy.rpyToMatrix(0.3, 0.5, -0.2)).coeffs()
    data.qpos[:] = [0.3, -0.7, 0.4, *np.roll(turn, 1)]
    mujoco.mj_forward(model, data)
    q = np.r_[0.3, -0.7, 0.4, turn]
    np.testing.assert_allclose(fb.closure_residual(chain, q), data.efc_pos, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(_jacobian(chain, q), data.efc_J.reshape(1, -1), rtol=0.0, atol=1e-13)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('<equality><joint joint1="a" joint2="z"/></equality>', "Unknown joint 'z'; known: a, b, c, d"),
        (
            '<equality><joint joint1="a" joint2="d"/></equality>',
            "joint d of closure .* must have one degree of freedom",
        ),
        ('<equality><joint joint1="a" joint2="b" polycoef="0 1 2 0 0"/></equality>', "is not linear"),
        ('<equality><joint joint1="a" joint="b"/></equality>', "Unknown attribute of <joint_equality> 'joint'"),
        ('<equality><tendon tendon1="t"/></equality>', "Unknown tendon 't'"),
        ("<equality><tendon/></equality>", "needs the attribute 'tendon1'"),
        (
            '<tendon><spatial name="t"><site site="s3"/><site site="s4"/><site site="s3"/></spatial></tendon>'
            '<equality><tendon tendon1="t"/></equality>',
            "only a spatial tendon between two sites",
        ),
        (
            '<tendon><spatial name="t"><site site="s3"/><site site="s9"/></spatial></tendon>'
            '<equality><tendon tendon1="t"/></equality>',
            "Unknown site 's9'",
        ),
        (
            '<tendon><fixed name="t"><joint joint="a" coef="1"/></fixed><spatial name="u"><site site="s3"/>'
            '<site site="s4"/></spatial></tendon><equality><tendon tendon1="t" tendon2="u"/></equality>',
            "ties a spatial tendon to another; only fixed ones",
        ),
        (
            '<tendon><fixed name="t" frictionloss="2"><joint joint="a" coef="1"/></fixed></tendon>',
            "frictionloss of tendons",
        ),
        (
            '<equality><connect name="h" site1="s3" site2="s4"/></equality>'
            '<custom><numeric name="revolute closure h" data="0 0 1"/></custom>',
            "is marked as a hinge but lacks its second connect 'h axis'",
        ),
        ('<equality><flex name="f"/></equality>', "Unknown equality 'flex'; known: connect, joint, tendon, weld"),
    ],
)
def test_equalities_that_are_no_coupling_are_refused_by_name(text, message, tmp_path: Path):
    (tmp_path / "m.xml").write_text(MJCF.format(text))
    with pytest.raises(FileFormatError, match=message):
        fb.load(tmp_path / "m.xml")


@pytest.mark.parametrize(
    ("ratios", "offset", "message"),
    [
        ({}, 0.0, "must name one joint at least"),
        (("a", "b"), 0.0, "must map joint names to numbers"),
        ({"a": 0.0, "b": 1.0}, 0.0, "ratio of joint a = 0.0 but must not be zero"),
        ({"a": np.nan}, 0.0, "ratio of joint a = nan but must be finite"),
        ({"a": np.inf}, 0.0, "ratio of joint a = inf but must be finite"),
        ({"a": "two"}, 0.0, "ratio of joint a = 'two' but must be one number"),
        ({1: 2.0}, 0.0, "joints of a coupling = 1 but must hold objects of type str"),
        ({"": 2.0}, 0.0, "must have names"),
        ({"a": 1.0}, np.nan, "offset of a coupling = nan but must be finite"),
    ],
)
def test_ratios_that_couple_nothing_are_refused(ratios, offset, message):
    with pytest.raises(InvalidInputError, match=message):
        Coupling(ratios, offset)


def test_joints_that_cannot_be_coupled_are_refused_by_name():
    model = pair(1.0).model.copy()
    add(model, 0, pin.JointModelSpherical(), at(), "ball", body())
    with pytest.raises(UnknownNameError, match=r"joint of closure a~bb 'bb'; known: a, b, ball. Did you mean 'b'"):
        fb.ClosedChain(model, (Coupling({"a": 1.0, "bb": 1.0}),), ())
    with pytest.raises(InvalidInputError, match="joint ball of closure a~ball = 'nv = 3' but must have one degree"):
        fb.ClosedChain(model, (Coupling({"a": 1.0, "ball": 1.0}),), ())
    with pytest.raises(InvalidInputError, match=r"closure names = .* but must differ"):
        fb.ClosedChain(model, (Coupling({"a": 1.0}), Coupling({"a": 2.0})), ())
    with pytest.raises(InvalidInputError, match=r"ratio of a coupling = \(1.0,\) but must hold 2 numbers"):
        fb.Closure(("a", "b"), "coupling", ratio=(1.0,))


def test_a_coupling_cannot_be_changed():
    gear = Coupling({"a": 1.0, "b": 2.0})
    with pytest.raises(TypeError):
        gear.ratios["a"] = 3.0
    given = {"a": 1.0}
    kept = Coupling(given)
    assert eval(repr(gear), {"Coupling": Coupling}).values() == gear.values()
    given["a"] = 5.0
    assert kept.ratios["a"] == 1.0
