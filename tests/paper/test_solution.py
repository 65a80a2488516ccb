"""The closed-form road against 50-digit reference values, Pinocchio, and its own laws."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from paper_cases import states

import fivebar_pin as fb
from fivebar_pin import paper
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError, UnknownNameError
from fivebar_pin.motion import Motion

REFERENCE = Path(__file__).parents[1] / "data" / "five_bar_case_I.csv"
GRAVITY = (0.7, -9.81, 0.3)
ANGLES = ("psi", "theta", "phi", "gamma")
FORCES = ("f01", "f12", "f23", "f34", "f40")


def columns(s):
    """Return the columns of the reference table from a solution."""
    found = {}
    for i, name in enumerate(ANGLES):
        found |= {name: s.angles[:, i], f"d{name}": s.rates[:, i], f"dd{name}": s.accelerations[:, i]}
    for i, name in enumerate(FORCES):
        found |= {f"{name}x": s.joint_forces[:, i, 0], f"{name}y": s.joint_forces[:, i, 1]}
    found |= {"tau1": s.torque[:, 0], "tau4": s.torque[:, 1], "M": s.shaking_moment[:, 2]}
    found |= {"Fx": s.shaking_force[:, 0], "Fy": s.shaking_force[:, 1], "comx": s.com[:, 0], "comy": s.com[:, 1]}
    return found | {"t": s.t}


def test_every_column_of_the_50_digit_reference_is_met():
    """Case I, unbalanced, default motion: every column within 1e-12 of its maximum."""
    table = np.genfromtxt(REFERENCE, delimiter=",", names=True)
    found = columns(paper.solve(paper.table_1("I", "unbalanced"), paper.default_motion()))
    assert set(found) == set(table.dtype.names)
    for name, values in found.items():
        error = np.abs(values - table[name]).max() / np.abs(table[name]).max()
        assert error <= 1e-12, f"{name}: {error:.1e}"


def pinocchio_road(linkage, s, gravity):
    """Return torque, force and moment about O1 on the frame, and COM, from a free-floating copy of the tree."""
    chain = linkage.chain(gravity=gravity)
    model, data = chain.model, chain.model.createData()
    t, torque, wrench, com = s.trajectory, [], [], []
    for k in range(len(s)):
        q, v, a = t.q[k], t.v[k], t.a[k]
        tau = pin.rnea(model, data, q, v, a)
        torque.append(t.N[k].T @ tau)
        g = model.gravity.linear.copy()
        com.append(pin.centerOfMass(model, data, q, v, a).copy())
        pin.computeCentroidalMomentumTimeVariation(model, data, q, v, a)
        m = pin.computeTotalMass(model)
        moment = -data.dhg.angular - np.cross(com[-1], data.dhg.linear)
        wrench.append([-data.dhg.linear, moment, m * g - data.dhg.linear, moment + np.cross(com[-1], m * g)])
    return np.array(torque), *np.swapaxes(wrench, 0, 1), np.array(com)


@settings(max_examples=120, deadline=None)
@given(states())
def test_closed_form_equals_pinocchio_on_random_linkages(state):
    """Torque, shaking wrench with gravity in all directions and COM, any geometry, both assembly modes."""
    linkage, mode, q, v, a, O3 = state
    s = paper.solve_states(linkage, q, v, a, mode=mode, gravity=GRAVITY)
    size = linkage.lengths.max()
    reached = linkage.lengths[0] * np.exp(1j * q[0, 0]) + linkage.lengths[1] * np.exp(1j * s.theta[0])
    assert abs(reached - O3) <= 1e-12 * size
    assert s.closure_residual[0] <= 1e-13 * size
    torque, force, moment, frame_force, frame_moment, com = pinocchio_road(linkage, s, GRAVITY)
    weight = np.abs(s.joint_forces).max() + np.abs(frame_force).max()
    np.testing.assert_allclose(s.torque, torque, rtol=0, atol=1e-11 * weight * size)
    np.testing.assert_allclose(s.shaking_force, force, rtol=0, atol=1e-11 * weight)
    np.testing.assert_allclose(s.shaking_moment, moment, rtol=0, atol=1e-11 * weight * size)
    np.testing.assert_allclose(s.frame_force, frame_force, rtol=0, atol=1e-11 * weight)
    np.testing.assert_allclose(s.frame_moment, frame_moment, rtol=0, atol=1e-11 * weight * size)
    np.testing.assert_allclose(s.com, com, rtol=0, atol=1e-13 * size)


@settings(max_examples=60, deadline=None)
@given(states())
def test_motor_power_is_the_rate_of_energy(state):
    """tau . q' = dT/dt, the rate taken by a central difference of the kinetic energy along the same motion."""
    linkage, mode, q, v, a, _ = state
    s = paper.solve_states(linkage, q, v, a, mode=mode)
    h = 1e-4 / (np.abs(s.rates).max() + np.sqrt(np.abs(s.accelerations).max()))
    ahead, behind = (
        paper.solve_states(linkage, q + e * v + e * e / 2 * a, v + e * a, a, mode=mode).energy[0] for e in (h, -h)
    )
    scale = np.abs(s.torque * v).sum() + s.energy[0] / h * 1e-4
    assert (s.torque * v).sum() == pytest.approx((ahead - behind) / (2 * h), abs=1e-5 * scale)


