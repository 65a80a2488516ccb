"""Inverse dynamics: the reference table, momentum, energy, virtual work, reactions, friction, and what stays open."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import (
    TILTED,
    bennett,
    double_four_bar,
    five_bar,
    four_bar,
    rscr,
    rssr,
    slider_crank,
    welded_four_bar,
)

import fivebar_pin as fb
from fivebar_pin import Motion, paper
from fivebar_pin import motion as laws
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.mechanism.loops import loops_of

TABLE = Path(__file__).parents[1] / "data" / "five_bar_case_I.csv"


def swinging(*means: float, amplitude: float = 0.25, n: int = 40) -> Motion:
    t = np.linspace(0.0, 1.0, n)
    return laws.combine(*(laws.harmonic(t, m, amplitude, period=0.6, phase=k) for k, m in enumerate(means)))


def with_drive_train(chain: fb.ClosedChain) -> fb.ClosedChain:
    """Return the chain with armature, damping and dry friction in every joint."""
    model = chain.model.copy()
    model.armature = np.linspace(0.1, 0.3, model.nv)
    model.damping = np.linspace(0.2, 0.5, model.nv)
    model.upperDryFrictionLimit = np.linspace(0.3, 0.7, model.nv)
    model.lowerDryFrictionLimit = -model.upperDryFrictionLimit
    return fb.ClosedChain(model, chain.closures, chain.actuated)


CASES = {
    "five-bar": (five_bar(), swinging(2.0, 1.0), None),
    "five-bar, tilted, hinge closure": (five_bar(base=TILTED, kind="revolute"), swinging(2.0, 1.0), None),
    "four-bar, unbounded joints": (four_bar(joint=pin.JointModelRUBZ), swinging(0.9, amplitude=2.0), None),
    "four-bar, welded": (welded_four_bar(base=TILTED), swinging(0.9), None),
    "slider-crank": (slider_crank(base=TILTED), swinging(0.9, amplitude=2.0), None),
    "RSSR": (rssr(base=TILTED), swinging(0.3), None),
    "RSCR": (rscr()[0], swinging(0.5, amplitude=0.08), rscr()[1]),
    "Bennett": (bennett()[0], swinging(1.5, amplitude=0.5), bennett()[1]),
    "double four-bar": (double_four_bar(), swinging(1.4), np.array([1.4, 1.4, -1.4, -1.4, 1.4])),
    "five-bar with drive train": (with_drive_train(five_bar()), swinging(2.0, 1.0), None),
}
EACH = pytest.mark.parametrize("case", CASES, ids=str)


@pytest.fixture(scope="module")
def loads() -> dict[str, fb.Loads]:
    """Loads of every case, about a point off the origin."""
    out = {}
    for name, (chain, motion, near) in CASES.items():
        start = None if near is None else fb.assemble(chain, motion.q[0], near)
        out[name] = fb.inverse_dynamics(chain, fb.drive(chain, motion, start), about=(0.2, -0.4, 0.3))
    return out


def simple(x: fb.Loads) -> tuple[fb.ClosedChain, fb.Trajectory]:
    return x.chain, x.trajectory


def test_torques_forces_and_motion_meet_the_reference_table():
    table = np.genfromtxt(TABLE, delimiter=",", names=True)
    linkage = paper.table_1("I", "unbalanced")
    motion = paper.default_motion(samples=table.size)
    chain = linkage.chain()
    trajectory = fb.drive(chain, motion, linkage.configuration(*motion.q[0], mode=paper.AssemblyMode.LEFT))
    loads = fb.inverse_dynamics(chain, trajectory)
    gamma, phi, psi, theta = 0, 1, 2, 3
    absolute = {}
    for prefix, x in (("", trajectory.q), ("d", trajectory.v), ("dd", trajectory.a)):
        absolute |= {
            f"{prefix}psi": x[:, psi],
            f"{prefix}gamma": x[:, gamma],
            f"{prefix}theta": x[:, psi] + x[:, theta],
            f"{prefix}phi": x[:, gamma] + x[:, phi],
        }
    joint, closure = loads.joint_reactions, loads.closure_reactions[:, 0]
    forces = {
        "f01": joint[:, psi],
        "f12": joint[:, theta],
        "f34": -joint[:, phi],
        "f40": -joint[:, gamma],
        "f23": closure,
    }
    columns = absolute | {f"{f}{axis}": w[:, k] for f, w in forces.items() for k, axis in enumerate("xy")}
    columns |= {"tau1": loads.torque[:, 0], "tau4": loads.torque[:, 1], "M": loads.shaking_moment[:, 2]}
    columns |= {"Fx": loads.shaking_force[:, 0], "Fy": loads.shaking_force[:, 1]}
    columns |= {"comx": loads.com[:, 0], "comy": loads.com[:, 1], "t": trajectory.t}
    assert set(columns) == set(table.dtype.names)
    for name, values in columns.items():
        reference = table[name]
        gap = values - reference
        if name in ("psi", "gamma", "theta", "phi"):
            gap = np.mod(gap + np.pi, 2.0 * np.pi) - np.pi
        assert np.abs(gap).max() <= 1e-12 * np.abs(reference).max(), name


@EACH
def test_power_of_the_motors_is_the_rate_of_energy(loads, case):
    assert loads[case].power_residual() <= 1e-12


@EACH
def test_work_of_the_motors_is_the_gain_of_energy(case):
    # Integrated over the motion by Gauss' rule, so this does not share the rates with the library's own residual.
    chain, motion, near = CASES[case]
    x, w = np.polynomial.legendre.leggauss(60)
    t = 0.15 * (x + 1.0)
    t = np.r_[0.0, t, 0.3]
    means = motion.q[0]
    path = [laws.harmonic(t, m - 0.1 * np.cos(k), 0.1, period=0.6, phase=float(k)) for k, m in enumerate(means)]
    start = fb.assemble(chain, means, near)
    loads = fb.inverse_dynamics(chain, fb.drive(chain, laws.combine(*path), start))
    v = loads.trajectory.v
    supplied = np.sum(loads.torque * v[:, chain.actuated_index], axis=1)
    b, f = np.array(chain.model.damping), np.array(chain.model.upperDryFrictionLimit)
    lost = np.sum((b * v + f * np.sign(v)) * v, axis=1)
    work = float(0.15 * w @ (supplied - lost)[1:-1])
    energy = loads.kinetic_energy + loads.rotor_energy + loads.potential_energy
    scale = float(np.abs(energy - energy[0]).max())
    tolerance = 1e-3 if np.any(f) else 1e-9  # dry friction has a kink where a joint turns back
    assert work == pytest.approx(energy[-1] - energy[0], abs=tolerance * scale)


@EACH
def test_energies_are_pinocchios(loads, case):
    chain, trajectory = simple(loads[case])
    model = chain.model.copy()
    model.armature = np.zeros(model.nv)
    data = model.createData()
    for i in range(0, len(trajectory), 7):
        kinetic = pin.computeKineticEnergy(model, data, trajectory.q[i], trajectory.v[i])
        potential = pin.computePotentialEnergy(model, data, trajectory.q[i])
        assert loads[case].kinetic_energy[i] == pytest.approx(kinetic, rel=1e-12)
        rotors = pin.computeKineticEnergy(chain.model, data, trajectory.q[i], trajectory.v[i]) - kinetic
        assert loads[case].rotor_energy[i] == pytest.approx(rotors, rel=1e-9, abs=1e-12)
        assert loads[case].potential_energy[i] == pytest.approx(potential, rel=1e-12, abs=1e-12)


@EACH
def test_shaking_wrench_is_minus_the_rate_of_momentum_and_the_frame_carries_the_weight_besides(loads, case):
    chain, trajectory = simple(loads[case])
    assert loads[case].momentum_residual() <= 1e-12
    model, g = chain.model, np.array(chain.model.gravity.linear)
    data = model.createData()
    for i in range(0, len(trajectory), 7):
        rate = pin.computeCentroidalMomentumTimeVariation(
            model, data, trajectory.q[i], trajectory.v[i], trajectory.a[i]
        )
        com, scale = data.com[0], 1.0 + float(np.abs(rate.vector).max())
        arm = com - loads[case].about
        moment = -rate.angular - np.cross(arm, rate.linear)
        np.testing.assert_allclose(loads[case].com[i], com, rtol=0.0, atol=1e-13)
        np.testing.assert_allclose(loads[case].shaking_force[i], -rate.linear, rtol=0.0, atol=1e-12 * scale)
        np.testing.assert_allclose(loads[case].shaking_moment[i], moment, rtol=0.0, atol=1e-12 * scale)
        weight = chain.mass * g
        np.testing.assert_allclose(loads[case].frame_force[i], weight - rate.linear, rtol=0.0, atol=1e-12 * scale)
        np.testing.assert_allclose(
            loads[case].frame_moment[i], moment + np.cross(arm, weight), rtol=0.0, atol=1e-12 * scale
        )


@EACH
def test_torque_satisfies_the_equations_of_motion(loads, case):
    """M a + h = S^T tau + J^T lambda with the multipliers that are reported."""
    chain, trajectory = simple(loads[case])
    loops = loops_of(chain)
    poses = loops.tree.poses(trajectory.q)
    J = loops.see(poses.q).J
    model, data = chain.model, chain.model.createData()
    b, f = np.array(model.damping), np.array(model.upperDryFrictionLimit)
    for i in range(0, len(trajectory), 5):
        q, v, a = trajectory.q[i], trajectory.v[i], trajectory.a[i]
        left = pin.rnea(model, data, q, v, a) + b * v + f * np.sign(v)
        right = J[i].T @ loads[case].reactions.multipliers[i]
        right[chain.actuated_index] += loads[case].torque[i]
        np.testing.assert_allclose(left, right, rtol=0.0, atol=1e-11 * (1.0 + np.abs(left).max()))
    assert loads[case].reactions.mismatch <= 1e-11 * (1.0 + np.abs(loads[case].tree_torque).max())


@EACH
def test_forces_of_ground_joints_and_closures_add_up_to_the_frame_force(loads, case):
    x = loads[case]
    chain = x.chain
    total = np.zeros_like(x.frame_force)
    for j in range(1, chain.model.njoints):
        if chain.model.parents[j] == 0:
            total -= x.joint_reactions[:, j - 1, :3]
    for k, anchored in enumerate(loops_of(chain).anchored):
        if 0 in anchored.joints:
            sign = -1.0 if anchored.joints[0] == 0 else 1.0
            total += sign * x.closure_reactions[:, k, :3]
    known = np.isfinite(total)
    scale = 1.0 + np.abs(x.frame_force).max()
    np.testing.assert_allclose(total[known], x.frame_force[known], rtol=0.0, atol=1e-11 * scale)
    if case in ("five-bar", "RSSR", "RSCR", "double four-bar"):
        assert known.any()


@pytest.mark.parametrize("case", ["RSSR", "RSCR"])
def test_spatial_loops_without_redundancy_leave_nothing_open(loads, case):
    assert np.isfinite(loads[case].joint_reactions).all()
    assert np.isfinite(loads[case].closure_reactions).all()


@pytest.mark.parametrize("kind", ["3d", "revolute"])
def test_planar_loops_leave_exactly_the_out_of_plane_components_open(kind):
    chain, motion = five_bar(kind=kind), swinging(2.0, 1.0)
    loads = fb.inverse_dynamics(chain, fb.drive(chain, motion))
    joint = np.isfinite(loads.joint_reactions)
    np.testing.assert_array_equal(joint, np.broadcast_to(np.array([1, 1, 0, 0, 0, 1], dtype=bool), joint.shape))
    closure = np.isfinite(loads.closure_reactions)
    # A point closure carries no moment at all, a hinge one only across its axis.
    expected = [1, 1, 0, 1, 1, 1] if kind == "3d" else [1, 1, 0, 0, 0, 1]
    np.testing.assert_array_equal(closure, np.broadcast_to(np.array(expected, dtype=bool), closure.shape))
    scale = np.abs(loads.closure_reactions[:, 0, :2]).max()
    np.testing.assert_allclose(loads.closure_reactions[:, 0, 5], 0.0, rtol=0.0, atol=1e-13 * scale)


def test_closed_and_open_cut_give_the_same_reactions():
    """The same four-bar cut at the coupler or welded to the ground: torque, shaking wrench, joint forces agree."""
    cut, welded, motion = four_bar(), welded_four_bar(), swinging(0.9)
    inertias = cut.model.inertias
    # In the serial tree the rocker's frame sits at the coupler pin, turned by half a turn, 0.9 from the ground.
    flip = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, np.pi), np.array([0.9, 0.0, 0.0]))
    same = welded.with_inertias(
        {"crank": inertias[1], "coupler": inertias[2], "rocker": flip.act(inertias[3]), "ground": pin.Inertia.Zero()}
    )
    q = fb.assemble(cut, motion.q[0])
    pins = [np.array([0.4 * np.cos(q[0]), 0.4 * np.sin(q[0])])]
    far = pins[0] + 1.1 * np.array([np.cos(q[0] + q[1]), np.sin(q[0] + q[1])])
    to_ground = np.arctan2(-far[1], 1.0 - far[0])
    near = np.array([q[0], q[1], to_ground - q[0] - q[1], -to_ground])
    a = fb.inverse_dynamics(cut, fb.drive(cut, motion, q))
    b = fb.inverse_dynamics(same, fb.drive(same, motion, near))
    np.testing.assert_allclose(a.torque, b.torque, rtol=0.0, atol=1e-11)
    for name in ("shaking_force", "shaking_moment", "frame_force", "frame_moment"):
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=0.0, atol=1e-11)
    for k in (0, 1):
        np.testing.assert_allclose(a.joint_reactions[:, k, :2], b.joint_reactions[:, k, :2], rtol=0.0, atol=1e-10)
    # The force by the coupler on the rocker: closure of one, joint of the other.
    np.testing.assert_allclose(a.closure_reactions[:, 0, :2], b.joint_reactions[:, 2, :2], rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("swapped", ["shaking_force", "shaking_moment", "frame_force", "frame_moment"])
def test_momentum_residual_tells_when_a_wrench_is_not_what_its_name_says(loads, swapped):
    x = loads["RSSR"]
    other = swapped.replace("shaking", "frame") if "shaking" in swapped else swapped.replace("frame", "shaking")
    x = replace(x, external={x.chain.closures[0].frames[0]: np.tile([3.0, 1.0, 2.0, 0.5, 0.2, 0.1], (40, 1))})
    assert replace(loads["RSSR"]).momentum_residual() <= 1e-12
    assert x.momentum_residual() > 1e-3  # a force that the frame does not carry
    assert replace(loads["RSSR"], **{swapped: getattr(loads["RSSR"], swapped) + 1e-3}).momentum_residual() > 1e-6
    heavy = five_bar()
    y = fb.inverse_dynamics(heavy, fb.drive(heavy, swinging(2.0, 1.0)))
    assert replace(y, **{swapped: getattr(y, other)}).momentum_residual() > 1e-3


def test_moment_about_another_point_shifts_with_the_force():
    chain, motion = five_bar(base=TILTED), swinging(2.0, 1.0)
    trajectory = fb.drive(chain, motion)
    a = fb.inverse_dynamics(chain, trajectory)
    b = fb.inverse_dynamics(chain, trajectory, about=(0.7, -0.3, 1.1))
    shifted = a.shaking_moment - np.cross([0.7, -0.3, 1.1], a.shaking_force)
    np.testing.assert_allclose(b.shaking_moment, shifted, rtol=0.0, atol=1e-12 * np.abs(a.shaking_moment).max())
    shifted = a.frame_moment - np.cross([0.7, -0.3, 1.1], a.frame_force)
    np.testing.assert_allclose(b.frame_moment, shifted, rtol=0.0, atol=1e-12 * np.abs(a.frame_moment).max())
    np.testing.assert_array_equal(a.shaking_force, b.shaking_force)
    np.testing.assert_array_equal(a.frame_force, b.frame_force)
    np.testing.assert_array_equal(a.torque, b.torque)


@pytest.mark.parametrize("build", [five_bar, slider_crank, rssr], ids=["five-bar", "slider-crank", "RSSR"])
def test_gravity_as_external_forces_changes_nothing(build):
    chain = build(base=TILTED)
    chain = chain.with_gravity([0.5, -3.0, 7.0])
    motion = swinging(*([2.0, 1.0] if chain.na == 2 else [0.3]))
    trajectory = fb.drive(chain, motion)
    inside = fb.inverse_dynamics(chain, trajectory)
    model = chain.model.copy()
    for j in range(1, model.njoints):
        model.addFrame(
            pin.Frame(f"centre{j}", j, 0, pin.SE3(np.eye(3), model.inertias[j].lever), pin.FrameType.OP_FRAME)
        )
    model.gravity.linear = np.zeros(3)
    free = fb.ClosedChain(model, chain.closures, chain.actuated)
    weights = {
        f"centre{j}": np.r_[model.inertias[j].mass * np.array([0.5, -3.0, 7.0]), 0.0, 0.0, 0.0]
        for j in range(1, model.njoints)
    }
    outside = fb.inverse_dynamics(free, trajectory, external=weights)
    for name in ("shaking_force", "shaking_moment"):
        same = 1e-14 * inside.scale(name)
        np.testing.assert_allclose(getattr(inside, name), getattr(outside, name), rtol=0.0, atol=same)
    for name in ("torque", "frame_force", "frame_moment", "joint_reactions", "closure_reactions"):
        a, b = getattr(inside, name), getattr(outside, name)
        np.testing.assert_array_equal(np.isnan(a), np.isnan(b))
        a, b = np.nan_to_num(a), np.nan_to_num(b)
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-11 * np.abs(inside.frame_force).max())
    assert outside.power_residual() <= 1e-12
    assert outside.momentum_residual() <= 1e-12


def test_external_wrench_enters_by_virtual_work():
    chain, motion = rssr(base=TILTED), swinging(0.3)
    trajectory = fb.drive(chain, motion)
    wrench = np.random.default_rng(3).normal(size=(len(motion), 6))
    frame = chain.closures[0].frames[0]
    bare = fb.inverse_dynamics(chain, trajectory)
    loaded = fb.inverse_dynamics(chain, trajectory, external={frame: wrench})
    data, fid = chain.model.createData(), chain.model.getFrameId(frame)
    for i in range(len(motion)):
        J = pin.computeFrameJacobian(chain.model, data, trajectory.q[i], fid, pin.LOCAL_WORLD_ALIGNED)
        work = trajectory.N[i].T @ J.T @ wrench[i]
        np.testing.assert_allclose(bare.torque[i] - loaded.torque[i], work, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(loaded.frame_force - bare.frame_force, wrench[:, :3], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(loaded.shaking_force, bare.shaking_force, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(loaded.shaking_moment, bare.shaking_moment, rtol=0.0, atol=1e-14)
    assert loaded.power_residual() <= 1e-12
    assert loaded.momentum_residual() <= 1e-12


def test_wrench_on_the_ground_only_reaches_the_ground():
    chain, motion = slider_crank(), swinging(0.9)
    trajectory = fb.drive(chain, motion)
    bare = fb.inverse_dynamics(chain, trajectory)
    loaded = fb.inverse_dynamics(chain, trajectory, external={"universe": [1.0, 2.0, 3.0, 0.1, 0.2, 0.3]})
    np.testing.assert_array_equal(loaded.torque, bare.torque)
    np.testing.assert_allclose(loaded.frame_force - bare.frame_force, [[1.0, 2.0, 3.0]] * 40, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(loaded.shaking_force, bare.shaking_force, rtol=0.0, atol=1e-14)
    assert loaded.momentum_residual() <= 1e-12


def test_a_force_on_a_frame_in_the_ground_has_its_lever():
    """The moment about the origin is p x F + M for a frame of the ground at p, in the loads and in their own check."""
    model = slider_crank().model.copy()
    place = np.array([0.3, -0.8, 0.4])
    model.addFrame(pin.Frame("hook", 0, 0, pin.SE3(np.eye(3), place), pin.FrameType.OP_FRAME))
    chain = fb.ClosedChain(model, slider_crank().closures, ("crank",))
    trajectory, pull = fb.drive(chain, swinging(0.9)), np.array([1.0, 2.0, 3.0, 0.1, 0.2, 0.3])
    bare = fb.inverse_dynamics(chain, trajectory)
    loaded = fb.inverse_dynamics(chain, trajectory, external={"hook": pull})
    wanted = np.tile(np.cross(place, pull[:3]) + pull[3:], (40, 1))
    np.testing.assert_allclose(loaded.frame_moment - bare.frame_moment, wanted, rtol=0.0, atol=1e-11)
    assert loaded.momentum_residual() <= 1e-12


def test_damping_friction_and_armature_do_what_their_names_say():
    plain, motion = five_bar(gravity=(0.0, 0.0, 0.0)), swinging(2.0, 1.0)
    trajectory = fb.drive(plain, motion)
    base = fb.inverse_dynamics(plain, trajectory)
    v, a, N = trajectory.v, trajectory.a, trajectory.N
    b, f, r = np.array([0.1, 0.2, 0.3, 0.4]), np.array([0.5, 0.1, 0.2, 0.3]), np.array([0.2, 0.3, 0.1, 0.4])
    for name, values, extra in (
        ("damping", b, b * v),
        ("upperDryFrictionLimit", f, f * np.sign(v)),
        ("armature", r, r * a),
    ):
        model = plain.model.copy()
        setattr(model, name, values)
        other = fb.inverse_dynamics(fb.ClosedChain(model, plain.closures, plain.actuated), trajectory)
        expected = base.torque + np.einsum("nva,nv->na", N, extra)
        np.testing.assert_allclose(other.torque, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())
        np.testing.assert_allclose(other.shaking_force, base.shaking_force, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(other.shaking_moment, base.shaking_moment, rtol=0.0, atol=1e-12)


def test_at_rest_without_gravity_nothing_is_felt_and_weight_is_weight():
    chain = five_bar(gravity=(0.0, 0.0, 0.0))
    still = laws.combine(laws.constant([0.0, 1.0], 2.0), laws.constant([0.0, 1.0], 1.0))
    loads = fb.inverse_dynamics(chain, fb.drive(chain, still))
    assert np.abs(loads.torque).max() == 0.0
    assert np.abs(loads.shaking_force).max() == 0.0
    heavy = fb.inverse_dynamics(chain.with_gravity([1.0, -2.0, 3.0]), loads.trajectory)
    weight = chain.mass * np.array([1.0, -2.0, 3.0])
    np.testing.assert_allclose(heavy.frame_force, np.tile(weight, (2, 1)), rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(heavy.frame_moment, np.cross(heavy.com, weight), rtol=0.0, atol=1e-13)
    assert not heavy.shaking_force.any() and not heavy.shaking_moment.any()
    assert heavy.loaded and not loads.loaded


def test_torques_and_forces_grow_with_the_square_of_the_speed():
    chain, motion = five_bar(gravity=(0.0, 0.0, 0.0)), swinging(2.0, 1.0)
    slow = fb.inverse_dynamics(chain, fb.drive(chain, motion))
    fast = fb.inverse_dynamics(chain, fb.drive(chain, motion.scaled(3.0)))
    np.testing.assert_allclose(fast.torque, 9.0 * slow.torque, rtol=0.0, atol=1e-11 * np.abs(fast.torque).max())
    np.testing.assert_allclose(
        fast.shaking_force, 9.0 * slow.shaking_force, rtol=0.0, atol=1e-11 * np.abs(fast.shaking_force).max()
    )


def test_many_samples_are_the_single_ones():
    """Threads and blocks do not show: 5000 samples at once, and some of them alone."""
    chain = five_bar()
    t = np.linspace(0.0, 5.0, 5000)
    motion = laws.combine(*(laws.harmonic(t, m, 0.3, period=1.1) for m in (2.0, 1.0)))
    trajectory = fb.drive(chain, motion)
    loads = fb.inverse_dynamics(chain, trajectory)
    assert trajectory.worst_closure <= 1e-12
    for i in (0, 1, 2047, 4095, 4096, 4999):
        one = Motion(motion.t[i : i + 1], motion.q[i : i + 1], motion.v[i : i + 1], motion.a[i : i + 1])
        alone = fb.inverse_dynamics(chain, fb.drive(chain, one, trajectory.q[i]))
        np.testing.assert_allclose(alone.torque[0], loads.torque[i], rtol=0.0, atol=1e-11)
        np.testing.assert_allclose(alone.shaking_moment[0], loads.shaking_moment[i], rtol=0.0, atol=1e-11)


def test_open_tree_has_the_torques_of_pinocchio():
    chain = fb.ClosedChain(five_bar().model, (), ("left", "left_elbow", "right", "right_elbow"))
    motion = swinging(0.1, 0.2, 0.3, 0.4)
    loads = fb.inverse_dynamics(chain, fb.drive(chain, motion))
    data = chain.model.createData()
    expected = [pin.rnea(chain.model, data, *x) for x in zip(motion.q, motion.v, motion.a, strict=True)]
    np.testing.assert_allclose(loads.torque, np.stack(expected), rtol=0.0, atol=1e-12)
    assert loads.closure_reactions.shape == (40, 0, 6)
    assert np.isfinite(loads.joint_reactions).all()
    for k in range(4):
        np.testing.assert_allclose(loads.joint_reactions[:, k, 5], loads.torque[:, k], rtol=0.0, atol=1e-11)


def test_results_are_read_only_and_print_their_peaks():
    chain = five_bar()
    loads = fb.inverse_dynamics(chain, fb.drive(chain, swinging(2.0, 1.0)))
    names = ("torque", "shaking_force", "shaking_moment", "frame_force", "frame_moment", "com", "joint_reactions")
    for name in (*names, "kinetic_energy", "rotor_energy"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(loads, name)[...] = 0.0
    assert repr(loads).startswith("Loads(40 samples; peaks: torque ")
    assert f"shaking_force {np.linalg.norm(loads.shaking_force, axis=1).max():.4g}" in repr(loads)
    assert f"frame_force {np.linalg.norm(loads.frame_force, axis=1).max():.4g}" in repr(loads)
    with pytest.raises(UnknownNameError, match="quantity 'weight'; known: torque, shaking_force"):
        loads.scale("weight")


@EACH
def test_energies_have_one_value_under_one_name(loads, case):
    """What the loads call kinetic and rotor energy is what the energy balance calls so."""
    x = loads[case]
    account = fb.energy_balance(x.chain, x.trajectory, torque=x.torque)
    for mine, other in (
        (x.kinetic_energy, account.kinetic),
        (x.rotor_energy, account.rotor),
        (x.potential_energy, account.potential),
        (x.elastic_energy, account.elastic),
    ):
        np.testing.assert_allclose(mine, other, rtol=1e-13, atol=1e-13)
    assert account.residual() <= 1e-12
    np.testing.assert_allclose(account.total, account.kinetic + account.rotor + account.potential, rtol=1e-14)


@pytest.mark.parametrize("gravity", [(0.0, 0.0, 0.0), (3.0, -9.81, 4.0), (0.0, -1e6, 0.0)])
def test_a_balanced_five_bar_does_not_shake_by_the_digits_of_its_weight(gravity):
    """The shaking wrench is the same under any gravity, to the round-off of inertia; the frame carries the weight."""
    linkage, motion = (
        paper.balance_mass_centres(paper.table_1("I", "balanced")).linkage,
        paper.default_motion(samples=101),
    )
    light, heavy = linkage.chain(), linkage.chain(gravity=gravity)
    trajectory = fb.drive(light, motion, linkage.configuration(*motion.q[0]))
    bare, loads = fb.inverse_dynamics(light, trajectory), fb.inverse_dynamics(heavy, trajectory)
    assert np.abs(loads.shaking_force).max() <= 1e-15
    np.testing.assert_allclose(loads.shaking_moment, bare.shaking_moment, rtol=0.0, atol=1e-15)
    weight = light.mass * np.array(gravity)
    np.testing.assert_allclose(
        loads.frame_force, np.tile(weight, (101, 1)), rtol=0.0, atol=1e-15 + 1e-14 * max(map(abs, weight))
    )


@EACH
def test_bearing_forces_are_the_determinate_part_of_the_reactions(loads, case):
    """Where nothing is open they are the reactions; in a plane, however it lies, what is known in the joint's axes."""
    x = loads[case]
    nb = len(x.chain.joints)
    assert x.bearing_force.shape == (len(x.trajectory), nb + len(x.chain.closures), 3)
    world = np.concatenate([x.joint_reactions, x.closure_reactions], axis=1)[..., :3]
    local = np.concatenate([x.joint_reactions_local, x.closure_reactions_local], axis=1)[..., :3]
    known = np.isfinite(world)
    scale = np.nanmax(np.abs(local), initial=1.0)
    np.testing.assert_allclose(x.bearing_force[known], world[known], rtol=0.0, atol=1e-11 * scale)
    if case != "Bennett":  # nothing is known there in any axes
        joints = slice(0, nb)
        size = np.linalg.norm(np.nan_to_num(local[:, joints]), axis=2)
        found = np.linalg.norm(x.bearing_force[:, joints], axis=2)
        np.testing.assert_allclose(found, size, rtol=0.0, atol=1e-11 * scale)


