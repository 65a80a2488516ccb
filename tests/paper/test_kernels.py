"""The compiled kernels of the paper: the same uncompiled, one machine code for all memory layouts, cached by source."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fivebar_pin import paper
from fivebar_pin.errors import FiveBarPinError, InvalidInputError
from fivebar_pin.motion import Motion
from fivebar_pin.paper import kernels

RESULTS = ("angles", "rates", "accelerations", "partials", "torque", "joint_forces", "shaking_force")
RESULTS += ("shaking_moment", "frame_force", "frame_moment", "com")
GRAVITY = (0.7, -9.81, 0.3)
AGREE = (
    1e-13  # fused multiplication moves the last digits, and a nearly straight dyad makes more of them [of the largest]
)
ONE = np.ones((1, 2))


def straight(lengths, gamma):
    """Return a linkage and a motion of one sample, psi = 0."""
    linkage = paper.FiveBar(lengths, [0.1] * 4, [1e-4] * 4, [0.5] * 4, [0.0] * 4)
    return linkage, Motion(np.zeros(1), [[0.0, gamma]], np.zeros((1, 2)), np.zeros((1, 2)))


def large(*, size=1.0, mass=1.0, v=0.0, a=0.0, gravity=(0.0, 0.0, 0.0)):
    """Solve one state of case I, made larger, heavier or faster than double precision can hold."""
    small = paper.table_1("I", "unbalanced")
    linkage = paper.FiveBar(size * small.lengths, mass * small.masses, small.inertias, small.rho, small.alpha)
    return paper.solve_states(linkage, [[0.4, 1.3]], v * ONE, a * ONE, gravity=gravity)


TOO_LARGE = (
    ({"v": 1e160}, r"accelerations\[0, 1\] = nan"),
    ({"a": 1.7e308, "mass": 100.0}, r"torque\[0, \d\] = -?inf"),
    ({"gravity": (0.0, -1.7e308, 0.0), "mass": 100.0}, r"torque\[0, 0\] = "),
    ({"gravity": (0.0, 0.0, 1.7e308), "mass": 100.0}, r"frame_force\[0, 2\] = inf"),
    ({"gravity": (0.0, 0.0, 1e300), "size": 1e10}, r"frame_moment\[0, 0\] = inf"),
    ({"size": 1e160}, r"\(a2 a3\)\^2 = inf"),
    ({"size": 2e78}, r"\(a2 a3\)\^2 = inf"),
)


def refusals():
    """Yield calls that are refused: open, on a line, too large."""
    yield lambda: paper.solve(*straight((0.02, 0.05, 0.05, 0.1, 0.08), 0.0))
    yield lambda: paper.solve(*straight((0.1, 0.1, 0.1, 0.1, 0.2), 0.0))
    yield lambda: paper.solve(*straight((0.1, 0.2, 0.2, 0.1, 0.4), 0.0))
    yield lambda: straight((0.1, 0.1, 0.1, 0.1, 0.2), 0.0)[0].configuration(0.0, 0.0)
    yield lambda: straight((1e160, 1.0, 1.0, 1.0, 1.0), 0.0)[0].configuration(0.4, 1.3)
    for changes, _ in TOO_LARGE:
        yield lambda changes=changes: large(**changes)


def message(call):
    """Return what a refusal says."""
    with pytest.raises(FiveBarPinError) as caught:
        call()
    return f"{type(caught.value).__name__}: {caught.value}"


def outcomes():
    """Return results along whole turns in both modes and cases, unrelated states, and the words of every refusal."""
    found = []
    for case in ("I", "II"):
        for mode in paper.AssemblyMode:
            linkage, motion = paper.table_1(case, "unbalanced"), paper.default_motion(samples=60)
            found.append(paper.solve(linkage, motion, mode=mode, gravity=GRAVITY))
            found.append(paper.solve_states(linkage, motion.q, motion.v, motion.a, mode=mode))
    poses = paper.table_1("I", "unbalanced").configuration([0.1, 2.0], [1.0, 1.2])
    return [{name: getattr(s, name) for name in RESULTS} for s in found], poses, [message(call) for call in refusals()]


def test_uncompiled_the_kernels_give_the_same_numbers_and_the_same_words(tmp_path):
    """Nothing is divided by zero and no root is imaginary, which compiled code would pass over in silence."""
    place = tmp_path / "outcomes"
    code = "import sys, pickle, pathlib, test_kernels as k; "
    code += "pathlib.Path(sys.argv[1]).write_bytes(pickle.dumps(k.outcomes()))"
    here = Path(__file__).parent
    search = os.pathsep.join([str(here), str(here.parents[1]), *sys.path])
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": search}
    subprocess.run([sys.executable, "-W", "error", "-c", code, place], env=environment, check=True)
    solved, poses, words = pickle.loads(place.read_bytes())
    compiled_solved, compiled_poses, compiled_words = outcomes()
    assert words == compiled_words
    np.testing.assert_allclose(poses, compiled_poses, rtol=0.0, atol=AGREE)
    for one, other in zip(solved, compiled_solved, strict=True):
        for name in RESULTS:
            np.testing.assert_allclose(one[name], other[name], rtol=0.0, atol=AGREE * np.abs(other[name]).max())


def test_loading_the_paper_leaves_the_compiler_alone():
    code = "import sys, fivebar_pin.paper; print('numba' in sys.modules)"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "False"


def test_one_machine_code_serves_every_layout_of_memory():
    """Columns after each other or every second row of a table: the same numbers, and nothing compiled anew."""
    linkage, m = paper.table_1("I", "unbalanced"), paper.default_motion(samples=7)
    expected = paper.solve(linkage, m)
    spread = [np.repeat(x, 2, axis=0)[::2] for x in (m.q, m.v, m.a)]
    for q, v, a in ([np.asfortranarray(x) for x in (m.q, m.v, m.a)], spread):
        for found in (paper.solve(linkage, Motion(m.t, q, v, a)), paper.solve_states(linkage, q, v, a)):
            np.testing.assert_array_equal(found.torque, expected.torque)
    for kernel in (kernels.close_loops, kernels.move, kernels.load, kernels.unwind, kernels.next_doubtful):
        assert len(getattr(kernel, "signatures", "1")) == 1  # uncompiled there are none


@pytest.mark.parametrize("count", [0, 1])
def test_no_state_and_one_state_are_solved(count):
    q = np.full((count, 2), [0.4, 1.3])
    s = paper.solve_states(paper.table_1("I", "unbalanced"), q, q, q)
    assert s.joint_forces.shape == (count, 5, 2)
    assert s.partials.shape == (count, 2, 2)


def test_angles_are_unwound_as_numpy_does():
    """Random walks of up to three quarters of a turn a step, but for steps next to half a turn."""
    steps = np.random.default_rng(3).uniform(-4.7, 4.7, (2, 5000))
    steps[np.abs(np.abs(steps) - np.pi) < 1e-6] = 0.0
    angles = np.angle(np.exp(1j * np.cumsum(steps, axis=1)))
    expected = np.unwrap(angles, axis=1)
    kernels.unwind(angles)
    np.testing.assert_allclose(angles, expected, rtol=0.0, atol=1e-9)


def test_loops_are_refused_up_to_the_least_triangle_and_counted():
    """Twice the area of O2 O3 O4 is X, also by Heron's formula."""
    a2, a3 = 0.3, 0.4
    psi, gamma = np.array([[0.0, 0.5, np.pi, np.pi], [0.0, 1.2, 0.1, 1.5]])
    half, b, triangle = np.tan(0.5 * np.stack([psi, gamma], axis=1)), np.empty((4, 4), complex), np.empty((4, 3))
    d = np.abs(0.5 + 0.1 * np.exp(1j * gamma) - 0.1 * np.exp(1j * psi))
    squares = (a2 + a3 + d) * (a2 + a3 - d) * (d + a2 - a3) * (d - a2 + a3) / 4.0
    least = [0.0, *(np.sort(squares)[:-1] + np.sort(squares)[1:]) / 2.0, 1.0]
    for count, bound in enumerate(least):
        assert kernels.close_loops(np.array([0.1, a2, a3, 0.1, 0.5]), 1.0, bound, half, b, triangle) == count
        np.testing.assert_allclose(triangle[:, :2], np.stack([d**2, squares], axis=1), rtol=1e-12)


