"""Assemble, drive and complement: consistent with each other, on the branch, and honest when they cannot be."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mechanisms import (
    TILTED,
    add,
    at,
    bennett,
    double_four_bar,
    five_bar,
    four_bar,
    four_bar_angles,
    parallelogram,
    point,
    rscr,
    rssr,
    side_by_side,
    slider_crank,
    spherical_four_bar,
    welded_four_bar,
)

import fivebar_pin as fb
from fivebar_pin import Motion, paper
from fivebar_pin import motion as laws
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError
from fivebar_pin.mechanism.loops import loops_of


def turning(start: float, stop: float, n: int = 60) -> Motion:
    return laws.cycloidal(np.linspace(0.0, 1.0, n), start, stop)


def swinging(*means: float, amplitude: float = 0.25, n: int = 60) -> Motion:
    t = np.linspace(0.0, 1.0, n)
    return laws.combine(*(laws.harmonic(t, m, amplitude, period=1.0, phase=k) for k, m in enumerate(means)))


# Mechanism, motion of its motors, a configuration on its branch (or None).
CASES = {
    "five-bar": (five_bar(), swinging(2.0, 1.0), None),
    "five-bar, tilted, hinge closure": (five_bar(base=TILTED, kind="revolute"), swinging(2.0, 1.0), None),
    "four-bar, whole turns": (four_bar(), turning(0.3, 0.3 + 4.0 * np.pi), None),
    "four-bar, unbounded joints": (four_bar(joint=pin.JointModelRUBZ), turning(0.3, 0.3 + 4.0 * np.pi), None),
    "four-bar, welded": (welded_four_bar(base=TILTED), turning(0.3, 0.3 + 2.0 * np.pi), None),
    "slider-crank": (slider_crank(base=TILTED), turning(0.0, 2.0 * np.pi), None),
    "RSSR": (rssr(base=TILTED), swinging(0.3), None),
    "RSCR": (rscr()[0], swinging(0.5, amplitude=0.08), rscr()[1]),
    "Bennett": (bennett()[0], turning(1.1, 2.6), bennett()[1]),
    "double four-bar": (double_four_bar(), swinging(1.4), np.array([1.4, 1.4, -1.4, -1.4, 1.4])),
}
EACH = pytest.mark.parametrize(("chain", "motion", "near"), CASES.values(), ids=CASES.keys())


@pytest.fixture(scope="module")
def driven() -> dict[int, fb.Trajectory]:
    return {}


def drive(driven, chain, motion, near):
    """Drive once per module."""
    if id(chain) not in driven:
        start = None if near is None else fb.assemble(chain, motion.q[0], near)
        driven[id(chain)] = fb.drive(chain, motion, start)
    return driven[id(chain)]


def jacobian(chain: fb.ClosedChain, q: np.ndarray) -> np.ndarray:
    loops = loops_of(chain)
    poses = loops.tree.poses(q)
    return loops.see(poses.q).J


@EACH
def test_driven_motion_closes_the_loops_and_follows_the_motors(driven, chain, motion, near):
    trajectory = drive(driven, chain, motion, near)
    assert np.abs(fb.closure_residual(chain, trajectory.q)).max() <= 1e-12
    assert trajectory.worst_closure <= 1e-12
    loops = loops_of(chain)
    for column, k in enumerate(chain.actuated_index):
        turn = loops.tree.coordinate(trajectory.q, int(k)) - motion.q[:, column]
        np.testing.assert_allclose(np.sin(turn / 2.0), 0.0, rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(trajectory.v[:, chain.actuated_index], motion.v, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(trajectory.a[:, chain.actuated_index], motion.a, rtol=0.0, atol=1e-12)


@EACH
def test_complement_spans_what_the_closures_allow(driven, chain, motion, near):
    trajectory = drive(driven, chain, motion, near)
    J = jacobian(chain, trajectory.q)
    assert np.abs(np.matmul(J, trajectory.N)).max() <= 1e-12 * np.abs(trajectory.N).max()
    v = np.matmul(trajectory.N, motion.v[..., None])[..., 0]
    np.testing.assert_allclose(trajectory.v, v, rtol=0.0, atol=1e-12 * np.abs(v).max())
    np.testing.assert_allclose(fb.complement(chain, trajectory.q), trajectory.N, rtol=0.0, atol=1e-11)
    one = fb.complement(chain, trajectory.q[7])
    np.testing.assert_allclose(one, trajectory.N[7], rtol=0.0, atol=1e-11)


@EACH
def test_velocity_and_acceleration_are_the_rates_of_the_configuration(chain, motion, near):
    # A motion that is a polynomial in time between close instants: assemble there and difference.
    x0, v0, a0 = motion.q[20], motion.v[20], motion.a[20]
    h = 2e-3
    t = h * np.arange(-3, 4)
    local = Motion(
        t, x0 + np.outer(t, v0) + 0.5 * np.outer(t**2, a0), v0 + np.outer(t, a0), np.repeat(a0[None], 7, axis=0)
    )
    start = near if near is not None else fb.assemble(chain, motion.q[0])
    trajectory = fb.drive(chain, local, fb.assemble(chain, local.q[0], start))
    tree = loops_of(chain).tree
    away = tree.difference(np.repeat(trajectory.q[3:4], 7, axis=0), trajectory.q)
    d = [away[3 + k] - away[3 - k] for k in (1, 2, 3)]
    scale = max(1.0, np.abs(trajectory.v).max())
    rate = (45.0 * d[0] - 9.0 * d[1] + d[2]) / (60.0 * h)
    np.testing.assert_allclose(trajectory.v[3], rate, rtol=0.0, atol=1e-8 * scale)
    d = [trajectory.v[3 + k] - trajectory.v[3 - k] for k in (1, 2, 3)]
    rate = (45.0 * d[0] - 9.0 * d[1] + d[2]) / (60.0 * h)
    np.testing.assert_allclose(trajectory.a[3], rate, rtol=0.0, atol=1e-7 * max(1.0, np.abs(trajectory.a).max()))


@EACH
def test_driving_leaves_no_jump_between_samples(driven, chain, motion, near):
    trajectory = drive(driven, chain, motion, near)
    tree = loops_of(chain).tree
    step = np.abs(tree.difference(trajectory.q[:-1], trajectory.q[1:])).max(axis=1)
    h = np.diff(motion.t)
    bound = 1.5 * h * np.maximum(np.abs(trajectory.v[1:]).max(axis=1), np.abs(trajectory.v[:-1]).max(axis=1)) + 2e-2
    assert np.all(step <= bound)


@EACH
def test_results_are_read_only_and_inputs_untouched(driven, chain, motion, near):
    trajectory = drive(driven, chain, motion, near)
    for name in ("t", "q", "v", "a", "N", "closure_residual"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(trajectory, name)[...] = 0.0


def test_serial_four_bar_moves_as_elementary_geometry_says():
    chain, motion = welded_four_bar(), turning(0.3, 0.3 + 2.0 * np.pi)
    trajectory = fb.drive(chain, motion, fb.assemble(chain, [0.3], four_bar_angles(0.3)))
    expected = np.stack([four_bar_angles(x) for x in motion.q[:, 0]])
    gap = trajectory.q - expected
    np.testing.assert_allclose(np.sin(gap / 2.0), 0.0, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("case", ["I", "II"])
@pytest.mark.parametrize("mode", list(paper.AssemblyMode))
def test_the_papers_five_bar_moves_as_its_closed_form_says_on_both_modes(case, mode):
    linkage, motion = paper.table_1(case, "unbalanced"), paper.default_motion(samples=101)
    if case == "II":
        motion = swinging(2.0, 1.2, amplitude=0.2)
    chain = linkage.chain()
    trajectory = fb.drive(chain, motion, linkage.configuration(*motion.q[0], mode=mode))
    expected = linkage.configuration(motion.q[:, 0], motion.q[:, 1], mode=mode)
    np.testing.assert_allclose(np.sin((trajectory.q - expected) / 2.0), 0.0, rtol=0.0, atol=1e-12)
    assert trajectory.worst_closure <= 1e-13


# Links of 0.3 .. 2, where the tips of the cranks are neither too far apart nor too close.
LENGTH = st.floats(0.3, 2.0)
LENGTHS = st.tuples(LENGTH, LENGTH, LENGTH, LENGTH, LENGTH)
ANGLE = st.floats(-3.1, 3.1)
SIZE = st.sampled_from([1e-3, 1.0, 1e3])


def placed(lengths: tuple[float, ...], psi: float, gamma: float, size: float) -> tuple[paper.FiveBar, float]:
    """Return the linkage of these lengths times a size, and the distance of its cranks' tips without it."""
    a1, _, _, a4, a5 = lengths
    apart = abs(a5 + a4 * np.exp(1j * gamma) - a1 * np.exp(1j * psi))
    return paper.FiveBar(size * np.array(lengths), np.ones(4), np.ones(4), np.full(4, 0.5), np.zeros(4)), apart


