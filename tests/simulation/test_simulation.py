"""Laws of forward dynamics and simulation: identities, conserved quantities, reference figures, honest failures."""

from __future__ import annotations

import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin.dynamics import energy_balance, forward_dynamics
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError, SolverError, UnknownNameError
from fivebar_pin.simulation import simulate
from fivebar_pin.springs import JointSpring, Spring

TILTED = mechanisms.TILTED
# tip of the double four-bar [m], and its velocity at the end [m/s]; IFToMM benchmark library
TIP_AT_1 = (-0.19502030194944, -0.98079920566217)
TIP_AT_10 = (0.32845811154082, 0.94451853817860)
TIP_RATE_AT_10 = (1.4230514702069, -0.49486884548704)


def with_losses(chain: fb.ClosedChain, seed: int = 0) -> fb.ClosedChain:
    """Return the chain with damping, dry friction and armature on every joint."""
    rng = np.random.default_rng(seed)
    model = chain.model.copy()
    model.damping = rng.uniform(0.1, 0.5, model.nv)
    model.upperDryFrictionLimit = rng.uniform(0.1, 0.3, model.nv)
    model.lowerDryFrictionLimit = -model.upperDryFrictionLimit
    model.armature = rng.uniform(0.01, 0.1, model.nv)
    return fb.ClosedChain(model, chain.closures, chain.actuated)


def closed_configuration(chain: fb.ClosedChain, seed: int = 0) -> np.ndarray:
    """Return a closed configuration away from singularities."""
    rng = np.random.default_rng(seed)
    for _ in range(200):
        try:
            q = fb.assemble(chain, rng.uniform(0.4, 1.4, chain.na), seed=seed)
            N = fb.complement(chain, q)
        except fb.FiveBarPinError:
            continue
        if np.abs(N).max() < 10.0:
            return q
    raise AssertionError(f"{chain.name} found no regular configuration")


EXACTLY_DRIVEN = {
    "five-bar": mechanisms.five_bar,
    "five-bar, tilted": lambda: mechanisms.five_bar(base=TILTED),
    "five-bar, continuous joints": lambda: mechanisms.five_bar(joint=pin.JointModelRUBZ),
    "four-bar, hinge": lambda: mechanisms.four_bar(base=TILTED, kind="revolute"),
    "slider-crank": lambda: mechanisms.slider_crank(base=TILTED),
    "spatial four-bar": mechanisms.rssr,
    "double four-bar": mechanisms.double_four_bar,
}


