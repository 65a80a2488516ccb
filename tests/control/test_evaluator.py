"""An evaluator is the mechanism, one sample at a time: it holds what whole motions give, or what it held before."""

from __future__ import annotations

import copy
import pickle
import threading
import tracemalloc
from collections.abc import Iterator

import mechanisms
import numpy as np
import pinocchio as pin
import pytest
import tied_chains

import fivebar_pin as fb
from fivebar_pin import Evaluator, JointSpring, Spring, shipped
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError, SolverError, UnknownNameError

RESULTS = ("q", "v", "a", "N", "q_actuated", "v_actuated", "a_actuated", "torque", "mass_matrix", "bias", "residual")
WRENCHES = ("shaking_force", "shaking_moment", "frame_force", "frame_moment")
ABOUT = (0.3, -0.2, 0.5)
SAMPLES = 12


def burdened(chain: fb.ClosedChain) -> fb.ClosedChain:
    """Return the chain with rotors, damping and dry friction in every joint, springs, and slanted gravity."""
    model, rng = chain.model.copy(), np.random.default_rng(3)
    model.armature[:] = rng.uniform(0.01, 0.05, model.nv)
    model.damping[:] = rng.uniform(0.01, 0.5, model.nv)
    model.upperDryFrictionLimit[:] = rng.uniform(0.01, 0.3, model.nv)
    model.lowerDryFrictionLimit[:] = -model.upperDryFrictionLimit
    model.gravity.linear = np.array([1.0, -9.0, 2.0])
    mechanisms.point(model, 0, "hook", mechanisms.at(0.3, -0.8, 0.4))
    mechanisms.point(model, model.njoints - 1, "eye", mechanisms.at(0.1, 0.2, 0.05, (0.3, 0.2, 0.1)))
    springs = (Spring("hook", "eye", 40.0, 0.2, 3.0), JointSpring(chain.actuated[0], 5.0, 1.0, 0.2))
    return fb.ClosedChain(model, chain.closures, chain.actuated, springs=springs)


def cases() -> Iterator[tuple[str, fb.ClosedChain, np.ndarray]]:
    """Yield every mechanism that ships, and ones of every joint and closure kind, each with a configuration."""
    for name in shipped.MECHANISMS:
        chain = fb.load(name)
        yield name, chain, chain.references["home"]
    for name, make in tied_chains.EXAMPLES.items():
        yield name, *make()
    yield "ball and slide", *mechanisms.rscr()
    yield "Bennett", *mechanisms.bennett()
    spherical = mechanisms.spherical_four_bar((0.5, 1.1, 0.9, 1.2))
    yield "spherical, overconstrained", spherical, fb.assembly_modes(spherical, [0.8])[0]
    tilted = mechanisms.five_bar(base=mechanisms.TILTED, joint=pin.JointModelRUBZ)
    yield "five-bar, tilted, continuous", tilted, fb.assembly_modes(tilted, [2.0, 1.0])[0]
    loops = mechanisms.double_four_bar()
    yield "two loops", loops, fb.assembly_modes(loops, [0.8])[0]


CASES = {name: (burdened(chain), q) for name, chain, q in cases()}
EACH = pytest.mark.parametrize(("chain", "q0"), CASES.values(), ids=CASES.keys())


def actuated_of(chain: fb.ClosedChain, q: np.ndarray) -> np.ndarray:
    """Return the actuated coordinates (na,) of a configuration."""
    at = [q[chain.columns(joint)[0]] for joint in chain.actuated]
    return np.array([x[0] if x.size == 1 else np.arctan2(x[1], x[0]) for x in at])


def moving(chain: fb.ClosedChain, q0: np.ndarray) -> tuple[fb.Motion, fb.Trajectory]:
    """Return a motion near q0 with unrelated rates at every sample."""
    rng, t = np.random.default_rng(0), np.linspace(0.0, 1.0, SAMPLES)
    away = 0.05 * np.sin(2.0 * t)[:, None] * rng.uniform(0.2, 1.0, chain.na)
    motion = fb.Motion(t, actuated_of(chain, q0) + away, *rng.normal(size=(2, SAMPLES, chain.na)))
    return motion, fb.drive(chain, motion, near=q0, limits="ignore")