@settings(max_examples=25, deadline=None, derandomize=True)
@given(lengths=LENGTHS, psi=ANGLE, gamma=ANGLE, mode=st.sampled_from(list(paper.AssemblyMode)), size=SIZE)
def test_any_five_bar_in_reach_has_two_modes_and_stays_on_the_one_it_was_given(lengths, psi, gamma, mode, size):
    linkage, apart = placed(lengths, psi, gamma, size)
    _, a2, a3, _, _ = lengths
    assume(1.05 * abs(a2 - a3) + 0.02 < apart < 0.95 * (a2 + a3))
    chain = linkage.chain()
    modes = fb.assembly_modes(chain, (psi, gamma))
    assert len(modes) == 2
    q = linkage.configuration(psi, gamma, mode=mode)
    own = [np.abs(np.sin((m - q) / 2.0)).max() < 1e-7 for m in modes]
    assert sum(own) == 1
    np.testing.assert_allclose(fb.assemble(chain, (psi, gamma), q), q, rtol=0.0, atol=1e-12)
    assert np.abs(fb.closure_residual(chain, modes)).max() <= 1e-12 * max(1.0, chain.length)


@settings(max_examples=15, deadline=None, derandomize=True)
@given(lengths=LENGTHS, psi=ANGLE, gamma=ANGLE, size=SIZE)
def test_any_five_bar_out_of_reach_is_told_by_how_much(lengths, psi, gamma, size):
    linkage, apart = placed(lengths, psi, gamma, size)
    _, a2, a3, _, _ = lengths
    gap = max(apart - a2 - a3, abs(a2 - a3) - apart)
    assume(apart > 1.02 * (a2 + a3) or apart < 0.98 * abs(a2 - a3) - 0.02)
    with pytest.raises(AssemblyError) as info:
        fb.assemble(linkage.chain(), (psi, gamma))
    assert 0.3 * gap * size <= info.value.residual <= 1.3 * gap * size + 1e-6 * size
    assert info.value.closure == "O3"