@pytest.mark.parametrize("fast", [0, 1])
@pytest.mark.parametrize("moving", [0, 1])
def test_an_interval_is_doubted_for_the_speed_of_either_end_and_of_either_motor(fast, moving):
    """Both samples lie still in the middle of what links 2 and 3 reach; one of four speeds may lead out and back."""
    lengths = np.array([0.1, 0.5, 0.5, 0.1, 0.5])
    q, v = np.full((2, 2), np.pi / 2), np.zeros((2, 2))
    t, triangle = np.array([0.0, 1.0]), np.full((2, 3), 0.25)
    room = 0.5  # from |O2 O4| = 0.5 m to both limits, 0 and 1 m
    for share, first in ((0.99, 1), (1.01, 0)):
        v[fast, moving] = -share * room / (2.0 * 0.1)
        assert kernels.next_doubtful(lengths, t, q, v, triangle, 0) == first
    v[:] = 0.0
    for share, first in ((0.99, 1), (1.01, 0)):
        q[1, moving] = np.pi / 2 + share * room / (2.0 * 0.1)
        assert kernels.next_doubtful(lengths, t, q, v, triangle, 0) == first


@pytest.mark.parametrize(("ends", "doubted"), [((0.45, 0.69), 0), ((0.69, 0.45), 0), ((0.45, 0.67), 1)])
def test_either_end_of_an_interval_may_be_near_the_reach(ends, doubted):
    """Links of 0.4 and 0.3 m reach 0.7 m; the way between the samples is 0.01 m, which counts twice."""
    assert doubt(ends) == doubted