def samples(motion: fb.Motion) -> Iterator[tuple[int, tuple[np.ndarray, np.ndarray, np.ndarray]]]:
    yield from enumerate(zip(motion.q, motion.v, motion.a, strict=True))


def close_to(have: np.ndarray, want: np.ndarray, scale: float, tolerance: float = 1e-12) -> None:
    np.testing.assert_allclose(have, want, rtol=0.0, atol=tolerance * scale)


def held(evaluator: Evaluator) -> dict[str, np.ndarray]:
    """Return copies of all that an evaluator holds."""
    return {name: np.array(getattr(evaluator, name)) for name in (*RESULTS, *WRENCHES)}


def assert_same(have: dict[str, np.ndarray], want: dict[str, np.ndarray]) -> None:
    for name, value in want.items():
        np.testing.assert_array_equal(have[name], value, err_msg=name)


def sizes(path: fb.Trajectory) -> dict[str, float]:
    """Return what round-off of q, v, a and N is measured by."""
    return {name: max(1.0, float(np.abs(getattr(path, name)).max())) for name in ("q", "v", "a", "N")}


@EACH
def test_kinematics_are_those_of_the_whole_motion(chain, q0):
    motion, path = moving(chain, q0)
    evaluator = Evaluator(chain, q0)
    for i, (x, v, a) in samples(motion):
        assert evaluator.kinematics(x, v, a) is evaluator.q
        for name, scale in sizes(path).items():
            close_to(getattr(evaluator, name), getattr(path, name)[i], scale)
        for have, want in ((evaluator.v_actuated, v), (evaluator.a_actuated, a)):
            np.testing.assert_array_equal(have, want)
        np.testing.assert_array_equal(np.exp(1j * evaluator.q_actuated), np.exp(1j * x))
        assert evaluator.residual <= 1e-12
        assert all(np.isnan(getattr(evaluator, name)).all() for name in ("torque", "mass_matrix", "bias", *WRENCHES))


@EACH
def test_loads_are_those_of_inverse_dynamics(chain, q0):
    motion, path = moving(chain, q0)
    push = np.random.default_rng(1).normal(size=(2, SAMPLES, 6))
    external = {"eye": push[0], "hook": push[1]}
    loads = fb.inverse_dynamics(chain, path, about=ABOUT, external=external)
    evaluator = Evaluator(chain, q0, about=ABOUT)
    for i, (x, v, a) in samples(motion):
        torque = evaluator.inverse(x, v, a, {"hook": push[1, i], "eye": push[0, i].tolist()})
        assert torque is evaluator.torque
        for name in ("torque", *WRENCHES):
            close_to(getattr(evaluator, name), getattr(loads, name)[i], loads.scale(name))
        close_to(evaluator.a, path.a[i], sizes(path)["a"])


@EACH
def test_mass_matrix_and_bias_are_those_of_reduced_dynamics(chain, q0):
    motion, path = moving(chain, q0)
    M, bias = fb.reduced_dynamics(chain, path.q, motion.v)
    scale = fb.inverse_dynamics(chain, path).scale("torque")
    evaluator = Evaluator(chain, q0)
    for i, (x, v, a) in samples(motion):
        evaluator.inverse(x, v, a)
        close_to(evaluator.mass_matrix, M[i], float(np.abs(M[i]).max()))
        np.testing.assert_array_equal(evaluator.mass_matrix, evaluator.mass_matrix.T)
        close_to(evaluator.bias, bias[i], scale)
        close_to(evaluator.mass_matrix @ a + evaluator.bias, evaluator.torque, scale)


@EACH
def test_forward_dynamics_undo_inverse_dynamics(chain, q0):
    motion, _ = moving(chain, q0)
    evaluator, push = Evaluator(chain, q0), {"eye": np.array([1.0, -2.0, 0.5, 0.3, -0.1, 0.2])}
    for _, (x, v, a) in samples(motion):
        evaluator.inverse(x, v, a, push)
        before = held(evaluator)
        assert evaluator.forward(x, v, before["torque"], push) is evaluator.a_actuated
        size = float(np.abs(np.linalg.inv(before["mass_matrix"])).max() * np.abs(before["torque"]).max())
        close_to(evaluator.a_actuated, a, max(1.0, size), 1e-10)
        for name, value in before.items():
            close_to(getattr(evaluator, name), value, max(1.0, size, float(np.abs(value).max())), 1e-10)