def state_of(chain: fb.ClosedChain, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    q = closed_configuration(chain, seed)
    rng = np.random.default_rng(seed)
    return q, fb.complement(chain, q) @ rng.normal(size=chain.na)


def still(chain: fb.ClosedChain, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> fb.Trajectory:
    """Return a trajectory of one sample."""
    N = fb.complement(chain, q)
    return fb.Trajectory(np.zeros(1), q[None], v[None], a[None], N[None], np.zeros(1))


@pytest.mark.parametrize("name", EXACTLY_DRIVEN)
@pytest.mark.parametrize("losses", [False, True], ids=["ideal", "with losses"])
def test_inverse_of_forward_is_the_torque(name, losses):
    """inverse_dynamics(forward_dynamics(tau)) = tau, with friction, armature and an external force."""
    chain = EXACTLY_DRIVEN[name]()
    chain = with_losses(chain) if losses else chain
    frame = chain.model.frames[-1].name
    external = {frame: np.array([0.3, -0.7, 0.2, 0.1, 0.4, -0.5])} if losses else None
    rng = np.random.default_rng(5)
    for seed in range(3):
        q, v = state_of(chain, seed)
        tau = rng.normal(size=chain.na)
        a = forward_dynamics(chain, q, v, tau, external=external)
        loads = fb.inverse_dynamics(chain, still(chain, q, v, a), external=external)
        np.testing.assert_allclose(loads.torque[0], tau, atol=1e-10)


def constrained_by_pinocchio(chain: fb.ClosedChain, q: np.ndarray, v: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Return the accelerations from Pinocchio's own proximal solver for point and weld closures."""
    model, kinds = chain.model, {"3d": pin.ContactType.CONTACT_3D, "6d": pin.ContactType.CONTACT_6D}
    contacts = pin.StdVec_RigidConstraintModel()
    for closure in chain.closures:
        f1, f2 = (model.frames[model.getFrameId(f)] for f in closure.frames)
        contacts.append(
            pin.RigidConstraintModel(
                kinds[closure.kind.value], model, f1.parentJoint, f1.placement, f2.parentJoint, f2.placement, pin.LOCAL
            )
        )
    data, datas = model.createData(), pin.StdVec_RigidConstraintData()
    for contact in contacts:
        datas.append(contact.createData())
    pin.initConstraintDynamics(model, data, contacts, datas)
    forces = np.zeros(chain.nv)
    forces[chain.actuated_index] = tau
    forces -= np.array(model.damping) * v + np.array(model.upperDryFrictionLimit) * np.sign(v)
    return np.array(
        pin.constraintDynamics(model, data, q, v, forces, contacts, datas, pin.ProximalSettings(1e-14, 1e-10, 200))
    )


@pytest.mark.parametrize("name", [n for n in EXACTLY_DRIVEN if n not in ("four-bar, hinge", "double four-bar")])
def test_forward_dynamics_agrees_with_pinocchio(name):
    chain = with_losses(EXACTLY_DRIVEN[name]())
    q, v = state_of(chain)
    tau = np.linspace(1.0, -2.0, chain.na)
    expected = constrained_by_pinocchio(chain, q, v, tau)
    np.testing.assert_allclose(forward_dynamics(chain, q, v, tau), expected, atol=1e-8 * np.abs(expected).max())


def test_two_loops_agree_with_pinocchio():
    """The double four-bar with its joints depth first, which Pinocchio's solver needs and this library does not."""
    model, rod = pin.Model(), mechanisms.body(3)
    model.gravity.linear = np.array(GRAVITY)
    first = mechanisms.add(model, 0, pin.JointModelRZ(), mechanisms.at(), "upright0", rod)
    coupler0 = mechanisms.add(model, first, pin.JointModelRZ(), mechanisms.at(1.0), "coupler0", mechanisms.body(4))
    second = mechanisms.add(model, 0, pin.JointModelRZ(), mechanisms.at(1.2), "upright1", rod)
    coupler1 = mechanisms.add(model, second, pin.JointModelRZ(), mechanisms.at(0.9), "coupler1", rod)
    third = mechanisms.add(model, 0, pin.JointModelRZ(), mechanisms.at(2.1), "upright2", mechanisms.body(5))
    ends = [("end0", coupler0, 1.1), ("pin0", second, 0.9), ("end1", coupler1, 1.0), ("pin1", third, 1.1)]
    for name, joint, x in ends:
        mechanisms.point(model, joint, name, mechanisms.at(x))
    chain = fb.ClosedChain(model, (fb.Closure(("end0", "pin0")), fb.Closure(("end1", "pin1"))), ("upright0",))
    q, v = state_of(chain)
    expected = constrained_by_pinocchio(chain, q, v, np.array([2.0]))
    np.testing.assert_allclose(forward_dynamics(chain, q, v, [2.0]), expected, atol=1e-8 * np.abs(expected).max())


def test_welded_loop_agrees_with_pinocchio():
    """A 6d closure of a planar loop has three redundant rows; the accelerations do not depend on them."""
    chain = mechanisms.welded_four_bar(base=TILTED)
    q = mechanisms.four_bar_angles(0.8)
    v = fb.complement(chain, q) @ np.array([1.3])
    expected = constrained_by_pinocchio(chain, q, v, np.array([0.7]))
    np.testing.assert_allclose(forward_dynamics(chain, q, v, [0.7]), expected, atol=1e-8 * np.abs(expected).max())


def test_a_batch_is_its_samples():
    chain = mechanisms.five_bar()
    states = [state_of(chain, seed) for seed in range(9)]
    q, v = (np.stack(x) for x in zip(*states, strict=True))
    tau = np.random.default_rng(0).normal(size=(9, 2))
    batch = forward_dynamics(chain, q, v, tau)
    each = np.stack([forward_dynamics(chain, *x) for x in zip(q, v, tau, strict=True)])
    np.testing.assert_allclose(batch, each, rtol=1e-11, atol=1e-11)
    assert forward_dynamics(chain, q[:0], v[:0], tau[:0]).shape == (0, 4)


def test_forward_dynamics_does_not_depend_on_which_joints_are_called_actuated():
    """The same forces on the same joints give the same motion, also with more motors than mobility, or fewer."""
    chain = mechanisms.five_bar()
    q, v = state_of(chain)
    a = forward_dynamics(chain, q, v, [0.4, 0.0])
    np.testing.assert_allclose(forward_dynamics(chain.with_actuated(("left",)), q, v, [0.4]), a, rtol=1e-12)
    three = chain.with_actuated(("right", "left", "left_elbow"))
    np.testing.assert_allclose(forward_dynamics(three, q, v, [0.0, 0.4, 0.0]), a, rtol=1e-12)
    none = chain.with_actuated(())
    np.testing.assert_allclose(
        forward_dynamics(none, q, v, None), forward_dynamics(chain, q, v, [0.0, 0.0]), rtol=1e-12
    )


def test_overconstrained_loop_moves():
    """Bennett's loop has mobility 1 though its rows count none; its energy is kept and its motion is its own."""
    chain, q = mechanisms.bennett()
    point = fb.closure_residual(chain, q)
    assert np.abs(point).max() < 1e-12
    t = np.linspace(0.0, 1.0, 11)
    moved = simulate(chain, q, np.zeros(3), None, t)
    assert np.ptp(moved.q[:, 0]) > 0.1
    assert moved.worst_closure < 1e-12
    assert energy_balance(chain, moved).drift() < 1e-10


# ---------------------------------------------------------------------------------------------- simulation


def upright() -> tuple[fb.ClosedChain, np.ndarray, np.ndarray]:
    """Return the double four-bar without a motor, upright, its tip moving at 1 m/s along x."""
    chain = mechanisms.double_four_bar().with_actuated(())
    q = np.array([np.pi / 2 if j.startswith("upright") else -np.pi / 2 for j in chain.joints])
    v = np.array([-1.0 if j.startswith("upright") else 1.0 for j in chain.joints])
    return chain, q, v


def tip(motion: fb.Trajectory, chain: fb.ClosedChain) -> tuple[np.ndarray, np.ndarray]:
    k = chain.joints.index("upright0")
    angle, rate = motion.q[:, k], motion.v[:, k, None]
    return np.stack([np.cos(angle), np.sin(angle)], axis=1), rate * np.stack([-np.sin(angle), np.cos(angle)], axis=1)


def test_double_four_bar_reaches_the_reference():
    """The tip at t = 10 s within 1e-8, after ten passes through the flat configuration where mobility jumps to 3."""
    chain, q, v = upright()
    motion = simulate(chain, q, v, None, np.linspace(0.0, 10.0, 41))
    place, rate = tip(motion, chain)
    np.testing.assert_allclose(place[4], TIP_AT_1, atol=1e-10)
    np.testing.assert_allclose(place[-1], TIP_AT_10, atol=1e-8)
    np.testing.assert_allclose(rate[-1], TIP_RATE_AT_10, atol=1e-8)
    assert motion.worst_closure < 1e-12
    assert energy_balance(chain, motion).drift() < 1e-10
    uprights = [k for k, j in enumerate(chain.joints) if j.startswith("upright")]
    assert np.ptp(motion.q[:, uprights], axis=1).max() < 1e-9, "left the parallelogram branch"


def test_free_motion_converges_with_its_tolerance():
    chain, q, v = upright()
    error = []
    for rtol in (1e-7, 1e-9, 1e-11):
        place, _ = tip(simulate(chain, q, v, None, [0.0, 2.0], rtol=rtol, atol=1e-2 * rtol), chain)
        error.append(place[-1])
    exact, _ = tip(simulate(chain, q, v, None, [0.0, 2.0], rtol=1e-12, atol=1e-14), chain)
    size = [np.abs(e - exact[-1]).max() for e in error]
    assert size[0] > size[1] > size[2]
    assert size[2] < 1e-10


def test_a_sample_on_the_singular_instant_is_what_its_neighbours_say():
    """Without gravity the tip turns at a constant rate and lies flat exactly at the sample t = pi / 2."""
    chain, q, v = upright()
    free = chain.with_gravity((0.0, 0.0, 0.0))
    t = np.array([0.0, 1.0, 0.5 * np.pi, 2.0])
    motion = simulate(free, q, v, None, t)
    place, _ = tip(motion, free)
    np.testing.assert_allclose(place, np.stack([np.sin(t), np.cos(t)], axis=1), atol=1e-9)
    np.testing.assert_allclose(motion.v, np.broadcast_to(v, motion.v.shape), atol=1e-9)
    assert motion.worst_closure < 1e-12


@pytest.mark.parametrize("off", [1e-6, 1e-4, 1e-3])
def test_samples_beside_the_singular_instant_are_as_exact_as_others(off):
    """There the round-off of the closures, magnified by 1 / off^2, would show in the accelerations: they are zero."""
    chain, q, v = upright()
    free = chain.with_gravity((0.0, 0.0, 0.0))
    motion = simulate(free, q, v, None, np.array([0.0, 0.5 * np.pi - off, 0.5 * np.pi + off, 2.0]))
    np.testing.assert_allclose(motion.a, 0.0, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(motion.v, np.broadcast_to(v, motion.v.shape), rtol=0.0, atol=1e-10)


MOVING = {
    "five-bar": lambda: mechanisms.five_bar(base=TILTED),
    "five-bar, continuous joints": lambda: mechanisms.five_bar(joint=pin.JointModelRUBZ),
    "slider-crank": mechanisms.slider_crank,
    "spatial four-bar": mechanisms.rssr,
}
GRAVITY = (0.7, -9.81, 0.4)


@pytest.mark.parametrize("name", MOVING)
def test_free_motion_keeps_its_energy_and_its_closures(name):
    chain = MOVING[name]().with_gravity(GRAVITY)
    q, v = state_of(chain)
    motion = simulate(chain, q, v, None, np.linspace(0.0, 1.5, 31))
    balance = energy_balance(chain, motion)
    assert balance.drift() < 1e-9
    assert balance.residual() < 1e-9
    assert np.ptp(balance.kinetic) > 1e-2 * balance.kinetic.max(), "nothing happened"
    assert motion.worst_closure < 1e-12


@pytest.mark.parametrize("name", MOVING)
def test_velocities_and_accelerations_are_the_rates_of_the_motion(name):
    """v and a agree with finite differences of q and v."""
    chain = MOVING[name]().with_gravity(GRAVITY)
    q, v = state_of(chain)
    h = 1e-3
    motion = simulate(chain, q, v, None, h * np.arange(7))
    moved = np.stack([pin.difference(chain.model, motion.q[3], x) for x in motion.q])
    stencil = np.array([-1.0, 9.0, -45.0, 0.0, 45.0, -9.0, 1.0]) / (60.0 * h)
    np.testing.assert_allclose(stencil @ moved, motion.v[3], atol=1e-8 * (1.0 + np.abs(motion.v).max()))
    np.testing.assert_allclose(stencil @ motion.v, motion.a[3], atol=1e-7 * (1.0 + np.abs(motion.a).max()))


def test_spherical_joint_and_free_spin():
    """A coupler on a ball spins about its own length, which moves nothing else: the motor tells the rest."""
    chain = mechanisms.rssr(ball=True)
    q = np.r_[0.3, pin.Quaternion(pin.rpy.rpyToMatrix(0.2, 0.3, 0.4)).coeffs(), 0.5]
    rng = np.random.default_rng(2)
    motion = simulate(chain, q, rng.normal(size=5), [0.2], np.linspace(0.0, 2.0, 21), initial="project")
    torque_work = energy_balance(chain, motion, torque=[0.2])
    assert torque_work.residual() < 1e-10
    assert motion.worst_closure < 1e-12
    np.testing.assert_allclose(np.linalg.norm(motion.q[:, 1:5], axis=1), 1.0, atol=1e-12)
    supplied = torque_work.total - 0.2 * motion.q[:, 0]
    np.testing.assert_allclose(supplied, supplied[0], atol=1e-8)
    loads = fb.inverse_dynamics(chain, motion)
    np.testing.assert_allclose(loads.torque, 0.2, atol=1e-8)
    free = mechanisms.five_bar().with_actuated(("left",))
    motion = simulate(free, fb.diagnose(free).q, np.zeros(4), [0.1], np.linspace(0.0, 0.1, 3))
    assert np.isnan(motion.N).all(), "one motor does not determine two mobilities"


def test_driven_motion_needs_the_torque_it_was_given():
    """inverse_dynamics of a simulated motion returns the torque, which depends on time and state."""
    chain = with_losses(mechanisms.five_bar())
    model = chain.model.copy()
    model.upperDryFrictionLimit = np.zeros(model.nv)
    chain = fb.ClosedChain(model, chain.closures, chain.actuated)
    q, v = state_of(chain)

    def tau(t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.array([3.0 * np.sin(5.0 * t) - 0.5 * v[0], np.cos(q[2])])

    motion = simulate(chain, q, v, tau, np.linspace(0.0, 1.0, 21))
    given = np.stack([tau(*x) for x in zip(motion.t, motion.q, motion.v, strict=True)])
    np.testing.assert_allclose(fb.inverse_dynamics(chain, motion).torque, given, atol=1e-9)
    balance = energy_balance(chain, motion, torque=given)
    assert balance.residual() < 1e-11
    assert balance.dissipated.min() > 0.0


def test_time_runs_backwards():
    """Free motion retraces its way when its velocity is reversed."""
    chain = mechanisms.five_bar()
    q, v = state_of(chain)
    there = simulate(chain, q, v, None, [0.0, 1.0])
    back = simulate(chain, there.q[-1], -there.v[-1], None, [0.0, 1.0])
    np.testing.assert_allclose(back.q[-1], q, atol=1e-8)
    np.testing.assert_allclose(back.v[-1], -v, atol=1e-8)


def test_start_time_does_not_matter():
    chain = mechanisms.slider_crank().with_gravity(GRAVITY)
    q, v = state_of(chain)
    a, b = (simulate(chain, q, v, None, np.array([0.0, 0.7]) + t0) for t0 in (0.0, -4.0))
    np.testing.assert_allclose(a.q[-1], b.q[-1], atol=1e-9)


def test_actuated_complement_of_a_simulation():
    """N is the kinematic complement where the motors determine the motion; with spare motors still J N = 0."""
    chain = mechanisms.five_bar()
    q, v = state_of(chain)
    motion = simulate(chain, q, v, [0.1, 0.2], [0.0, 0.1, 0.2])
    np.testing.assert_allclose(motion.N, fb.complement(chain, motion.q), atol=1e-11)
    three = chain.with_actuated(("left", "right", "left_elbow"))
    spare = simulate(three, q, v, [0.1, 0.2, 0.0], [0.0, 0.1, 0.2])
    np.testing.assert_allclose(spare.q, motion.q, atol=1e-10)
    np.testing.assert_allclose(np.einsum("nka,na->nk", spare.N, spare.v[:, three.actuated_index]), spare.v, atol=1e-10)
    one = simulate(chain.with_actuated(("left",)), q, v, [0.1], [0.0, 0.1])
    assert np.isnan(one.N).all()


def test_initial_state_is_moved_onto_the_closures_when_asked():
    chain = mechanisms.five_bar()
    q, v = state_of(chain)
    motion = simulate(chain, q + 1e-3, v + 0.1, None, [0.0], initial="project")
    assert motion.closure_residual[0] < 1e-12
    assert np.abs(motion.q[0] - q).max() < 1e-2
    again = simulate(chain, motion.q[0], motion.v[0], None, [0.0])
    np.testing.assert_allclose(again.v, motion.v, atol=1e-12)


SHIPPED = [name for name in fb.io.shipped() if fb.load(fb.io.shipped_path(name)).closures]


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_mechanisms_fall_freely(name):
    """From their home, let go at speed: torque returned by the inverse, energy kept, loops closed."""
    chain = fb.load(fb.io.shipped_path(name)).with_gravity(GRAVITY)
    home = next(iter(chain.references.values()))
    at = [chain.model.joints[chain.model.getJointId(j)].idx_q for j in chain.actuated]
    q = fb.assemble(chain, home[at], near=home)
    rng = np.random.default_rng(4)
    v = fb.complement(chain, q) @ rng.uniform(0.5, 1.0, chain.na)
    tau = rng.normal(size=chain.na)
    a = forward_dynamics(chain, q, v, tau)
    np.testing.assert_allclose(fb.inverse_dynamics(chain, still(chain, q, v, a)).torque[0], tau, atol=1e-10)
    motion = simulate(chain, q, v, None, np.linspace(0.0, 0.3, 7))
    balance = energy_balance(chain, motion)
    assert balance.drift() < 1e-9
    assert balance.residual() < 1e-9
    assert motion.worst_closure < 1e-12


# ---------------------------------------------------------------------------------------------- springs


def pendulum() -> fb.ClosedChain:
    """Return a single rod, 1 kg and 1 m, on a hinge, without gravity: an open chain."""
    model = pin.Model()
    rod = pin.Inertia(1.0, np.array([0.5, 0.0, 0.0]), np.diag([0.0, 1.0, 1.0]) / 12.0)
    joint = mechanisms.add(model, 0, pin.JointModelRZ(), mechanisms.at(), "hinge", rod)
    mechanisms.point(model, joint, "tip", mechanisms.at(1.0))
    mechanisms.point(model, 0, "anchor", mechanisms.at(2.0))
    model.gravity.linear = np.zeros(3)
    return fb.ClosedChain(model, (), ("hinge",))


def test_joint_spring_oscillates_in_closed_form():
    """I q'' + b q' + k (q - r) = 0 with I = 1/3."""
    chain, k, b, rest = pendulum(), 6.0, 0.2, 0.3
    t = np.linspace(0.0, 4.0, 17)
    motion = simulate(chain.with_springs([JointSpring("hinge", k, rest, b)]), [1.0], [0.0], None, t)
    inertia = 1.0 / 3.0
    decay = b / (2.0 * inertia)
    w = np.sqrt(k / inertia - decay**2)
    expected = rest + 0.7 * np.exp(-decay * t) * (np.cos(w * t) + decay / w * np.sin(w * t))
    np.testing.assert_allclose(motion.q[:, 0], expected, atol=1e-10)


def test_spring_force_is_the_slope_of_its_energy():
    """The generalised force of springs is minus the derivative of their energy along every free direction."""
    chain = mechanisms.five_bar(base=TILTED)
    springs = [Spring("universe", "tip_left", 40.0, 0.3), JointSpring("right_elbow", 5.0, -0.4)]
    springs.append(Spring("left_elbow_body", "right_elbow_body", 25.0, 0.0))
    sprung = chain.with_springs(springs)
    q, _ = state_of(chain)
    N, rest, h = fb.complement(chain, q), np.zeros(4), 1e-4
    without = forward_dynamics(chain, q, rest, [0.0, 0.0])
    work = []
    for column in N.T:
        ends = [
            fb.assemble(chain, q[chain.actuated_index] + s * h * column[chain.actuated_index], near=q) for s in (-1, 1)
        ]
        states = fb.Trajectory(
            np.zeros(2), np.stack(ends), np.zeros((2, 4)), np.zeros((2, 4)), np.zeros((2, 4, 2)), np.zeros(2)
        )
        work.append(-np.diff(energy_balance(sprung, states).elastic)[0] / (2.0 * h))
    # the springs do what motors with the torque of their virtual work do
    np.testing.assert_allclose(
        forward_dynamics(sprung, q, rest, [0.0, 0.0]), forward_dynamics(chain, q, rest, work), atol=1e-5
    )
    assert np.abs(forward_dynamics(chain, q, rest, work) - without).max() > 1.0


def test_springs_and_dampers_keep_the_energy_account():
    chain = mechanisms.slider_crank().with_gravity(GRAVITY)
    q, v = state_of(chain)
    chain = chain.with_springs([Spring("universe", "rod_end", 30.0, 0.5), JointSpring("rod", 4.0, 0.1)])
    t = np.linspace(0.0, 1.0, 21)
    kept = energy_balance(chain, simulate(chain, q, v, None, t))
    assert kept.drift() < 1e-9
    assert np.ptp(kept.elastic) > 1e-2
    damped = chain.with_springs([Spring("universe", "rod_end", 30.0, 0.5, 2.0), JointSpring("rod", 4.0, 0.1, 0.3)])
    lost = energy_balance(damped, simulate(damped, q, v, None, t))
    assert lost.residual() < 1e-11
    assert lost.dissipated.min() >= 0.0
    assert np.all(np.diff(lost.total) < 0.0)


def test_external_force_that_follows_the_state():
    """A force -k p on the tip, given as a function, acts as the spring of zero length does."""
    chain = mechanisms.five_bar()
    q, v = state_of(chain)
    model, data = chain.model, chain.model.createData()
    frame = model.getFrameId("tip_left")

    def pull(t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        pin.framesForwardKinematics(model, data, q)
        return np.r_[-20.0 * data.oMf[frame].translation, 0.0, 0.0, 0.0]

    t = [0.0, 0.5]
    by_force = simulate(chain, q, v, None, t, external={"tip_left": pull})
    by_spring = simulate(chain.with_springs([Spring("tip_left", "universe", 20.0, 0.0)]), q, v, None, t)
    np.testing.assert_allclose(by_force.q, by_spring.q, atol=1e-9)


# ---------------------------------------------------------------------------------------------- dry friction


def with_dry_friction(chain: fb.ClosedChain, friction: float) -> fb.ClosedChain:
    """Return the chain with the same dry friction on every joint."""
    model = chain.model.copy()
    model.upperDryFrictionLimit = np.full(model.nv, friction)
    model.lowerDryFrictionLimit = -model.upperDryFrictionLimit
    return fb.ClosedChain(model, chain.closures, chain.actuated)


def test_dry_friction_takes_the_same_from_every_swing_and_then_holds():
    """Every half swing is harmonic about -+ f / k, until the spring cannot move it: 1, -2/3, 1/3, 0."""
    chain, k, f, inertia = with_dry_friction(pendulum(), 0.5), 3.0, 0.5, 1.0 / 3.0
    half = np.pi / np.sqrt(k / inertia)
    t = np.linspace(0.0, 4.0 * half, 41)
    motion = simulate(chain.with_springs([JointSpring("hinge", k, 0.0)]), [1.0], [0.0], None, t)
    swing = np.minimum(t // half, 3)
    start = np.maximum(1.0 - 2.0 * swing * f / k, 0.0)
    side = (-1.0) ** swing
    about = np.where(swing < 3, f / k, 0.0)
    expected = side * (about + (start - about) * np.cos(np.pi * (t / half - swing)))
    expected[swing == 3] = 0.0
    np.testing.assert_allclose(motion.q[:, 0], expected, atol=1e-9)
    np.testing.assert_array_equal(motion.v[-5:], 0.0)


def test_a_joint_breaks_loose_when_the_torque_exceeds_its_friction():
    """tau = 0.4 t against f = 0.5: at rest until t = 1.25 s, then q = 0.2 (t - 1.25)^3."""
    t = np.linspace(0.0, 3.0, 31)
    motion = simulate(with_dry_friction(pendulum(), 0.5), [0.0], [0.0], lambda t, q, v: [0.4 * t], t)
    np.testing.assert_allclose(motion.q[:, 0], 0.2 * np.maximum(t - 1.25, 0.0) ** 3, atol=1e-9)


def test_a_short_push_on_a_joint_at_rest_is_not_slept_through():
    """Nothing moves, so nothing limits the steps but that what acts must be looked at: 0.1 s of 3 break it loose."""
    chain = with_dry_friction(pendulum(), 0.5)
    motion = simulate(chain, [0.0], [0.0], lambda t, q, v: [1.2 * np.exp(-(((t - 1.5) / 0.05) ** 2))], [0.0, 1.0, 3.0])
    assert abs(motion.q[1, 0]) < 1e-12
    assert motion.q[2, 0] > 0.01
    np.testing.assert_array_equal(motion.v[2], 0.0)


def test_a_linkage_comes_to_rest_by_friction_joint_by_joint():
    """Energy only falls, its account is kept, and in the end everything stands still without gravity."""
    chain = with_dry_friction(mechanisms.five_bar(), 2.0).with_gravity(np.zeros(3))
    q, v = state_of(chain)
    motion = simulate(chain, q, 3.0 * v, None, np.linspace(0.0, 1.5, 151))
    balance = energy_balance(chain, motion)
    partly = np.any(motion.v == 0.0, axis=1) & np.any(motion.v != 0.0, axis=1)
    assert partly.any(), "no joint stuck before the others"
    assert balance.residual() < 1e-9
    assert np.all(np.diff(balance.total) <= 1e-12)
    np.testing.assert_array_equal(motion.v[-1], 0.0)
    assert motion.worst_closure < 1e-12


def test_a_joint_may_stick_while_the_rest_of_the_mechanism_moves():
    """Friction on one joint of two mobilities: held at rest, the five-bar moves as a four-bar does."""
    chain = mechanisms.five_bar()
    model = chain.model.copy()
    held = chain.joints.index("right")
    model.upperDryFrictionLimit = np.where(np.arange(4) == held, 1e3, 0.0)
    sticky = fb.ClosedChain(model, chain.closures, chain.actuated)
    q, _ = state_of(chain)
    v = fb.complement(chain, q) @ np.array([1.0, 0.0])
    motion = simulate(sticky, q, v, None, np.linspace(0.0, 1.0, 11))
    np.testing.assert_allclose(motion.q[:, held], q[held], atol=1e-10)
    np.testing.assert_array_equal(motion.v[:, held], 0.0)  # at rest, not nearly so
    assert np.ptp(motion.q[:, 0]) > 0.1
    assert energy_balance(sticky, motion).drift() < 1e-9


# ---------------------------------------------------------------------------------------------- failures


def test_start_on_a_bifurcation_is_an_error():
    chain, _, v = upright()
    flat = np.zeros(5)
    with pytest.raises(SingularityError, match="bifurcation"):
        forward_dynamics(chain, flat, np.zeros(5), None)
    with pytest.raises(SingularityError, match="bifurcation"):
        simulate(chain, flat, np.array([v[0] * 0.0 for _ in v]), None, [0.0, 1.0])


def test_coming_to_rest_on_a_bifurcation_is_an_error():
    """A motion that creeps into the flat configuration cannot be followed on from there."""
    chain, q, _ = upright()
    stop = [JointSpring("upright0", 9.0, 0.0, 15.0)]  # overdamped: pulls it flat and stops it there
    with pytest.raises(SingularityError, match="several ways"):
        simulate(chain.with_gravity(np.zeros(3)).with_springs(stop), q, np.zeros(5), None, [0.0, 100.0], rtol=1e-8)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"q": np.full(4, 0.3)}, InvalidInputError, "closure tip at state 0"),
        ({"v": np.array([1.0, 0.0, 0.0, 0.0])}, InvalidInputError, "opens the loops"),
        ({"q": np.zeros(3)}, InvalidInputError, "shape of q"),
        ({"v": np.full(4, np.nan)}, InvalidInputError, "must be finite"),
        ({"tau": [1.0, 2.0, 3.0]}, InvalidInputError, "shape of tau"),
        ({"tau": lambda t, q, v: [np.inf, 0.0]}, InvalidInputError, "must be finite"),
        ({"tau": lambda t, q, v: 0.0}, InvalidInputError, "shape of tau at t = 0 s"),
        ({"t": [0.0, 1.0, 1.0]}, InvalidInputError, "increasing"),
        ({"t": []}, InvalidInputError, "increasing"),
        ({"rtol": 0.0}, InvalidInputError, "rtol"),
        ({"max_steps": 3}, SolverError, "took 3 steps"),
        ({"springs": [Spring("tip_left", "tip_right", 1.0, 0.1)]}, SolverError, "ends on one point"),
        ({"external": {"nose": np.zeros(6)}}, UnknownNameError, "external force 'nose'"),
        ({"external": {"tip_left": np.zeros(3)}}, InvalidInputError, "external"),
    ],
)
def test_bad_input_is_named(change, error, message):
    chain = mechanisms.five_bar()
    q, v = state_of(chain)
    given = {"q": q, "v": v, "tau": None, "t": [0.0, 1.0], **change}
    chain = chain.with_springs(given.pop("springs", ()))
    with pytest.raises(error, match=message):
        simulate(chain, given.pop("q"), given.pop("v"), given.pop("tau"), given.pop("t"), **given)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Spring("a", "b", -1.0, 0.1), "stiffness of spring a~b"),
        (lambda: Spring("a", "b", 1.0, -0.1), "length of spring a~b"),
        (lambda: Spring("a", "a", 1.0, 0.1), "must differ"),
        (lambda: JointSpring("a", 1.0, np.nan), "must be finite"),
        (lambda: JointSpring("a", 1.0, 0.0, -2.0), "damping"),
    ],
)
def test_springs_without_sense_are_refused(make, message):
    with pytest.raises(InvalidInputError, match=message):
        make()