@pytest.mark.parametrize(
    ("chain", "x", "count"),
    [
        (five_bar(), [2.0, 1.0], 2),
        (five_bar(base=TILTED, kind="revolute"), [2.0, 1.0], 2),
        (four_bar(), [0.8], 2),
        (four_bar(joint=pin.JointModelRUBZ), [0.8], 2),
        (welded_four_bar(), [0.8], 2),
        (slider_crank(), [0.8], 2),
        (parallelogram(), [0.8], 2),
        (rscr()[0], [0.4], 4),
        (bennett()[0], [1.1], 1),
    ],
    ids=lambda x: getattr(x, "name", str(x)),
)
def test_assembly_modes_are_all_found_once(chain, x, count):
    modes = fb.assembly_modes(chain, x)
    assert modes.shape == (count, chain.nq)
    assert np.abs(fb.closure_residual(chain, modes)).max() <= 1e-12
    again = fb.assembly_modes(chain, x)
    np.testing.assert_array_equal(modes, again)


def test_assembly_modes_of_an_unreachable_input_are_none():
    assert fb.assembly_modes(five_bar((0.5, 0.8, 0.7, 0.6, 0.9)), [np.pi, 0.0]).shape == (0, 4)


@pytest.mark.parametrize("mode", [0, 1])
def test_assemble_near_a_closed_configuration_follows_its_branch(mode):
    chain = five_bar()
    start = fb.assembly_modes(chain, [2.0, 1.0])[mode]
    far = fb.assemble(chain, [2.9, 0.2], start)
    back = fb.assemble(chain, [2.0, 1.0], far)
    np.testing.assert_allclose(back, start, rtol=0.0, atol=1e-11)


def test_assemble_near_an_open_configuration_closes_it_on_the_nearest_branch():
    chain = five_bar()
    for mode in fb.assembly_modes(chain, [2.0, 1.0]):
        rough = mode + np.array([0.0, 0.12, 0.0, -0.1])
        np.testing.assert_allclose(fb.assemble(chain, [2.0, 1.0], rough), mode, rtol=0.0, atol=1e-11)


def test_assemble_takes_one_set_of_inputs_or_many():
    chain = five_bar()
    x = np.array([[2.0, 1.0], [2.1, 0.9], [2.2, 0.8]])
    near = fb.assemble(chain, x[0])
    many = fb.assemble(chain, x, near)
    assert many.shape == (3, 4)
    np.testing.assert_allclose(many[2], fb.assemble(chain, x[2], near), rtol=0.0, atol=1e-12)
    assert fb.assemble(chain, np.zeros((0, 2))).shape == (0, 4)