@EACH
def test_scales_bound_their_quantities_and_tell_round_off_from_results(loads, case):
    """No value is larger than the sum of sizes it is made of; a sum much larger than its value means cancellation."""
    x = loads[case]
    for name in ("torque", "shaking_force", "shaking_moment", "frame_force", "frame_moment"):
        values = np.abs(x.torque) if name == "torque" else np.linalg.norm(getattr(x, name), axis=1)
        assert x.peak(name) == values.max() <= x.scale(name) * (1.0 + 1e-12)
        assert x.scale(name) <= 1e3 * values.max()
    assert x.peak("travel") == np.linalg.norm(x.com - x.com[0], axis=1).max() <= 2.0 * x.scale("travel")


@pytest.mark.parametrize("law", ["steady", "swinging"])
def test_a_wheel_with_its_mass_centre_on_the_axis_shakes_nothing_but_round_off(law):
    """The lever is what 0.1 + 0.2 - 0.3 leaves; the force of it is told as none, with nothing else in the chain."""
    model = pin.Model()
    j = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "wheel")
    model.appendBodyToJoint(
        j, pin.Inertia(2.0, np.array([0.1 + 0.2 - 0.3, 0.0, 0.0]), 0.05 * np.eye(3)), pin.SE3.Identity()
    )
    chain = fb.ClosedChain(model, (), ("wheel",))
    t = np.linspace(0.0, 1.0, 20)
    steady = Motion(t, 9.0 * t[:, None], np.full((20, 1), 9.0), np.zeros((20, 1)))
    moves = laws.harmonic(t, 0.0, 0.5, period=0.7) if law == "swinging" else steady
    loads = fb.inverse_dynamics(chain, fb.drive(chain, moves))
    assert 0.0 < np.abs(loads.shaking_force).max() < 1e-12
    assert loads.peak("shaking_force") == 0.0
    assert loads.peak("shaking_moment") == (0.0 if law == "steady" else np.abs(loads.torque).max())