@settings(max_examples=60, deadline=None)
@given(states())
def test_newton_euler_holds_for_every_link(state):
    """(22a), (22b): forces and moments on each link give its momentum rate, with gravity."""
    linkage, mode, q, v, a, _ = state
    s = paper.solve_states(linkage, q, v, a, mode=mode, gravity=GRAVITY)
    r, b, _ = paper.matrices.vectors(s)
    t = paper.matrices.twist_rate(s).reshape(4, 3)
    f = s.joint_forces[0]
    cross = lambda x, y: x[0] * y[1] - x[1] * y[0]  # noqa: E731
    scale = np.abs(f).max() + np.abs(t[:, 1:] * linkage.masses[:, None]).max()
    motor = (s.torque[0, 0], 0.0, 0.0, s.torque[0, 1])
    for i in range(4):
        net = f[i] - f[i + 1] + linkage.masses[i] * np.array(GRAVITY[:2])
        np.testing.assert_allclose(net, linkage.masses[i] * t[i, 1:], rtol=0, atol=1e-11 * scale)
        moment = cross(-r[0, i], f[i]) + cross(b[0, i], -f[i + 1]) + motor[i]
        assert moment == pytest.approx(linkage.inertias[i] * t[i, 0], abs=1e-11 * scale * linkage.lengths.max())


@pytest.mark.parametrize("case", ["I", "II"])
@pytest.mark.parametrize("mode", paper.AssemblyMode)
def test_trajectory_is_consistent_in_the_layout_of_the_chain(case, mode):
    """v = N v_actuated, J N = 0 (measured on Pinocchio's frames), a = v', closure below 1e-13 m."""
    linkage, motion = paper.table_1(case, "unbalanced"), paper.default_motion(samples=4001)
    s = paper.solve(linkage, motion, mode=mode)
    t = s.trajectory
    assert t.worst_closure <= 1e-13
    np.testing.assert_allclose((t.N @ motion.v[..., None])[..., 0], t.v, atol=1e-12 * np.abs(t.v).max())
    np.testing.assert_allclose(np.gradient(t.q, t.t, axis=0)[2:-2], t.v[2:-2], atol=2e-4 * np.abs(t.v).max())
    np.testing.assert_allclose(np.gradient(t.v, t.t, axis=0)[2:-2], t.a[2:-2], atol=2e-3 * np.abs(t.a).max())
    chain = linkage.chain()
    data = chain.model.createData()
    pin.computeJointJacobians(chain.model, data, t.q[777])
    pin.framesForwardKinematics(chain.model, data, t.q[777])
    J = [
        pin.getFrameJacobian(chain.model, data, chain.model.getFrameId(f), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)[:3]
        for f in chain.closures[0].frames
    ]
    assert np.abs((J[1] - J[0]) @ t.N[777]).max() <= 1e-15