def test_assembly_is_reproducible_and_the_seed_matters_only_for_the_mode():
    chain = five_bar()
    first = fb.assemble(chain, [2.0, 1.0], seed=3)
    np.testing.assert_array_equal(first, fb.assemble(chain, [2.0, 1.0], seed=3))
    modes = fb.assembly_modes(chain, [2.0, 1.0])
    for seed in range(4):
        q = fb.assemble(chain, [2.0, 1.0], seed=seed)
        assert min(np.abs(np.sin((q - m) / 2.0)).max() for m in modes) < 1e-9


@pytest.mark.parametrize("near", [None, np.zeros(4)], ids=["from anywhere", "from a saddle"])
def test_out_of_reach_names_the_closure_and_the_gap(near):
    chain = five_bar((0.5, 0.8, 0.7, 0.6, 0.9))
    apart = 0.9 + 0.6 + 0.5  # both cranks turned outwards, against links of 0.8 + 0.7
    with pytest.raises(AssemblyError, match=r"cannot be assembled at the actuated coordinates .* closure tip") as info:
        fb.assemble(chain, [np.pi, 0.0], near)
    assert info.value.closure == "tip"
    assert info.value.residual == pytest.approx(apart - 1.5, rel=1e-3)
    assert info.value.sample is None


def test_a_search_that_starts_on_a_saddle_steps_aside():
    chain = five_bar()
    q = fb.assemble(chain, [np.pi, 0.0], np.zeros(4))  # all links on one line: the gap has no slope across it
    assert np.abs(fb.closure_residual(chain, q)).max() <= 1e-12
    assert abs(np.sin(q[1])) > 0.1


@pytest.mark.parametrize("joint", [pin.JointModelRUBZ, pin.JointModelRZ])
def test_whole_turns_lead_nowhere(joint):
    """The rocker of a crank-rocker swings through less than a turn: a whole turn on the way would be blocked."""
    chain = four_bar(joint=joint).with_actuated(["rocker"])
    start = fb.assemble(chain, [2.0])
    found, rocker = fb.assemble(chain, [2.0 + 4.0 * np.pi], start), chain.columns("rocker")[0]
    np.testing.assert_allclose(np.delete(found, rocker), np.delete(start, rocker), rtol=0.0, atol=1e-12)


def test_an_unbounded_joint_takes_the_short_way():
    chain = four_bar(joint=pin.JointModelRUBZ).with_actuated(["rocker"])
    start = fb.assemble(chain, [2.0])
    np.testing.assert_allclose(
        fb.assemble(chain, [2.0 + 3.98 * np.pi], start), fb.assemble(chain, [2.0 - 0.02 * np.pi], start), atol=1e-12
    )


def test_motion_that_leaves_the_reach_names_sample_time_closure_and_gap():
    chain = five_bar((0.5, 0.8, 0.7, 0.6, 0.9))
    t = np.linspace(0.0, 2.0, 101)
    motion = laws.combine(laws.cycloidal(t, 1.6, np.pi), laws.cycloidal(t, 1.5, 0.0))
    tips = 0.9 + 0.6 * np.exp(1j * motion.q[:, 1]) - 0.5 * np.exp(1j * motion.q[:, 0])
    first = int(np.argmax(np.abs(tips) > 1.5))
    with pytest.raises((AssemblyError, SingularityError)) as info:
        fb.drive(chain, motion)
    assert abs(info.value.sample - first) <= 1
    assert info.value.time == t[info.value.sample]
    assert str(info.value).startswith(f"sample {info.value.sample} (t = ")


def test_first_sample_out_of_reach_is_sample_zero():
    chain = five_bar((0.5, 0.8, 0.7, 0.6, 0.9))
    t = np.linspace(0.0, 1.0, 5)
    with pytest.raises(AssemblyError, match=r"sample 0 \(t = 0 s\): .* closure tip") as info:
        fb.drive(chain, laws.combine(laws.constant(t, np.pi), laws.constant(t, 0.0)))
    assert (info.value.sample, info.value.time) == (0, 0.0)


@pytest.mark.parametrize("n", [40, 400, 4000])
def test_motion_through_a_singularity_is_refused_however_it_is_sampled(n):
    # Flat at crank = pi: parallelogram and antiparallelogram meet there, the coupler aligned with crank and rocker.
    chain = parallelogram()
    start = next(m for m in fb.assembly_modes(chain, [0.8]) if abs(np.sin(m[0] + m[1])) < 1e-9)
    motion = turning(0.8, 5.0, n)
    crossing = int(np.argmax(motion.q[:, 0] > np.pi))
    with pytest.raises(SingularityError, match=r"type 2 singularity") as info:
        fb.drive(chain, motion, start)
    assert abs(info.value.sample - crossing) <= 1
    assert info.value.time == motion.t[info.value.sample]
    assert info.value.sigma < 1e-2