@pytest.mark.parametrize("name", ["five_bar_case_I", "delta", "rack and pinion", "sliding hinge", "two loops"])
def test_accelerations_are_those_of_forward_dynamics(name):
    chain, q0 = CASES[name]
    motion, path = moving(chain, q0)
    tau = np.random.default_rng(5).normal(size=(SAMPLES, chain.na))
    a = fb.forward_dynamics(chain, path.q, path.v, tau)
    evaluator = Evaluator(chain, q0)
    for i, (x, v, _) in samples(motion):
        evaluator.forward(x, v, tau[i])
        close_to(evaluator.a, a[i], float(np.abs(a).max()), 1e-10)


@EACH
def test_frames_move_as_along_the_whole_motion(chain, q0):
    motion, path = moving(chain, q0)
    evaluator = Evaluator(chain, q0)
    along = {name: fb.frame_motion(chain, path, name) for name in ("eye", "hook", f"{chain.joints[0]}")}
    for i, (x, v, a) in samples(motion):
        (evaluator.kinematics if i % 2 else evaluator.inverse)(x, v, a)
        for name, moved in along.items():
            here = evaluator.frame(name)
            assert here is evaluator.frame(name)
            for word in moved.__slots__:
                want = getattr(moved, word)
                close_to(getattr(here, word), want[i], max(1.0, float(np.abs(want).max())))


def test_the_power_of_the_motors_is_the_rate_of_energy():
    """Along a motion of a mechanism without losses, by differences over a short time on either side."""
    chain = mechanisms.five_bar(base=mechanisms.TILTED)
    evaluator = Evaluator(chain, fb.assembly_modes(chain, [2.0, 1.0])[0])
    masses = [(f"{joint}_body", chain.model.inertias[chain.model.getJointId(joint)]) for joint in chain.joints]
    x, v, a, dt = np.array([2.1, 0.9]), np.array([1.3, -0.7]), np.array([-2.0, 3.0]), 1e-4

    def energy(t: float) -> float:
        rate = v + a * t
        evaluator.inverse(x + v * t + 0.5 * a * t * t, rate, a)
        stored = 0.5 * rate @ evaluator.mass_matrix @ rate
        for frame, body in masses:
            at = evaluator.frame(frame)
            stored -= body.mass * chain.model.gravity.linear @ (at.position + at.rotation @ body.lever)
        return float(stored)

    rate = (8.0 * (energy(dt) - energy(-dt)) - (energy(2.0 * dt) - energy(-2.0 * dt))) / (12.0 * dt)
    power = evaluator.inverse(x, v, a) @ v
    assert power == pytest.approx(rate, rel=1e-8)