def test_angles_stay_continuous_over_many_turns():
    """A linkage whose coupler turns with its crank: no jump of 2 pi."""
    linkage = paper.FiveBar((0.5, 0.6, 0.6, 0.5, 0.1), (1, 1, 1, 1), (1, 1, 1, 1), (0.5,) * 4, (0.0,) * 4)
    t = np.linspace(0.0, 1.0, 5000)
    turn = 6.0 * np.pi * t
    one = np.ones_like(t)
    motion = Motion(
        t, np.stack([turn, turn + 1.2], axis=1), np.stack([6 * np.pi * one] * 2, axis=1), np.zeros((5000, 2))
    )
    s = paper.solve(linkage, motion)
    assert np.abs(np.diff(s.angles, axis=0)).max() < 0.1
    assert s.theta[-1] - s.theta[0] == pytest.approx(6 * np.pi)


def test_gravity_alone_loads_a_linkage_at_rest():
    """At rest the frame carries the weight at the mass centre, and the torques are minus the gravity work."""
    linkage = paper.table_1("II", "unbalanced")
    zero = np.zeros((1, 2))
    q = np.array([[0.4, 1.3]])
    s = paper.solve_states(linkage, q, zero, zero, gravity=GRAVITY)
    weight = linkage.masses.sum() * np.array(GRAVITY)
    np.testing.assert_allclose(s.frame_force[0], weight, rtol=1e-13)
    np.testing.assert_allclose(s.frame_moment[0], np.cross(s.com[0], weight), atol=1e-14)
    assert not s.shaking_force.any() and not s.shaking_moment.any()
    for k in range(2):
        h = np.eye(2)[k] * 1e-6
        up, down = (paper.solve_states(linkage, q + x, zero, zero).com[0] for x in (h, -h))
        assert s.torque[0, k] == pytest.approx(-weight @ (up - down) / 2e-6, rel=1e-7)