@pytest.mark.parametrize("chain", [parallelogram(), four_bar((0.4, 0.4, 1.1, 1.1)), four_bar((0.2, 1.0, 0.2, 1.0))])
def test_no_sampling_takes_a_motion_over_a_bifurcation(chain):
    """A whole turn of a change-point four-bar passes where two modes meet: no step may land beyond it unseen."""
    for n in range(6, 46):
        crank = 0.7 + np.linspace(0.0, 2.0 * np.pi, n) + 0.013 * n
        motion = Motion(np.linspace(0.0, 1.0, n), crank[:, None], np.full((n, 1), 2.0 * np.pi), np.zeros((n, 1)))
        for mode in fb.assembly_modes(chain, crank[:1], starts=12):
            with pytest.raises(SingularityError, match="type 2 singularity"):
                fb.drive(chain, motion, mode)


@pytest.mark.parametrize("kind", ["3d", "revolute"])
@pytest.mark.parametrize("arcs", [(0.5, 1.0, 0.5, 1.0), (0.6, 0.6, 1.1, 1.1), (0.6, 1.1, 1.1, 0.6)])
def test_a_loop_with_more_rows_than_passive_coordinates_is_not_taken_over_a_bifurcation(kind, arcs):
    """The passive Jacobian of a spherical four-bar is tall: a change of mode must show without a determinant."""
    chain = spherical_four_bar(arcs, kind=kind, base=TILTED)
    for n in (9, 20, 41, 100):
        start = fb.assembly_modes(chain, [0.4])[0]
        with pytest.raises(SingularityError, match="type 2 singularity"):
            fb.drive(chain, turning(0.4, 0.4 + 2.0 * np.pi, n), start)


@pytest.mark.parametrize("n", [9, 100])
def test_spherical_crank_rocker_turns_on_one_mode(n):
    """The crank makes a whole turn; the sense of (coupler axis, pin, rocker axis) never changes and it comes back."""
    arcs = (0.5, 1.2, 1.0, 1.1)
    chain = spherical_four_bar(arcs, base=TILTED)
    moved = fb.drive(chain, turning(0.4, 0.4 + 2.0 * np.pi, n), fb.assembly_modes(chain, [0.4])[0])
    poses = loops_of(chain).tree.poses(moved.q)
    pin_axis = poses.R[2] @ np.array([0.0, -np.sin(arcs[1]), np.cos(arcs[1])])
    sense = np.einsum("ni,ni->n", np.cross(poses.R[2][:, :, 2], pin_axis), poses.R[3][:, :, 2])
    assert np.abs(sense).min() > 0.1
    assert np.all(np.sign(sense) == np.sign(sense[0]))
    np.testing.assert_allclose(np.cos(moved.q[-1]), np.cos(moved.q[0]), atol=1e-12)


def test_motors_tied_to_each_other_are_suspected_when_the_loop_stays_open():
    """Crank and rocker both driven: only one rocker angle fits, and the error says that motors may be in the way."""
    chain = four_bar().with_actuated(["crank", "rocker"])
    moved = fb.drive(four_bar(), swinging(1.0))
    own = Motion(moved.t, moved.q[:, [0, 2]], moved.v[:, [0, 2]], moved.a[:, [0, 2]])
    wrong = Motion(moved.t, own.q + np.array([0.0, 0.3]), own.v, own.a)
    with pytest.raises(AssemblyError, match=r"2 closure rows for 1 passive .* tie the actuated joints to each other"):
        fb.drive(chain, wrong)


@pytest.mark.parametrize("mode", [0, 1])
def test_five_bar_driven_through_its_stretched_position_is_refused(mode):
    # The distal links line up on the way; both modes meet there and beyond it nothing closes.
    chain = five_bar((0.5, 0.8, 0.7, 0.6, 0.9))
    t = np.linspace(0.0, 1.0, 200)
    motion = laws.combine(laws.cycloidal(t, 1.6, np.pi), laws.constant(t, 0.6))
    start = fb.assembly_modes(chain, motion.q[0])[mode]
    with pytest.raises((AssemblyError, SingularityError), match=r"^sample \d+ \(t = "):
        fb.drive(chain, motion, start)


def test_motion_that_only_touches_the_singularity_is_refused():
    chain = parallelogram()
    start = next(m for m in fb.assembly_modes(chain, [0.8]) if abs(np.sin(m[0] + m[1])) < 1e-9)
    with pytest.raises(SingularityError):
        fb.drive(chain, turning(0.8, np.pi, 50), start)