def test_arguments_are_checked():
    chain = five_bar()
    trajectory = fb.drive(chain, swinging(2.0, 1.0))
    with pytest.raises(InvalidInputError, match=r"trajectory .* must belong to this chain: q \(40, 3\)"):
        fb.inverse_dynamics(four_bar(), trajectory)
    with pytest.raises(InvalidInputError, match=r"shape of about = \(2,\) but must be \(3,\)"):
        fb.inverse_dynamics(chain, trajectory, about=(0.0, 0.0))
    with pytest.raises(UnknownNameError, match="frame of an external force 'nose'; known: universe, left"):
        fb.inverse_dynamics(chain, trajectory, external={"nose": np.zeros(6)})
    with pytest.raises(InvalidInputError, match=r"shape of external\['tip_left'\] = \(7, 6\) but must be \(40, 6\)"):
        fb.inverse_dynamics(chain, trajectory, external={"tip_left": np.zeros((7, 6))})
    for wrong in (np.zeros(5), np.full(6, np.inf), ["a"] * 6):
        with pytest.raises(InvalidInputError, match=r"external\['tip_left'\]"):
            fb.inverse_dynamics(chain, trajectory, external={"tip_left": wrong})


@pytest.mark.parametrize("sense", [-1.0, 0.0, 1.0])
def test_dry_friction_is_against_the_motion_and_nothing_at_rest(sense):
    """f sign(v) in both directions of dynamics: a joint at rest is not pushed."""
    chain, q = four_bar(), fb.assemble(four_bar(), [0.9])
    model = chain.model.copy()
    model.upperDryFrictionLimit = np.array([0.3, 0.5, 0.7])
    rough = fb.ClosedChain(model, chain.closures, chain.actuated)
    motion = Motion([0.0], [[0.9]], [[2.0 * sense]], [[1.0]])
    smooth = fb.inverse_dynamics(chain, fb.drive(chain, motion, q))
    loads = fb.inverse_dynamics(rough, fb.drive(rough, motion, q))
    v, N = loads.trajectory.v[0], loads.trajectory.N[0, :, 0]
    taken = np.array([0.3, 0.5, 0.7]) @ (np.sign(v) * N)
    assert (np.abs(v) > 0.1).all() == (sense != 0.0)
    np.testing.assert_allclose(loads.torque - smooth.torque, [[taken]], rtol=0.0, atol=1e-13)
    tau = smooth.torque[0]
    plain, held = fb.forward_dynamics(chain, q, v, tau), fb.forward_dynamics(rough, q, v, tau + taken)
    np.testing.assert_allclose(held, plain, rtol=0.0, atol=1e-10)