def test_it_starts_from_what_is_given_or_named_or_can_be_found():
    chain = fb.load("four_bar_crank_rocker")
    modes = fb.assembly_modes(chain, [0.7])
    for q in modes:
        np.testing.assert_allclose(Evaluator(chain, q).q, q, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(Evaluator(chain, q + np.array([0.0, 0.02, -0.03])).q, q, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(Evaluator(chain).q, chain.references["home"], rtol=0.0, atol=1e-9)
    nameless = mechanisms.four_bar()
    evaluator = Evaluator(nameless)
    np.testing.assert_allclose(fb.closure_residual(nameless, evaluator.q), 0.0, atol=1e-12)
    assert not evaluator.v.any() and not evaluator.a.any()
    with pytest.raises(AssemblyError, match="cannot be assembled"):
        Evaluator(mechanisms.four_bar((0.1, 0.2, 0.1, 5.0)), np.zeros(3))
    with pytest.raises(InvalidInputError, match="undetermined"):
        Evaluator(nameless.with_actuated(()))
    with pytest.raises(SingularityError, match="type 2 singularity"):
        Evaluator(mechanisms.parallelogram(), np.zeros(3))


def test_it_stays_on_its_assembly_mode():
    chain = mechanisms.four_bar()
    for near in fb.assembly_modes(chain, [0.7]):
        evaluator = Evaluator(chain, near)
        for crank in (1.7, 3.4, 5.2, 0.7 + 2.0 * np.pi):
            evaluator.kinematics([crank], [0.0], [0.0])
        np.testing.assert_allclose(np.exp(1j * evaluator.q), np.exp(1j * near), rtol=0.0, atol=1e-12)


def test_a_joint_that_does_not_count_its_turns_goes_the_shorter_way():
    """A rocker whose other way round is blocked: it cannot turn over."""
    chain = mechanisms.four_bar(joint=pin.JointModelRUBZ).with_actuated(("rocker",))
    start = next(fb.assembly_modes(chain, [angle])[0] for angle in (2.0, 2.2) if len(fb.assembly_modes(chain, [angle])))
    evaluator, x = Evaluator(chain, start), actuated_of(chain, start)
    for turns in (1, -3, 7):
        evaluator.kinematics(x + 2.0 * np.pi * turns + 0.01, [0.0], [0.0])
        assert np.exp(1j * actuated_of(chain, evaluator.q)) == pytest.approx(np.exp(1j * (x + 0.01)), abs=1e-12)
        evaluator.kinematics(x, [0.0], [0.0])
    np.testing.assert_allclose(evaluator.q, start, rtol=0.0, atol=1e-12)


FIVE_BAR, FIVE_BAR_START = mechanisms.five_bar((0.5, 0.9, 0.8, 0.6, 0.9)), [2.0, 1.0]
AT, RATE = np.array([2.1, 0.9]), np.array([0.4, -0.3])


def at_work() -> Evaluator:
    """Return an evaluator of the five-bar after a sample."""
    evaluator = Evaluator(FIVE_BAR, fb.assembly_modes(FIVE_BAR, FIVE_BAR_START)[0])
    evaluator.inverse(AT, RATE, RATE)
    return evaluator


REFUSED = {
    "out of reach": (
        lambda e: e.inverse([np.pi, 0.0], RATE, RATE),
        AssemblyError,
        r"on the way to the actuated coordinates \[3.14\d*, 0.0\]: the mechanism cannot be assembled .* closure tip",
    ),
    "nan": (
        lambda e: e.inverse(AT, np.array([0.1, np.nan]), RATE),
        InvalidInputError,
        r"v_actuated\[1\] = nan but must",
    ),
    "infinity": (lambda e: e.forward(AT, RATE, np.array([np.inf, 0.0])), InvalidInputError, r"tau\[0\] = inf but must"),
    "infinite in a list": (
        lambda e: e.kinematics(AT, RATE, [0.0, -np.inf]),
        InvalidInputError,
        r"a_actuated\[1\] = -inf",
    ),
    "too many of the last": (
        lambda e: e.inverse(AT + 0.1, 2.0 * RATE, [0.0, 0.0, 0.0]),
        InvalidInputError,
        r"shape of a_actuated = \(3,\) but must be \(2,\)",
    ),
    "too few": (
        lambda e: e.inverse(AT[:1], RATE, RATE),
        InvalidInputError,
        r"shape of q_actuated = \(1,\) but must be",
    ),
    "one number": (lambda e: e.forward(AT, RATE, 1.0), InvalidInputError, r"shape of tau = \(\) but must be \(2,\)"),
    "text": (lambda e: e.kinematics(AT, "ab", RATE), InvalidInputError, r"v_actuated = 'ab' but must be"),
    "too far": (
        lambda e: e.kinematics(AT + np.array([0.0, 2e6]), RATE, RATE),
        InvalidInputError,
        r"step of right = 2000000.0 but must be below 1e\+06 rad, or lengths of the chain. Go there in several calls",
    ),
    "too fast": (lambda e: e.inverse(AT, 1e200 * RATE, RATE), InvalidInputError, r"is beyond what can be computed"),
    "unknown frame": (
        lambda e: e.inverse(AT, RATE, RATE, {"tip": np.zeros(6)}),
        UnknownNameError,
        r"Unknown frame of an external force 'tip'; known: .*tip_left",
    ),
    "wrench of three": (
        lambda e: e.inverse(AT, RATE, RATE, {"tip_left": np.zeros(3)}),
        InvalidInputError,
        r"shape of external\['tip_left'\] = \(3,\) but must be \(6,\)",
    ),
    "wrench of nan": (
        lambda e: e.forward(AT, RATE, RATE, {"tip_left": np.full(6, np.nan)}),
        InvalidInputError,
        r"external\['tip_left'\]\[0\] = nan but must be finite",
    ),
    "jump to an open place": (
        lambda e: e.jump(e.q + 0.1),
        InvalidInputError,
        r"closure tip at state 0 = .* Use assemble",
    ),
    "jump with too few": (lambda e: e.jump(AT), InvalidInputError, r"shape of q = \(2,\) but must be \(4,\)"),
}


@pytest.mark.parametrize(("ask", "kind", "message"), REFUSED.values(), ids=REFUSED.keys())
def test_after_an_error_it_stands_where_it_stood(ask, kind, message):
    evaluator = at_work()
    before, tip = held(evaluator), np.array(evaluator.frame("tip_left").position)
    with pytest.raises(kind, match=f"(?s){message}"):
        ask(evaluator)
    assert_same(held(evaluator), before)
    np.testing.assert_array_equal(evaluator.frame("tip_left").position, tip)
    other = at_work()
    for one in (evaluator, other):
        one.inverse(AT + 0.02, RATE, RATE)
    assert_same(held(evaluator), held(other))


def test_a_singularity_on_the_way_is_named_and_leaves_it_where_it_stood():
    chain = mechanisms.parallelogram()
    evaluator = Evaluator(chain, fb.assembly_modes(chain, [0.5])[0])
    before = held(evaluator)
    with pytest.raises(
        SingularityError, match=r"on the way to the actuated coordinates \[-0.5\]: .*type 2 singularity"
    ):
        evaluator.kinematics([-0.5], [1.0], [0.0])
    assert_same(held(evaluator), before)
    with pytest.raises(SingularityError, match="type 2 singularity"):
        evaluator.jump(np.zeros(3))
    assert_same(held(evaluator), before)


def test_a_hinge_back_to_front_is_no_place_to_stand():
    model = pin.Model()
    arm = mechanisms.add(model, 0, pin.JointModelRX(), mechanisms.at(), "arm", mechanisms.body(1))
    ends = (mechanisms.point(model, 0, "pin", mechanisms.at()), mechanisms.point(model, arm, "eye", mechanisms.at()))
    evaluator = Evaluator(fb.ClosedChain(model, (fb.Closure(ends, "revolute"),), ()), [0.0])
    evaluator.kinematics([], [], [])
    with pytest.raises(InvalidInputError, match=r"q = array\(\[3.14\d*\]\) but closes a hinge .* Use assemble"):
        evaluator.jump([np.pi])
    np.testing.assert_array_equal(evaluator.q, [0.0])


def test_a_spring_without_direction_and_a_motion_without_mass_are_refused():
    spring = Spring("tip_left", "tip_right", 10.0, 0.1)
    evaluator = Evaluator(FIVE_BAR.with_springs([spring]), fb.assembly_modes(FIVE_BAR, FIVE_BAR_START)[0])
    evaluator.kinematics(AT, RATE, RATE)
    before = held(evaluator)
    with pytest.raises(SolverError, match=r"spring tip_left~tip_right has its ends on one point.*free length of zero"):
        evaluator.inverse(AT, RATE, RATE)
    assert_same(held(evaluator), before)
    light = FIVE_BAR.with_inertial_parameters(np.zeros((4, 10)))
    evaluator = Evaluator(light, fb.assembly_modes(FIVE_BAR, FIVE_BAR_START)[0])
    with pytest.raises(InvalidInputError, match=r"inertia of the motion = 'singular'.*moves no mass.*an armature"):
        evaluator.forward(AT, RATE, RATE)
    assert not evaluator.inverse(AT, RATE, RATE).any()


def test_motors_that_closures_tie_to_each_other_are_refused():
    chain = mechanisms.four_bar().with_actuated(("crank", "rocker"))
    q = fb.assembly_modes(mechanisms.four_bar(), [0.7])[0]
    with pytest.raises(InvalidInputError, match="are not independent"):
        Evaluator(chain, q)


def test_a_jump_leads_to_another_assembly_mode_at_rest():
    first, second = fb.assembly_modes(FIVE_BAR, AT)[:2]
    evaluator, other = Evaluator(FIVE_BAR, first), Evaluator(FIVE_BAR, second)
    evaluator.inverse(AT, RATE, RATE)
    evaluator.jump(second)
    np.testing.assert_allclose(evaluator.q, second, rtol=0.0, atol=1e-12)
    assert not evaluator.v.any() and not evaluator.frame("tip_left").velocity.any()
    assert np.isnan(evaluator.torque).all()
    for one in (evaluator, other):
        one.inverse(AT + 0.05, RATE, RATE)
    assert_same(held(evaluator), held(other))


def test_results_are_views_that_cannot_be_written():
    evaluator = at_work()
    for name in (*RESULTS, *WRENCHES):
        view = getattr(evaluator, name)
        with pytest.raises(ValueError, match="read-only"):
            view[...] = 0.0
        with pytest.raises(AttributeError, match=f"{name} of an evaluator is computed, not set; jump"):
            setattr(evaluator, name, view)
    torque = evaluator.torque
    evaluator.inverse(AT, RATE, 2.0 * RATE)
    assert torque is evaluator.torque
    with pytest.raises(ValueError, match="read-only"):
        evaluator.frame("tip_left").position[0] = 1.0


@pytest.mark.parametrize(
    "make",
    [Evaluator.copy, copy.copy, copy.deepcopy, lambda e: pickle.loads(pickle.dumps(e))],
    ids=["copy", "copy.copy", "deepcopy", "pickle"],
)
def test_a_copy_goes_its_own_way_from_where_the_first_one_stands(make):
    evaluator = at_work()
    other, before = make(evaluator), held(evaluator)
    assert_same(held(other), before)
    other.inverse(AT + 0.3, RATE, RATE)
    assert_same(held(evaluator), before)
    evaluator.inverse(AT + 0.3, RATE, RATE)
    assert_same(held(evaluator), held(other))


def test_what_travelled_runs_the_code_that_is_compiled_already():
    """Compiled code is for records that cannot be written, which NumPy forgets in a pickle: it would compile again."""
    first, other = at_work(), pickle.loads(pickle.dumps(at_work()))
    assert other._I.flags.writeable == first._I.flags.writeable
    assert other._W.flags.writeable == first._W.flags.writeable


def test_another_thread_is_refused_while_it_is_at_work():
    evaluator = at_work()
    with evaluator._lock:  # as one that computes holds it
        for ask in (
            lambda: evaluator.kinematics(AT, RATE, RATE),
            lambda: evaluator.frame("tip_left"),
            lambda: evaluator.jump(evaluator.q),
            evaluator.copy,
        ):
            with pytest.raises(InvalidInputError, match=r"at work in another thread. Give each thread its copy\(\)"):
                ask()
    evaluator.kinematics(AT, RATE, RATE)


def test_copies_in_threads_compute_what_one_does_alone():
    chain, q0 = CASES["planar_3rrr"]
    motion, _ = moving(chain, q0)
    first = Evaluator(chain, q0)

    def torques(evaluator: Evaluator, out: list[np.ndarray]) -> None:
        out.extend(np.array(evaluator.inverse(*sample)) for _ in range(50) for _, sample in samples(motion))

    alone: list[np.ndarray] = []
    each: list[list[np.ndarray]] = [[] for _ in range(4)]
    copies = [first.copy() for _ in range(5)]
    torques(copies[0], alone)
    threads = [threading.Thread(target=torques, args=pair) for pair in zip(copies[1:], each, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for out in each:
        np.testing.assert_array_equal(out, alone)


def test_a_call_makes_no_arrays():
    evaluator, push = at_work(), {"tip_left": np.ones(6)}
    evaluator.inverse(AT, RATE, RATE, push)
    evaluator.frame("tip_left")
    tracemalloc.start()
    try:
        evaluator.kinematics(AT, RATE, RATE)
        tracemalloc.reset_peak()
        before = tracemalloc.get_traced_memory()[0]
        for _ in range(20):
            evaluator.inverse(AT, RATE, RATE, push)
            evaluator.forward(AT, RATE, RATE)
            evaluator.frame("tip_left")
        after, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak - before < 2000  # bytes: names and numbers of Python, no array
    assert after - before < 1000