def test_complement_at_a_singularity_says_which_configuration():
    chain = parallelogram()
    good = fb.assemble(chain, [0.8])
    with pytest.raises(SingularityError, match="configuration 1 is at a type 2 singularity") as info:
        fb.complement(chain, np.stack([good, np.zeros(3)]))
    assert (info.value.sample, info.value.sigma < 1e-7) == (1, True)


def test_motors_that_leave_the_motion_open_are_refused_with_a_way_out():
    chain = five_bar().with_actuated(["left"])
    for call in (
        lambda: fb.assemble(chain, [1.0]),
        lambda: fb.assembly_modes(chain, [1.0]),
        lambda: fb.complement(chain, np.zeros(4)),
        lambda: fb.drive(chain, turning(0.0, 1.0)),
    ):
        with pytest.raises(InvalidInputError, match=r"leave 1 coordinate\(s\) undetermined.*diagnose"):
            call()


def test_motors_that_depend_on_each_other_are_refused():
    chain = five_bar().with_actuated(["left", "right", "left_elbow"])
    q = fb.assemble(five_bar(), [2.0, 1.0])
    with pytest.raises(InvalidInputError, match=r"actuated joints .* are not independent"):
        fb.complement(chain, q)
    motion = laws.combine(*(laws.constant([0.0, 1.0], q[k]) for k in (0, 2, 1)))
    with pytest.raises(InvalidInputError, match=r"actuated joints .* are not independent"):
        fb.drive(chain, motion, q)


def test_joint_limits_are_checked_unless_told_otherwise():
    base = five_bar()
    model = base.model.copy()
    model.lowerPositionLimit[1], model.upperPositionLimit[1] = -1.2, 1.2
    chain = fb.ClosedChain(model, base.closures, base.actuated)
    motion = swinging(2.0, 1.0)
    free = fb.drive(chain, motion, limits="ignore")
    first = int(np.argmax(np.abs(free.q[:, 1]) > 1.2))
    with pytest.raises(InvalidInputError, match=rf"joint left_elbow at sample {first} .* must stay within its limits"):
        fb.drive(chain, motion, free.q[0])


def test_arguments_are_checked():
    chain = five_bar()
    q = fb.assemble(chain, [2.0, 1.0])
    with pytest.raises(InvalidInputError, match=r"motion columns = 1 but must be 2, one for each of left, right"):
        fb.drive(chain, turning(0.0, 1.0))
    with pytest.raises(InvalidInputError, match=r"shape of q_actuated = \(3,\) but must be \(2,\)"):
        fb.assemble(chain, [1.0, 2.0, 3.0])
    with pytest.raises(InvalidInputError, match=r"q_actuated\[1\] = nan but must be finite"):
        fb.assemble(chain, [1.0, np.nan])
    with pytest.raises(InvalidInputError, match=r"shape of near = \(3,\) but must be \(4,\)"):
        fb.assemble(chain, [2.0, 1.0], q[:3])
    with pytest.raises(InvalidInputError, match=r"shape of q = \(1, 3\) but must be \(n, 4\)"):
        fb.complement(chain, q[:3])
    with pytest.raises(InvalidInputError, match=r"shape of q"):
        fb.closure_residual(chain, np.zeros((2, 5)))
    with pytest.raises(InvalidInputError, match=r"q_actuated = \['a', 'b'\] but must be an array of numbers"):
        fb.assemble(chain, ["a", "b"])
    with pytest.raises(InvalidInputError, match=r"q = .* must be an array of numbers"):
        fb.complement(chain, [[1.0], [2.0, 3.0]])


def test_closure_residual_is_the_gap_in_the_axes_of_frame_one():
    chain = slider_crank()
    residual = fb.closure_residual(chain, np.zeros(3))
    # Rod end at 0.3 + 0.8 along x; slider pin at (0.1 + 0.2, 0.05); the rod's axes are the world's.
    np.testing.assert_allclose(residual, [0.3 - 1.1, 0.05, 0.0], rtol=0.0, atol=1e-15)
    assert fb.closure_residual(chain, np.zeros((4, 3))).shape == (4, 3)


def test_open_tree_passes_through():
    tree = fb.ClosedChain(five_bar().model, (), ("left", "left_elbow", "right", "right_elbow"))
    motion = swinging(0.1, 0.2, 0.3, 0.4)
    trajectory = fb.drive(tree, motion)
    np.testing.assert_array_equal(trajectory.q, motion.q)
    np.testing.assert_array_equal(trajectory.a, motion.a)
    np.testing.assert_array_equal(trajectory.N, np.repeat(np.eye(4)[None], len(motion), axis=0))
    assert fb.closure_residual(tree, motion.q).shape == (60, 0)