def test_what_the_frame_carries_beside_shaking_is_told_where_there_is_any():
    """Weight needs mass and gravity; a force from outside needs neither."""
    chain = four_bar().with_gravity([0.0, -9.81, 0.0])
    moved = fb.drive(chain, swinging(0.9))
    floating, massless = chain.with_gravity(np.zeros(3)), chain.with_inertial_parameters(np.zeros((3, 10)))
    push = {"rocker_end": np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])}
    loaded = [fb.inverse_dynamics(c, moved).loaded for c in (chain, floating, massless)]
    assert loaded == [True, False, False]
    assert fb.inverse_dynamics(floating, moved, external=push).loaded
    assert not fb.inverse_dynamics(floating, moved, external={"rocker_end": np.zeros(6)}).loaded
    assert "frame_moment" in repr(fb.inverse_dynamics(floating, moved, external=push))
    assert "frame_moment" not in repr(fb.inverse_dynamics(floating, moved))


def alone(what: str) -> fb.Loads:
    """Return the loads of a four-bar on which one thing acts and nothing else, at rest but for losses."""
    model = four_bar().model.copy()
    model.gravity.linear = np.array([0.0, -9.81, 0.0]) if what == "weight" else np.zeros(3)
    if what == "friction":
        model.upperDryFrictionLimit = np.array([0.3, 0.5, 0.7])
    if what == "damping":
        model.damping = np.array([0.3, 0.5, 0.7])
    if what == "armature":
        model.armature = np.array([0.3, 0.5, 0.7])
    springs = [fb.JointSpring("coupler", 5.0, 0.0)] if what == "spring" else []
    chain = fb.ClosedChain(model, four_bar().closures, ("crank",), springs=springs)
    if what != "weight":
        chain = chain.with_inertial_parameters(np.zeros((3, 10)))
    moving = float(what in ("friction", "damping"))
    motion = Motion([0.0], [[0.9]], [[moving]], [[float(what == "armature")]])
    push = {"rocker_end": np.array([1.0, -2.0, 0.0, 0.0, 0.0, 0.4])} if what == "push" else {}
    return fb.inverse_dynamics(chain, fb.drive(chain, motion), about=(0.2, -0.4, 0.3), external=push)