def test_massless_motion_is_refused():
    chain = mechanisms.five_bar()
    q, v = state_of(chain)
    light = chain.with_inertias({j: pin.Inertia.Zero() for j in chain.joints})
    with pytest.raises(InvalidInputError, match="inertia of the free motion"):
        forward_dynamics(light, q, v, None)


def test_structure_without_mobility_is_refused():
    chain = mechanisms.four_bar()
    model = chain.model.copy()
    mechanisms.point(model, 1, "strut", mechanisms.at(0.2, 0.1))
    q = closed_configuration(chain)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    ground = mechanisms.point(model, 0, "strut_foot", data.oMf[model.getFrameId("strut")])
    stiff = fb.ClosedChain(model, (*chain.closures, fb.Closure(("strut", ground))), ())
    with pytest.raises(InvalidInputError, match="cannot move"):
        simulate(stiff, q, np.zeros(3), None, [0.0, 1.0])
    np.testing.assert_allclose(forward_dynamics(stiff, q, np.zeros(3), None), 0.0, atol=1e-12)


def test_progress_is_told_from_start_to_end():
    chain = mechanisms.slider_crank().with_gravity(GRAVITY)
    q, v = state_of(chain)
    told: list[float] = []
    simulate(chain, q, v, None, [0.0, 0.5], progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_drift_is_counted_from_the_start_and_relative_to_the_energy_that_changes():
    """A hinge 5 m up turns at 0, 2 and 1 rad/s: of the largest kinetic energy, all has come; the height is no part."""
    chain = pendulum()
    model = chain.model.copy()
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    model.jointPlacements[1] = mechanisms.at(z=5.0)
    high = fb.ClosedChain(model, (), ("hinge",))
    moved = fb.drive(high, fb.Motion([0.0, 1.0, 2.0], [[0.0], [1.0], [2.0]], [[0.0], [2.0], [1.0]], np.zeros((3, 1))))
    balance = energy_balance(high, moved)
    np.testing.assert_allclose(balance.potential, 5.0 * 9.81, rtol=1e-14)
    assert balance.drift() == pytest.approx(1.0, rel=1e-12)


def test_two_hinges_on_one_axis_need_mass_between_them():
    """The massless link may turn against the rod without moving any mass: rounding must not hide it."""
    model = pin.Model()
    rod = pin.Inertia(1.0, np.array([0.37, 0.11, 0.0]), np.diag([0.1, 0.2, 0.3]))
    first = mechanisms.add(model, 0, pin.JointModelRZ(), mechanisms.at(), "first", pin.Inertia.Zero())
    mechanisms.add(model, first, pin.JointModelRZ(), mechanisms.at(), "second", rod)
    chain = fb.ClosedChain(model, (), ())
    for q in np.random.default_rng(0).uniform(-3.0, 3.0, (20, 2)):
        with pytest.raises(InvalidInputError, match="inertia of the free motion"):
            forward_dynamics(chain, q, np.zeros(2))


@pytest.mark.parametrize("off", [1e-5, 1e-6, 1e-7])
def test_a_state_that_is_all_but_closed_is_not_closed(off):
    """A hundred millionth is rounding; ten times that is another mechanism, in place and in velocity."""
    chain = mechanisms.five_bar()
    q, v = state_of(chain)
    out = np.array([0.0, 1.0, 0.0, 0.0])  # an elbow alone opens the loop by its link
    with pytest.raises(InvalidInputError, match="closure tip at state 0"):
        forward_dynamics(chain, q + off * out, v)
    with pytest.raises(InvalidInputError, match="rate of the closures at state 0"):
        forward_dynamics(chain, q, v + off * np.abs(v).max() * out)
    batch, rates = np.stack([q, q + off * out, q]), np.stack([v, v, v + off * np.abs(v).max() * out])
    with pytest.raises(InvalidInputError, match="closure tip at state 1"):
        forward_dynamics(chain, batch, rates)
    with pytest.raises(InvalidInputError, match="rate of the closures at state 2"):
        forward_dynamics(chain, batch[[0, 0, 0]], rates)
    a = forward_dynamics(chain, q + 1e-10 * out, v * (1.0 + 1e-10))
    np.testing.assert_allclose(a, forward_dynamics(chain, q, v), rtol=1e-6)


def test_no_complement_where_one_of_two_motors_has_lost_its_hold():
    """Both cranks upright and the distal links in line between them: the motors cannot part their middle."""
    chain = mechanisms.five_bar((0.5, 0.5, 0.5, 0.5, 1.0))
    q = 0.5 * np.pi * np.array([1.0, -1.0, 1.0, 1.0])
    assert np.abs(fb.closure_residual(chain, q)).max() < 1e-15
    assert np.isnan(simulate(chain, q, np.zeros(4), None, [0.0]).N).all()
    beside = fb.assemble(chain, q[[0, 2]] + [0.01, 0.1])
    assert np.isfinite(simulate(chain, beside, np.zeros(4), None, [0.0]).N).all()


def test_one_motor_takes_one_number():
    chain = mechanisms.slider_crank()
    q, v = state_of(chain)
    t = [0.0, 0.3]
    ways = (lambda t, q, v: np.sin(t), lambda t, q, v: [np.sin(t)], lambda t, q, v: np.array([[np.sin(t)]])[0])
    one, *others = (simulate(chain, q, v, tau, t, rtol=1e-8, atol=1e-10).q for tau in ways)
    for other in others:
        np.testing.assert_array_equal(other, one)
    plain, listed = (simulate(chain, q, v, tau, t, rtol=1e-8, atol=1e-10).q for tau in (0.4, [0.4]))
    np.testing.assert_array_equal(plain, listed)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"rtol": 1.0}, "rtol = 1.0 but must lie between 0 and 1"),
        ({"atol": 2.0}, "atol = 2.0 but must lie between 0 and 1"),
        ({"atol": 0.0}, "atol = 0.0 but must lie between 0 and 1"),
        ({"initial": "force"}, "must be 'check' or 'project'"),
    ],
)
def test_options_of_a_simulation_are_checked(change, said):
    chain = mechanisms.slider_crank()
    q, v = state_of(chain)
    with pytest.raises(InvalidInputError, match=said):
        simulate(chain, q, v, None, [0.0, 0.1], **change)