def test_one_sample_is_enough():
    chain = five_bar()
    one = Motion(np.array([0.5]), np.array([[2.0, 1.0]]), np.array([[1.0, -2.0]]), np.array([[3.0, 0.5]]))
    trajectory = fb.drive(chain, one)
    assert (len(trajectory), trajectory.q.shape, trajectory.N.shape) == (1, (1, 4), (1, 4, 2))


PARALLELOGRAM, CRANK_ROCKER = (0.5, 1.0, 0.5, 1.0), (0.4, 1.1, 0.9, 1.0)


@pytest.mark.parametrize("lengths", [(PARALLELOGRAM, CRANK_ROCKER), (CRANK_ROCKER, PARALLELOGRAM)])
def test_one_loop_at_its_singularity_is_enough_whichever_it_is(lengths):
    """Loops that share no joint are inverted one by one; the worst of them decides."""
    chain = side_by_side(*lengths)
    flat = lengths.index(PARALLELOGRAM)
    q = np.zeros(6)
    other = 3 * (1 - flat)
    q[other : other + 3] = fb.assemble(four_bar(CRANK_ROCKER), [0.8])
    assert np.abs(fb.closure_residual(chain, q)).max() <= 1e-12
    with pytest.raises(SingularityError, match="type 2 singularity") as info:
        fb.complement(chain, q)
    assert info.value.sigma < 1e-7
    upright = fb.assembly_modes(parallelogram(), [0.8])[0]
    q[3 * flat : 3 * flat + 3] = upright
    N = fb.complement(chain, q)
    np.testing.assert_allclose(N[3 * flat : 3 * flat + 3, flat], fb.complement(parallelogram(), upright)[:, 0])
    assert not N[3 * flat : 3 * flat + 3, 1 - flat].any()


@pytest.mark.parametrize("off", [0, 1])
def test_the_closure_named_is_the_one_that_stays_open_the_most(off):
    """Of two loops that share nothing one cannot close; the other does."""
    lengths = [CRANK_ROCKER, CRANK_ROCKER]
    lengths[off] = (0.4, 0.3, 0.2, 2.0)
    with pytest.raises(AssemblyError, match=f"closure pin{off} stays open") as info:
        fb.assemble(side_by_side(*lengths), [0.8, 0.8])
    assert info.value.closure == f"pin{off}"