@pytest.mark.parametrize("what", ["weight", "push", "spring", "friction", "damping", "armature"])
def test_the_scale_of_a_load_counts_each_thing_that_acts_alone(what):
    """With one thing acting the sum of sizes is no less than what it causes: nothing that acts is left out."""
    x = alone(what)
    assert x.peak("torque") > 0.1
    for name in ("torque", "shaking_force", "shaking_moment", "frame_force", "frame_moment"):
        assert x.scale(name) >= x.peak(name) * (1.0 - 1e-12), name
    felt = x.peak("frame_force") > 0.1, x.peak("frame_moment") > 0.1
    assert felt == ((True, True) if what in ("weight", "push") else (False, False))
    assert x.peak("shaking_force") == x.peak("shaking_moment") == 0.0


@pytest.mark.parametrize("tilt", [1e-6, 1e-3, 0.1])
def test_what_a_slight_tilt_leaves_open_is_open(tilt):
    """The force across the plane is not determinate: in world axes its share makes another component so, however small.

    In the joint's own axes both components in the plane stay known.
    """
    chain = four_bar(base=pin.SE3(pin.rpy.rpyToMatrix(tilt, 0.0, 0.0), np.zeros(3)))
    loads = fb.inverse_dynamics(chain, fb.drive(chain, swinging(0.9)))
    known = np.isfinite(loads.joint_reactions[0, :, :3])
    np.testing.assert_array_equal(known, np.tile([True, False, False], (3, 1)))
    known = np.isfinite(loads.joint_reactions_local[0, :, :3])
    np.testing.assert_array_equal(known, np.tile([True, True, False], (3, 1)))


def test_torques_that_no_closure_forces_explain_show_as_a_mismatch():
    """With a complement that is none, what the closures carry does not balance the joints."""
    chain = five_bar()
    moved = fb.drive(chain, swinging(2.0, 1.0))
    right = fb.inverse_dynamics(chain, moved)
    wrong = fb.inverse_dynamics(chain, replace(moved, N=1.1 * moved.N))
    size = np.abs(right.torque).max()
    assert right.reactions.mismatch < 1e-12 * size
    assert wrong.reactions.mismatch > 1e-2 * size