def test_progress_is_a_share_of_the_span_whenever_it_begins():
    chain = mechanisms.slider_crank()
    q, v = state_of(chain)
    told: list[float] = []
    simulate(chain, q, v, None, [7.0, 7.2], progress=told.append)
    assert 0.0 < told[0] < 0.5
    assert told[-1] == pytest.approx(1.0, abs=1e-12)


def test_a_loop_that_cannot_close_is_not_simulated_however_it_begins():
    chain = mechanisms.four_bar((0.1, 0.2, 0.3, 5.0))
    with pytest.raises(AssemblyError, match=r"cannot be assembled near the given configuration: closure pin") as info:
        simulate(chain, np.zeros(3), np.zeros(3), None, [0.0, 0.1], initial="project")
    assert info.value.residual > 3.0


def test_a_mechanism_that_is_nearly_singular_all_along_is_simulated_as_any_other():
    """Two long links on a short crank and ground: they are nearly parallel wherever the crank is."""
    chain = mechanisms.four_bar((0.001, 1.0, 1.0, 0.002)).with_gravity(np.zeros(3))
    q = fb.assemble(chain, [0.8])
    v = fb.complement(chain, q) @ np.array([2.0])
    motion = simulate(chain, q, v, None, np.linspace(0.0, 2.0, 9))
    assert energy_balance(chain, motion).drift() < 1e-9
    assert np.ptp(motion.q[:, 0]) > 1.0


def test_a_singular_instant_does_not_touch_the_reactions_of_the_others():
    """At half a turn the double four-bar lies flat; what is determinate elsewhere stays so, and is the same."""
    chain, q, v = upright()
    free = chain.with_gravity((0.0, 0.0, 0.0))
    motion = fb.simulate(free, q, v, None, np.array([0.0, 1.0, 0.5 * np.pi, 2.0]))
    others = [0, 1, 3]
    names = ("t", "q", "v", "a", "N", "closure_residual")
    together = fb.inverse_dynamics(free, motion).reactions
    apart = fb.inverse_dynamics(free, fb.Trajectory(*(getattr(motion, name)[others] for name in names))).reactions
    assert np.isfinite(apart.closure_local[..., :2]).all()
    for name in ("closure_local", "joint_local", "multipliers"):
        np.testing.assert_allclose(getattr(together, name)[others], getattr(apart, name), rtol=0.0, atol=1e-12)