@pytest.mark.parametrize("size", [1.0, 1e3, 1e6, 1e10])
def test_closed_is_relative_to_the_length_of_a_large_mechanism(size):
    """Whatever the unit of length: rounding is no gap, and does not tell one assembly mode from itself."""
    lengths = tuple(size * x for x in CRANK_ROCKER)
    chain = four_bar(lengths)
    q = fb.assemble(chain, [0.8])
    np.testing.assert_allclose(np.abs(fb.closure_residual(chain, q)).max(), 0.0, rtol=0.0, atol=1e-12 * size)
    assert len(fb.assembly_modes(chain, [0.8])) == 2
    moved = fb.drive(chain, turning(0.8, 1.8, 20), q)
    np.testing.assert_allclose(moved.v, fb.drive(four_bar(), turning(0.8, 1.8, 20), q).v, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("crossing", [0, 1])
def test_a_change_of_mode_shows_in_whichever_loop_it_is(crossing):
    """Two spherical loops side by side: the one turns through a bifurcation, the other rests."""
    arcs = [(0.5, 1.2, 1.0, 1.1), (0.5, 1.2, 1.0, 1.1)]
    arcs[crossing] = (0.5, 1.0, 0.5, 1.0)
    model, closures = pin.Model(), []
    for k, own in enumerate(arcs):
        part = spherical_four_bar(own, base=at(3.0 * k))
        ids = [0]
        for j in range(1, part.model.njoints):
            parent = ids[part.model.parents[j]]
            ids.append(
                add(
                    model,
                    parent,
                    part.model.joints[j],
                    part.model.jointPlacements[j],
                    f"{part.model.names[j]}{k}",
                    part.model.inertias[j],
                )
            )
        names = []
        for name in part.closures[0].frames:
            frame = part.model.frames[part.model.getFrameId(name)]
            names.append(point(model, ids[frame.parentJoint], f"{name}{k}", frame.placement))
        closures.append(fb.Closure((names[0], names[1]), name=f"pin{k}"))
    chain = fb.ClosedChain(model, tuple(closures), ("crank0", "crank1"))
    start = np.concatenate([fb.assembly_modes(spherical_four_bar(own), [0.4])[0] for own in arcs])
    t = np.linspace(0.0, 1.0, 41)
    ways = [laws.constant(t, 0.4), laws.constant(t, 0.4)]
    ways[1 - crossing] = laws.cycloidal(t, 0.4, 0.4 + 2.0 * np.pi)
    fb.drive(chain, laws.combine(*ways), start)
    ways = ways[::-1]
    with pytest.raises(SingularityError, match="type 2 singularity"):
        fb.drive(chain, laws.combine(*ways), start)


def test_closed_is_one_measure_for_lengths_and_angles_of_a_small_mechanism():
    """Of a micrometre, a gap of 1e-12 m would be a millionth: angles cannot be better than rounding, lengths are."""
    chain = five_bar(tuple(1e-6 * a for a in (0.5, 1.2, 1.0, 0.6, 0.9)), base=TILTED, kind="revolute")
    q = fb.assemble(chain, [2.0, 1.0])
    assert np.abs(fb.closure_residual(chain, q)[:3]).max() < 1e-18
    assert fb.drive(chain, swinging(2.0, 1.0), q).worst_closure < 1e-14


@pytest.mark.parametrize("off", [1e-2, 1e-6])
@pytest.mark.parametrize("side", ["lower", "upper"])
def test_a_limit_is_passed_by_any_amount_that_is_not_rounding(side, off):
    base = five_bar()
    free = fb.drive(base, swinging(2.0, 1.0))
    model, sign = base.model.copy(), 1.0 if side == "upper" else -1.0
    reached = sign * (sign * free.q[:, 3]).max()
    chain = fb.ClosedChain(model, base.closures, base.actuated)
    getattr(chain.model, f"{side}PositionLimit")[3] = reached
    assert len(fb.drive(chain, swinging(2.0, 1.0), free.q[0])) == 60
    getattr(model, f"{side}PositionLimit")[3] = reached - sign * off
    chain = fb.ClosedChain(model, base.closures, base.actuated)
    with pytest.raises(InvalidInputError, match=r"joint right_elbow at sample .* must stay within its limits"):
        fb.drive(chain, swinging(2.0, 1.0), free.q[0])


def test_a_way_out_of_reach_is_told_from_a_way_through_a_singularity():
    """From a closed configuration to one that no loop can close: the gap there is the evidence."""
    chain = five_bar((0.5, 0.8, 0.7, 0.6, 0.9))
    near = fb.assemble(chain, [1.6, 1.5])
    with pytest.raises(AssemblyError, match="cannot be assembled at these actuated coordinates: closure tip") as info:
        fb.assemble(chain, [np.pi, 0.0], near)
    assert info.value.residual == pytest.approx(0.9 + 0.6 + 0.5 - 1.5, rel=1e-3)


@pytest.mark.parametrize("samples", [1, 3])
def test_a_way_to_the_first_sample_that_is_blocked_is_told_of_the_first_sample(samples):
    """A five-bar that cannot reach where the motion begins."""
    chain = five_bar((0.5, 0.8, 0.7, 0.6, 0.9))
    near = fb.assemble(chain, [2.0, 1.0])
    x = np.tile([np.pi, 0.0], (samples, 1))
    still = np.zeros_like(x)
    with pytest.raises(AssemblyError, match=r"^sample 0 \(t = 5 s\)") as caught:
        fb.drive(chain, fb.Motion(5.0 + np.arange(float(samples)), x, still, still), near)
    assert (caught.value.sample, caught.value.time) == (0, 5.0)


def test_a_way_too_long_to_follow_to_the_first_sample_is_refused():
    """A slide that is to start a billion metres off."""
    chain = slider_crank().with_actuated(("slider",))
    near = fb.diagnose(chain).q
    with pytest.raises(InvalidInputError, match=r"step of motor 0 .* must be below"):
        fb.assemble(chain, [1e12], near)


@pytest.mark.parametrize("lengths", [(0.4, 1.1, 0.9, 0.6), (1.0, 2.0, 1.0, 2.0), (0.5, 1.0, 0.6, 0.9)])
@pytest.mark.parametrize("off", [0.0, 1e-12, 1e-8, 1e-6])
def test_a_folded_four_bar_has_one_mode_and_one_that_is_just_not_folded_two(lengths, off):
    chain = four_bar(lengths)
    (mode,) = fb.assembly_modes(chain, [off])
    assert np.abs(np.sin(mode)).max() < 2e-5
    assert len(fb.assembly_modes(chain, [1e-3])) == 2


def test_modes_between_which_a_rod_only_spins_are_one():
    chain = rssr(ball=True)
    modes = fb.assembly_modes(chain, [0.3])
    assert len(modes) == 2
    assert abs(np.sin(0.5 * (modes[0, -1] - modes[1, -1]))) > 0.1
