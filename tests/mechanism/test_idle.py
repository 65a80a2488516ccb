"""Freedoms that move nothing else are found, named and held at rest with the least velocity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import TILTED, add, at, body, close_at, five_bar, point, rssr, side_by_side
from tied_chains import EXAMPLES

import fivebar_pin as fb
from fivebar_pin.closures.rest import Spin
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.idle import Kind, at_rest, idle_freedoms
from fivebar_pin.mechanism.loops import loops_of

Built = tuple[fb.ClosedChain, np.ndarray]


def rod_on_three_hinges() -> Built:
    """RSSR whose rod hangs on three hinges about one point: none of them is its axis."""
    model = pin.Model()
    crank = add(model, 0, pin.JointModelRZ(), TILTED, "crank", body(1))
    first = add(model, crank, pin.JointModelRX(), at(0.2, 0.0, 0.05), "first", body(4, mass=0.02))
    second = add(model, first, pin.JointModelRY(), at(), "second", body(5, mass=0.02))
    rod = add(model, second, pin.JointModelRZ(), at(), "rod", body(2))
    rocker = add(model, 0, pin.JointModelRY(), TILTED * at(0.9, 0.3, -0.2), "rocker", body(3))
    q = np.array([0.3, 0.2, -0.4, 0.5, 0.1])
    return closed_by_a_ball(model, q, rod, rocker, np.array([0.6, 0.3, 0.4])), q


def leg_between_balls(*, carrying: bool) -> Built:
    """A crank, a leg of two parts (ball, driven slide, ball) and a rocker: both parts may spin together.

    The second ball is one of the tree where the leg carries the rocker's end, else the closure.
    """
    model = pin.Model()
    crank = add(model, 0, pin.JointModelRZ(), at(), "crank", body(1))
    tube = add(model, crank, pin.JointModelSpherical(), at(0.2, 0.0, 0.05), "tube", body(2))
    piston = add(model, tube, pin.JointModelPrismaticUnaligned(np.array([0.6, 0.0, 0.8])), at(), "piston", body(3))
    turn = pin.Quaternion(pin.rpy.rpyToMatrix(0.3, -0.2, 0.4)).coeffs()
    if carrying:
        end = add(model, piston, pin.JointModelSpherical(), at(), "end", body(4))
        rocker = add(model, 0, pin.JointModelRY(), at(0.9, 0.3, -0.2), "rocker", body(5))
        q = np.r_[0.3, turn, 0.7, pin.Quaternion(pin.rpy.rpyToMatrix(0.1, 0.2, -0.3)).coeffs(), 0.2]
        closure = close_at(model, q, (end, rocker), "6d", at(0.5, 0.2, 0.3))
        return fb.ClosedChain(model, (closure,), ("crank", "piston")), q
    rocker = add(model, 0, pin.JointModelRY(), at(0.9, 0.3, -0.2), "rocker", body(5))
    q = np.r_[0.3, turn, 0.7, 0.2]
    closure = close_at(model, q, (piston, rocker), "3d", at())
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    where = pin.SE3(np.eye(3), np.array(data.oMi[piston].translation))
    closure = close_at(model, q, (piston, rocker), "3d", where)
    return fb.ClosedChain(model, (closure,), ("crank", "piston")), q


def floating_rod() -> Built:
    """Two cranks about skew axes, joined by a rod that is a body of its own, closed by a ball at either end."""
    model = pin.Model()
    one = add(model, 0, pin.JointModelRZ(), at(0.03, -0.02, 0.1), "one", body(1))
    two = add(model, 0, pin.JointModelRY(), at(0.9, 0.3, -0.2), "two", body(2))
    rod = add(model, 0, pin.JointModelFreeFlyer(), at(0.1, 0.2, 0.3, (0.2, 0.1, 0.5)), "rod", body(3))
    q = np.r_[0.3, 0.4, 0.4, 0.1, 0.0, pin.Quaternion(pin.rpy.rpyToMatrix(0.3, -0.2, 0.4)).coeffs()]
    ends = [at(0.2, 0.05, 0.1), at(0.7, 0.3, 0.1)]
    closures = [close_at(model, q, (j, rod), "3d", end) for j, end in zip((one, two), ends, strict=True)]
    return fb.ClosedChain(model, closures, ("one",)), q


def closed_by_a_ball(model: pin.Model, q: np.ndarray, rod: int, rocker: int, end: np.ndarray) -> fb.ClosedChain:
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    where = pin.SE3(np.eye(3), data.oMi[rod].act(end))
    return fb.ClosedChain(model, (close_at(model, q, (rod, rocker), "3d", where),), ("crank",))


def of(chain: fb.ClosedChain) -> Built:
    return chain, fb.diagnose(chain).q


SPINNING: dict[str, tuple[Callable[[], Built], tuple[str, ...]]] = {
    "rod on a ball": (lambda: of(rssr(ball=True, base=TILTED)), ("coupler_body",)),
    "rod on three hinges": (rod_on_three_hinges, ("rod_body",)),
    "leg": (lambda: leg_between_balls(carrying=False), ("tube_body", "piston_body")),
    "leg in the tree": (lambda: leg_between_balls(carrying=True), ("tube_body", "piston_body")),
    "rod apart": (floating_rod, ("rod_body",)),
}
spinning = pytest.mark.parametrize(("make", "bodies"), SPINNING.values(), ids=SPINNING.keys())


def swing(chain: fb.ClosedChain, q: np.ndarray, samples: int = 401) -> fb.Trajectory:
    t = np.linspace(0.0, 1.0, samples)
    at_q = loops_of(chain).actuated_of(q[None])[0]
    swings = (fb.motion.harmonic(t, x, 0.1, period=1.0 / (k + 1), phase=-0.5 * np.pi) for k, x in enumerate(at_q))
    return fb.drive(chain, fb.motion.combine(*swings), near=q)


@spinning
def test_what_spins_is_found_and_named(make, bodies):
    chain, _ = make()
    (found,) = idle_freedoms(chain)
    assert (found.kind, found.bodies) == (Kind.SPIN, bodies)
    d = fb.diagnose(chain)
    assert d.ok, str(d)
    assert d.generic_mobility == chain.na
    words = "its own axis" if len(bodies) == 1 else "one axis together"
    assert any(f"may spin about {words}: held at rest" in p.text for p in d.problems)


@spinning
def test_a_driven_motion_keeps_the_loops_closed_and_spins_nothing(make, bodies):
    """v is tangent, least in the spin of the rod on what carries it, and a is its rate."""
    chain, q = make()
    path = swing(chain, q)
    assert np.abs(fb.closure_residual(chain, path.q)).max() < 1e-12
    loops = loops_of(chain)
    rates = np.matmul(loops.see(np.array(path.q)).J, path.v[..., None])
    assert np.abs(rates).max() < 1e-11 * np.abs(path.v).max()
    (rest,) = (c for c in at_rest(chain).closures if isinstance(c, Spin))
    model, data = chain.model, chain.model.createData()
    j, carrier = int(rest.frames[1].split()[-1]), 0 if "one" in chain.joints else 1  # the ground, or the crank
    assert at_rest(chain).length == pytest.approx(chain.length, rel=1e-15)  # units stay what they are
    for k in range(0, len(path), 50):
        pin.forwardKinematics(model, data, path.q[k], path.v[k])
        R, w = data.oMi[j].rotation, data.oMi[j].rotation @ data.v[j].angular
        spin = (R @ np.asarray(rest.axis)) @ (w - data.oMi[carrier].rotation @ data.v[carrier].angular)
        assert abs(spin) < 1e-12 * np.abs(path.v).max()
    dt = path.t[1] - path.t[0]
    rate = (path.v[2:] - path.v[:-2]) / (2.0 * dt)
    assert np.abs(rate - path.a[1:-1]).max() < 2e-3 * np.abs(path.a).max()
    moved = np.stack([pin.difference(model, a, b) for a, b in zip(path.q[:-1], path.q[1:], strict=True)]) / dt
    assert np.abs(moved - 0.5 * (path.v[1:] + path.v[:-1])).max() < 1e-3 * np.abs(path.v).max()


@spinning
def test_where_the_coordinates_of_the_rod_are_those_of_a_ball_the_velocity_is_the_least(make, bodies):
    """Of all passive velocities that keep the loops closed, by the pseudo-inverse.

    Not so for rods on hinges, where the least velocity of the joints is not that of the rod, for rods between two balls
    of the tree, and for rods apart, which are measured on the ground.
    """
    chain, q = make()
    N = fb.complement(chain, fb.assemble(chain, loops_of(chain).actuated_of(q[None])[0], q))
    here = Configurations(loops_of(chain), q[None])
    J, a, p = here.J[0], chain.actuated_index, chain.passive_index
    least = -np.linalg.pinv(J[:, p]) @ J[:, a]
    assert np.abs(J @ N).max() < 1e-12
    if {"first", "end", "rod"} & set(chain.joints):
        assert np.linalg.norm(N[p]) > np.linalg.norm(least) - 1e-12
    else:
        np.testing.assert_allclose(N[p], least, rtol=0.0, atol=1e-12)


@spinning
def test_both_roads_and_the_evaluator_take_it(make, bodies):
    chain, q = make()
    path = swing(chain, q, 9)
    one, two = (fb.inverse_dynamics(chain, path, road=road) for road in ("pinocchio", "complement"))
    np.testing.assert_allclose(one.torque, two.torque, rtol=0.0, atol=1e-12 * np.abs(one.torque).max())
    power = np.sum(one.torque * path.v[:, chain.actuated_index], axis=1)
    assert power == pytest.approx(np.sum(one.tree_torque * path.v, axis=1), rel=1e-9, abs=1e-12)
    evaluator = fb.Evaluator(chain, q)
    a = chain.actuated_index
    coordinates = loops_of(chain).actuated_of(np.array(path.q))
    for k in range(len(path)):
        evaluator.inverse(coordinates[k], path.v[k, a], path.a[k, a])
        np.testing.assert_allclose(evaluator.torque, one.torque[k], rtol=0.0, atol=1e-9 * np.abs(one.torque).max())


@spinning
def test_reactions_hold_every_body_and_the_rod_by_a_couple_about_its_axis_alone(make, bodies):
    """Newton and Euler for each body, from the reactions of its joints and closures."""
    chain, q = make()
    path = swing(chain, q, 5)
    loads = fb.inverse_dynamics(chain, path)
    model, data, k = chain.model, chain.model.createData(), 3
    pin.forwardKinematics(model, data, path.q[k], path.v[k], path.a[k])
    pin.updateFramePlacements(model, data)
    left = np.zeros((model.njoints, 6))
    for j in range(1, model.njoints):
        I, M = model.inertias[j], data.oMi[j]
        needed = M.act(I * data.a[j] + data.v[j].cross(I * data.v[j]))
        weight, centre = I.mass * model.gravity.linear, M.act(I.lever)
        left[j] += np.r_[needed.linear - weight, needed.angular - np.cross(centre, weight)]
        f, n = np.split(loads.joint_reactions[k, j - 1], 2)
        wrench = np.r_[f, n + np.cross(M.translation, f)]
        left[j] -= wrench
        left[int(model.parents[j])] += wrench
    for c, closure in enumerate(chain.closures):
        one, two = (model.frames[model.getFrameId(name)] for name in closure.frames)
        f, n = np.split(loads.closure_reactions[k, c], 2)
        wrench = np.r_[f, n + np.cross(data.oMf[model.getFrameId(closure.frames[1])].translation, f)]
        left[int(two.parentJoint)] -= wrench
        left[int(one.parentJoint)] += wrench
    assert np.abs(left[1:]).max() < 1e-10 * np.abs(loads.joint_reactions[k]).max()
    (rest,) = (c for c in at_rest(chain).closures if isinstance(c, Spin))
    top = int(rest.frames[1].split()[-1])
    if model.joints[top].nv == 6:
        local = loads.joint_reactions_local[k, top - 1]
        np.testing.assert_allclose(local[:3], 0.0, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(np.cross(local[3:], np.asarray(rest.axis)), 0.0, rtol=0.0, atol=1e-12)


def test_nothing_holds_them_in_a_simulation():
    """A rod that spins goes on spinning: forward dynamics is that of the mechanism as it is."""
    chain, q = floating_rod()
    J = Configurations(loops_of(chain), q[None]).J[0]
    (rest,) = (c for c in at_rest(chain).closures if isinstance(c, Spin))
    null = np.linalg.svd(J)[2][J.shape[0] :]
    v = 3.0 * null[-1] + null[0]
    M = pin.crba(chain.model, chain.model.createData(), q)
    M = np.triu(M) + np.triu(M, 1).T
    h = pin.nonLinearEffects(chain.model, chain.model.createData(), q, v)
    gamma = loops_of(chain).drift(q[None], v[None])[0]
    m = len(J)
    system = np.block([[M, J.T], [J, np.zeros((m, m))]])
    expected = np.linalg.solve(system, np.r_[-h, -gamma])[: chain.nv]
    np.testing.assert_allclose(fb.forward_dynamics(chain, q, v), expected, rtol=0.0, atol=1e-9 * np.abs(expected).max())
    assert rest.name == "rod_body at rest (0)"


def test_a_prop_is_left_out_of_the_count_with_motors_or_without():
    base = five_bar()
    model = base.model.copy()
    add(model, 0, pin.JointModelFreeFlyer(), at(5.0), "box", body(8))
    for actuated in (base.actuated, ()):
        chain = fb.ClosedChain(model, base.closures, actuated)
        (found,) = idle_freedoms(chain)
        assert (found.kind, found.bodies) == (Kind.PROP, ("box_body",))
        d = fb.diagnose(chain)
        assert d.mobility == 2
        assert any(p.text == "no closure and no motor touches the free body box_body: left out of the count"
                   for p in d.problems)  # fmt: skip


def test_a_loose_joint_and_a_floating_base_are_held_where_they_stand():
    base = five_bar()
    model = pin.Model()
    root = add(model, 0, pin.JointModelFreeFlyer(), at(), "root", body(9))
    left = add(model, root, pin.JointModelRZ(), at(), "left", body(1))
    left2 = add(model, left, pin.JointModelRZ(), at(1.0), "left_elbow", body(2))
    right = add(model, root, pin.JointModelRZ(), at(1.2), "right", body(3))
    right2 = add(model, right, pin.JointModelRZ(), at(1.0), "right_elbow", body(4))
    add(model, left, pin.JointModelRX(), at(0.3), "rattle", body(5))
    ends = [point(model, j, f"tip{j}", at(1.0)) for j in (left2, right2)]
    chain = fb.ClosedChain(model, (fb.Closure(ends),), ("left", "right"))
    assert {x.joint: x.kind for x in idle_freedoms(chain)} == {"root": Kind.BASE, "rattle": Kind.LOOSE}
    pose = np.r_[0.3, 0.2, 0.1, pin.Quaternion(pin.rpy.rpyToMatrix(0.3, -0.2, 0.4)).coeffs()]
    near = fb.diagnose(chain).q.copy()
    near[:7], near[-1] = pose, 0.7
    path = swing(chain, near, 11)
    np.testing.assert_allclose(path.q[:, :7], np.tile(pose, (11, 1)), rtol=0.0, atol=1e-14)
    rattle = chain.columns("rattle")
    np.testing.assert_array_equal(path.q[:, rattle[0]], 0.7)
    assert not path.v[:, :6].any() and not path.v[:, rattle[1]].any()
    assert base.nv + 7 == chain.nv


def test_a_mechanism_with_a_motor_too_few_is_refused_all_the_same():
    chain = five_bar().with_actuated(("left",))
    assert idle_freedoms(chain) == ()
    assert at_rest(chain) is chain
    with pytest.raises(InvalidInputError, match=r"leave 1 coordinate\(s\) undetermined"):
        fb.assemble(chain, [1.0])


def test_joints_that_are_tied_to_each_other_are_not_idle():
    """A pinion and its rack, without a motor: two coordinates that move together, and two bodies of their own."""
    chain, _ = EXAMPLES["rack and pinion"]()
    assert idle_freedoms(chain.with_actuated(())) == ()


def test_springs_that_are_too_few_hold_nothing():
    """Three four-bars in a row, one motor and one spring: what is missing is said of the motors."""
    bars = (0.4, 1.1, 0.9, 1.0)
    three = side_by_side(bars, bars, bars)
    first, second = (name for name in three.joints if "crank" in name and name[-1] in "01")
    chain = three.with_actuated((first,)).with_springs([fb.JointSpring(second, 9.0, 0.3)])
    assert idle_freedoms(chain) == ()


def test_without_motors_nothing_is_held_but_what_moves_nothing_else():
    base = five_bar()
    model = base.model.copy()
    add(model, 0, pin.JointModelRY(), at(5.0), "pendulum", body(8))
    add(model, 0, pin.JointModelFreeFlyer(), at(7.0), "box", body(8))
    chain = fb.ClosedChain(model, base.closures, (), springs=[fb.JointSpring("right", 9.0, 0.3)])
    assert fb.diagnose(chain).mobility == 3
    assert [c.joins[0] for c in at_rest(chain).closures[1:]] == ["box"] * 6


def test_a_rod_spins_beside_a_motor_too_few_and_is_found_without_motors():
    for actuated in ((), ("crank",)):
        chain, _ = SPINNING["rod apart"][0]()
        chain = chain.with_actuated(() if not actuated else ("one",))
        assert [x.kind for x in idle_freedoms(chain)] == [Kind.SPIN]
    assert fb.diagnose(chain.with_actuated(())).generic_mobility == 1


def test_a_simulation_tells_the_torques_of_what_spins_freely_and_of_a_floating_base():
    chain, q = floating_rod()
    path = fb.simulate(chain, q, np.zeros(chain.nv), [0.4], np.linspace(0.0, 0.2, 5))
    np.testing.assert_allclose(fb.inverse_dynamics(chain, path).torque, 0.4, rtol=0.0, atol=1e-6)
    model = pin.Model()
    root = add(model, 0, pin.JointModelFreeFlyer(), at(), "root", body(9))
    add(model, root, pin.JointModelRZ(), at(0.3), "arm", body(1))
    base = fb.ClosedChain(model, (), ("arm",))
    path = fb.simulate(base, pin.neutral(model), np.zeros(7), [0.4], np.linspace(0.0, 0.2, 5))
    loads = fb.inverse_dynamics(base, path)
    np.testing.assert_allclose(loads.torque, 0.4, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(loads.frame_force, 0.0, rtol=0.0, atol=1e-6)


def delta_of_rods(*, ball: bool) -> Built:
    """Return a Delta: three arms, six thin rods along their z axes, a plate that is a body of its own; and q.

    The rods hang on balls, and may spin, or on two hinges. Thin rods have no inertia about their own axis.
    """
    model, q, ends, drop = pin.Model(), [], [], -0.6
    rod = pin.Inertia(0.2, np.array([0.0, 0.0, -0.35]), np.diag([0.2 * 0.7**2 / 12.0] * 2 + [0.0]))
    for k in range(3):
        arm = add(model, 0, pin.JointModelRY(), at(rpy=(0.0, 0.0, 2.1 * k)) * at(0.2), f"arm{k}", body(k))
        q.append([0.1])
        for side in (-0.05, 0.05):
            where = at(0.3, side)
            corner = at(rpy=(0.0, 0.0, 2.1 * k)) * at(0.08, side)
            if ball:
                end = add(model, arm, pin.JointModelSpherical(), where, f"rod{k}{side:+}", rod)
                q.append([0.0, 0.3, 0.0, np.sqrt(0.91)])
            else:
                cross = add(model, arm, pin.JointModelRX(), where, f"cross{k}{side:+}", pin.Inertia.Zero())
                end = add(model, cross, pin.JointModelRY(), at(), f"rod{k}{side:+}", rod)
                q.append([0.0, 0.6])
            ends.append((point(model, end, f"end{k}{side:+}", at(z=-0.7)), corner))
    plate = add(model, 0, pin.JointModelFreeFlyer(), at(), "plate", body(7))
    q.append([0.0, 0.0, drop, 0.0, 0.0, 0.0, 1.0])
    corners = [point(model, plate, f"corner_{name}", place) for name, place in ends]
    closures = [fb.Closure((end, corner)) for (end, _), corner in zip(ends, corners, strict=True)]
    model.referenceConfigurations["home"] = np.concatenate(q)
    chain = fb.ClosedChain(model, closures, ("arm0", "arm1", "arm2"), name="delta")
    return chain, fb.assemble(chain, [0.1, 0.1, 0.1], np.concatenate(q))


def test_a_robot_of_rods_between_balls_moves_as_one_whose_rods_cannot_spin():
    chain, q = delta_of_rods(ball=True)
    assert [x.kind for x in idle_freedoms(chain)] == [Kind.SPIN] * 6
    d = fb.diagnose(chain, q)
    assert d.ok and d.mobility == 3 and "and 6 held at rest" in str(d)
    other, other_q = delta_of_rods(ball=False)
    t = np.linspace(0.0, 1.0, 21)
    motion = fb.motion.combine(*(fb.motion.harmonic(t, 0.1, 0.2, period=1.0 / k) for k in (1, 2, 3)))
    one, two = fb.drive(chain, motion, q), fb.drive(other, motion, other_q)
    np.testing.assert_allclose(one.q[:, -7:-4], two.q[:, -7:-4], rtol=0.0, atol=1e-12)
    torques = [fb.inverse_dynamics(c, p).torque for c, p in ((chain, one), (other, two))]
    np.testing.assert_allclose(torques[0], torques[1], rtol=0.0, atol=1e-11 * np.abs(torques[1]).max())
    ranks = [fb.balance_conditions(c, "force").rank for c in (chain, other)]
    assert ranks[0] + 6 == ranks[1]  # the six crosses are bodies of their own
    modes = fb.assembly_modes(chain, [0.1, 0.1, 0.1])[:, -7:]
    assert len(modes) == len(np.unique(np.round(modes, 6), axis=0)) > 1  # a plate stands in one place once


def test_a_joint_that_its_spring_alone_holds_is_held_where_nothing_else_is_missing():
    """A five-bar with one motor and a spring in the other crank; a spring elsewhere in a determined loop is let be."""
    base = five_bar()
    for joint, held in (("right", ["right"]), ("left_elbow", ["left_elbow"]), ("left", [])):
        chain = base.with_actuated(("left",)).with_springs([fb.JointSpring(joint, 50.0, 0.3)])
        assert [x.joint for x in idle_freedoms(chain)] == held
        if held:
            d = fb.diagnose(chain)
            assert d.ok and d.mobility == 1
            assert any(p.text.startswith(f"its spring alone holds {joint}: held at rest") for p in d.problems)
            q = d.q
            path = fb.drive(chain, fb.motion.harmonic(np.linspace(0.0, 1.0, 9), q[0], 0.1, period=1.0), q)
            k = chain.columns(joint)[0]
            assert np.abs(path.q[:, k] - q[k]).max() < 1e-12
    assert idle_freedoms(base.with_springs([fb.JointSpring("right_elbow", 5.0, 0.3)])) == ()
    slack = base.with_actuated(("left",)).with_springs([fb.JointSpring("right", 0.0, 0.3, damping=1.0)])
    assert idle_freedoms(slack) == ()