@pytest.mark.parametrize(("ends", "doubted"), [((0.4, 0.11), 0), ((0.11, 0.4), 0), ((0.4, 0.13), 1)])
def test_either_end_of_an_interval_may_be_near_the_fold(ends, doubted):
    """Links of 0.4 and 0.3 m keep O2 and O4 0.1 m apart."""
    assert doubt(ends) == doubted


def doubt(ends):
    """Return 0 if the one interval between these distances of O2 and O4 is doubted, or else 1."""
    triangle = np.zeros((2, 3))
    triangle[:, 0] = np.square(ends)
    q = np.array([[0.0, 0.0], [0.1, 0.0]])
    return kernels.next_doubtful(
        np.array([0.1, 0.4, 0.3, 0.1, 0.5]), np.array([0.0, 1.0]), q, np.zeros((2, 2)), triangle, 0
    )


@pytest.mark.parametrize("pull", [0.0, 2.0, -2.0])
def test_weight_across_the_plane_turns_the_frame(pull):
    """c x m g about O1; without it there is no moment across, and no minus zero in tables."""
    s = large(v=1.0, gravity=(0.3, 0.0, pull))
    weight = s.linkage.masses.sum() * np.array([0.0, 0.0, pull])
    np.testing.assert_allclose(s.frame_moment[0, :2], np.cross(s.com[0], weight)[:2], rtol=1e-14)
    assert pull or not np.signbit(s.frame_moment[0, :2]).any()


@pytest.mark.parametrize(("joint", "axis"), [(0, 0), (0, 1), (4, 0), (4, 1)])
def test_a_force_that_is_too_large_alone_is_found(joint, axis):
    """Accelerations grow until just this component of f01 or f40 passes the largest number."""
    rng = np.random.default_rng(joint + axis)
    linkage = paper.FiveBar(
        [2e-6, 1e-5, 1e-5, 4e-6, 4e-6], 1e10 * rng.uniform(0.5, 5.0, 4), [1e-9] * 4, [0.5] * 4, [0.1] * 4
    )
    while True:
        q, a = [[rng.uniform(-np.pi, np.pi), rng.uniform(0.5, 2.0)]], rng.uniform(-1.0, 1.0, (1, 2))
        s = paper.solve_states(linkage, q, 0.0 * ONE, a)
        forces = np.abs(s.joint_forces[0])
        largest = forces[joint, axis]
        forces[joint, axis] = 0.0
        if largest > 1.05 * max(forces.max(), np.abs(s.shaking_force).max()):
            break
    scale = 1.02 * (np.finfo(float).max / largest)
    with pytest.raises(InvalidInputError, match=rf"joint_forces\[0, {joint}, {axis}\] = -?inf"):
        paper.solve_states(linkage, q, 0.0 * ONE, a * scale)


@pytest.mark.parametrize(("changes", "words"), TOO_LARGE)
def test_numbers_that_become_none_are_named(changes, words):
    """Infinity anywhere in the results is found by the one sum that the kernel returns."""
    with pytest.raises(InvalidInputError, match=words):
        large(**changes)