def test_results_are_read_only():
    """Nothing can be written into a solution."""
    s = paper.solve(paper.table_1("I", "unbalanced"), paper.default_motion(samples=5))
    names = ("angles", "rates", "accelerations", "partials", "torque", "joint_forces", "shaking_force", "frame_force")
    for name in (*names, "com"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(s, name)[0] = 0.0
    assert repr(s) == "Solution(5 samples, left mode)"
    assert s.joint_forces.shape == (5, 5, 2)
    np.testing.assert_array_equal(s.phi, s.angles[:, 2])


def swing(linkage, start, stop, samples=50):
    """Return link 1 held, link 4 moved evenly from start to stop [rad]."""
    t = np.linspace(0.0, 1.0, samples)
    one, zero = np.ones_like(t), np.zeros_like(t)
    gamma = start + (stop - start) * t
    return Motion(
        t, np.stack([zero, gamma], axis=1), np.stack([zero, (stop - start) * one], axis=1), np.zeros((samples, 2))
    )


def test_a_motion_that_leaves_the_reach_names_sample_time_and_gap():
    """The worst sample is the last one; its gap is |O2 O4| - a2 - a3."""
    linkage = replace(paper.table_1("I", "unbalanced"), lengths=[0.02, 0.05, 0.05, 0.1, 0.08])
    with pytest.raises(AssemblyError, match=r"sample 49, t = 1 s: .* open by 0.06 m") as caught:
        paper.solve(linkage, swing(linkage, 2.0, 0.0))
    assert (caught.value.sample, caught.value.time, caught.value.closure) == (49, 1.0, "O3")
    assert caught.value.residual == pytest.approx(0.06)


def test_sample_numbers_count_from_the_start_of_the_motion():
    """Also late in a long motion."""
    linkage = replace(paper.table_1("I", "unbalanced"), lengths=[0.02, 0.05, 0.05, 0.1, 0.08])
    with pytest.raises(AssemblyError) as caught:
        paper.solve(linkage, swing(linkage, 2.5, 1.35, samples=6000))
    assert caught.value.sample == 5999


def test_a_singularity_between_two_samples_is_found():
    """gamma swings through 0, where the stretched dyad is 1 um too short: both samples beside it can be assembled."""
    linkage = replace(paper.table_1("I", "unbalanced"), lengths=[0.02, 0.08, 0.08 - 1e-6, 0.1, 0.08])
    with pytest.raises(SingularityError, match=r"between sample 24, t = .*, and sample 25") as caught:
        paper.solve(linkage, swing(linkage, -0.5, 0.5))
    assert caught.value.sample == 24
    longer = replace(linkage, lengths=[0.02, 0.08, 0.08 + 1e-6, 0.1, 0.08])
    assert len(paper.solve(longer, swing(longer, -0.5, 0.5))) == 50


def test_a_folded_dyad_whose_ends_meet_between_samples_is_found():
    """With a2 = a3, O4 passes through O2: the side of O3 has no meaning there."""
    linkage = replace(paper.table_1("I", "unbalanced"), lengths=[0.02, 0.1, 0.1, 0.06, 0.08])
    with pytest.raises(SingularityError, match="between sample 24"):
        paper.solve(linkage, swing(linkage, np.pi - 0.5, np.pi + 0.5))


@pytest.mark.parametrize("a2", [0.1, 0.11])
def test_a_jump_from_rest_to_rest_through_a_singularity_is_found(a2):
    """Rates of zero at both samples do not hide that the straight way between them passes O2 over O4."""
    linkage = paper.FiveBar([0.1, a2, 0.1, 0.1, 0.1], [0.1] * 4, [1e-4] * 4, [0.5] * 4, [0.0] * 4)
    meet = np.array([np.pi / 3.0, 2.0 * np.pi / 3.0])
    motion = Motion(np.arange(2.0), [meet - 0.4, meet + 0.4], np.zeros((2, 2)), np.zeros((2, 2)))
    with pytest.raises(SingularityError, match="between sample 0, t = 0 s, and sample 1"):
        paper.solve(linkage, motion)
    beside = Motion(motion.t, [meet - 0.4, meet - 0.3], motion.v, motion.a)
    assert len(paper.solve(linkage, beside)) == 2


def test_input_of_the_wrong_form_is_refused():
    """Three motors, wrong shapes, unknown modes."""
    linkage, motion = paper.table_1("I", "unbalanced"), paper.default_motion(samples=5)
    three = Motion(motion.t, *(np.zeros((5, 3)) for _ in range(3)))
    with pytest.raises(InvalidInputError, match=r"shape of motion.q = \(5, 3\) but must be \(n, 2\)"):
        paper.solve(linkage, three)
    with pytest.raises(UnknownNameError, match="assembly mode 'middle'"):
        paper.solve(linkage, motion, mode="middle")
    with pytest.raises(InvalidInputError, match="shape of gravity"):
        paper.solve(linkage, motion, gravity=9.81)
    with pytest.raises(InvalidInputError, match="shape of v"):
        paper.solve_states(linkage, motion.q, motion.v[:2], motion.a)


def test_closure_residual_is_the_one_of_the_chain():
    """Opened on purpose, the loop is as far open as the chain's own residual says, component by component."""
    linkage = paper.table_1("I", "unbalanced")
    s = paper.solve(linkage, paper.default_motion(samples=7))
    wrong = replace(s, angles=s.angles + np.array([0.01, -0.02, 0.03, 0.0]))
    rows = [fb.closure_residual(linkage.chain(), q) for q in wrong.trajectory.q]
    expected = np.abs(rows).max(axis=1)
    assert expected.min() > 1e-4
    np.testing.assert_allclose(wrong.closure_residual, expected, rtol=1e-12)
