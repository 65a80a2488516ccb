"""The branch that a motion follows: never left, however it is sampled, and never lost where the way is clear."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import add, at, body, four_bar, point

import fivebar_pin as fb
from fivebar_pin import Motion
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError
from fivebar_pin.kinematics import follow

FIRST, SECOND = (0.4, 1.1, 0.9, 1.0), (0.3, 1.0, 0.9, 1.1)


def in_a_row(*lengths: tuple[float, ...]) -> fb.ClosedChain:
    """Return four-bars of which the rocker of each is the crank of the next: one group of closures."""
    model, closures, x = pin.Model(), [], 0.0
    crank = add(model, 0, pin.JointModelRZ(), at(), "crank", body(1))
    for k, (a, b, c, d) in enumerate(lengths):
        coupler = add(model, crank, pin.JointModelRZ(), at(a), f"coupler{k}", body(2 * k + 2))
        point(model, coupler, f"end{k}", at(b))
        x += d
        crank = add(model, 0, pin.JointModelRZ(), at(x), f"rocker{k}", body(2 * k + 3))
        point(model, crank, f"pin{k}", at(c))
        closures.append(fb.Closure((f"end{k}", f"pin{k}"), name=f"loop{k}"))
    return fb.ClosedChain(model, closures, ("crank",))


def assembled(lengths: list[tuple[float, ...]], crank: float, modes: list[int]) -> np.ndarray:
    """Return a closed configuration of four-bars in a row, each loop on a mode of its own."""
    chain, q = in_a_row(*lengths), {"crank": crank}
    for k, (own, mode) in enumerate(zip(lengths, modes, strict=True)):
        found = sorted(fb.assembly_modes(four_bar(own), [crank]), key=lambda q: np.sin(q[0] + q[1] - q[2]))[mode]
        q |= {f"coupler{k}": found[1], f"rocker{k}": found[2]}
        crank = found[2]
    return np.array([q[joint] for joint in chain.joints])


def jumps(n: int) -> bool:
    """Whether a crank is taken over the few degrees at half a turn where its rocker and coupler do not reach it."""
    chain = four_bar((0.4, 0.8, 0.599, 1.0))
    crank = np.linspace(1.4, 4.7, n)[:, None]
    motion = Motion(np.linspace(0.0, 1.0, n), crank, np.full((n, 1), 3.3), np.zeros((n, 1)))
    start = max(fb.assembly_modes(chain, [1.4]), key=lambda q: q[1])
    try:
        fb.drive(chain, motion, start)
    except (AssemblyError, SingularityError):
        return False
    return True


@pytest.mark.parametrize("n", [2, 5, 17, 60])
def test_no_sampling_takes_a_crank_over_the_few_degrees_that_its_dyad_does_not_reach(n):
    assert not jumps(n)


CHANGE_POINTS = [(0.5, 1.0, 0.5, 1.0), (0.5, 0.8, 0.5, 0.8), (0.2, 1.0, 0.2, 1.0)]


def turned_once(chain: fb.ClosedChain, start: np.ndarray, n: int) -> fb.Trajectory:
    crank = start[0] + np.linspace(0.0, 2.0 * np.pi, n)[:, None]
    return fb.drive(chain, Motion(np.linspace(0.0, 1.0, n), crank, np.full((n, 1), 2.0 * np.pi), 0.0 * crank), start)


@pytest.mark.parametrize("modes", [(0, 0), (0, 1), (1, 0), (1, 1)])
@pytest.mark.parametrize(("first", "second"), [(0, 1), (2, 1), (0, 2)])
def test_two_loops_that_lie_flat_together_are_not_taken_over_their_bifurcation(first, second, modes):
    """Both determinants change their sign there, and so that of the whole does not."""
    lengths = [CHANGE_POINTS[first], CHANGE_POINTS[second]]
    chain, start = in_a_row(*lengths), assembled(lengths, 1.4, modes)
    for n in (6, 23, 100):
        with pytest.raises(SingularityError, match="type 2 singularity"):
            turned_once(chain, start, n)


@pytest.mark.parametrize("n", [6, 100])
def test_two_loops_that_never_lie_flat_turn_as_often_as_asked(n):
    lengths = [FIRST, (0.3, 1.0, 0.9, 1.1)]
    path = turned_once(in_a_row(*lengths), assembled(lengths, 1.4, [0, 1]), n)
    np.testing.assert_allclose(np.exp(1j * path.q[-1]), np.exp(1j * path.q[0]), rtol=0.0, atol=1e-9)


def clear_swing(n: int) -> tuple[fb.ClosedChain, Motion]:
    """Return the paper's five-bar and a long motion of both cranks that takes many turns."""
    chain = fb.load("five_bar_case_I")
    t = np.linspace(0.0, 1.0, n)
    q = np.column_stack([40.0 * t, 1.2 + 0.3 * np.sin(9.0 * t)])
    return chain, Motion(t, q, np.column_stack([40.0 + 0.0 * t, 2.7 * np.cos(9.0 * t)]), 0.0 * q)


def test_any_number_of_threads_drives_a_long_motion_to_the_same_last_digit():
    chain, motion = clear_swing(20_000)
    one, *others = (fb.drive(chain, motion, threads=k) for k in (1, 2, 5))
    for other in others:
        for name in ("q", "v", "a", "N", "closure_residual"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_a_long_motion_that_goes_round_a_singularity_is_followed_though_its_straight_lines_cross_it():
    """Half a turn of both cranks together: the straight line between chunks leads through the stretched dyad."""
    chain = fb.load("five_bar_case_I")
    n = 3 * follow._CHUNK
    t = np.linspace(0.0, 1.0, n)
    q = np.column_stack([2.0 * np.pi * t, np.pi / 3.0 + np.pi / 6.0 * (1.0 - np.cos(2.0 * np.pi * t))])
    far = np.column_stack([q[:, 0], q[:, 1] + 0.9 * np.sin(6.0 * np.pi * t) ** 2])
    short = fb.drive(chain, Motion(t[::7], far[::7], 0.0 * far[::7], 0.0 * far[::7]))
    long = fb.drive(chain, Motion(t, far, 0.0 * far, 0.0 * far))
    np.testing.assert_allclose(long.q[::7], short.q, rtol=0.0, atol=1e-12)


def test_threads_that_are_none_are_refused():
    chain, motion = clear_swing(3)
    with pytest.raises(InvalidInputError, match="threads = 0 but must be an integer of at least 1"):
        fb.drive(chain, motion, threads=0)


@pytest.mark.parametrize("turns", [1, -3, 800, 159_154_943])
def test_whole_turns_of_a_motor_that_nothing_counts_lead_to_the_same_pose(turns):
    chain = fb.load("four_bar_crank_rocker")
    start = fb.assemble(chain, [0.7])
    crank = chain.actuated_index[0]
    found = fb.assemble(chain, [0.7 + 2.0 * np.pi * turns], start)
    assert found[crank] == 0.7 + 2.0 * np.pi * turns
    np.testing.assert_allclose(
        np.exp(1j * found), np.exp(1j * start), rtol=0.0, atol=1e-7 * max(1.0, abs(turns) * 1e-8)
    )


def test_turns_that_a_coupling_counts_are_made():
    """A wheel of 5 to 2 stands elsewhere after one turn."""
    model = pin.Model()
    for name in ("crank", "wheel"):
        add(model, 0, pin.JointModelRZ(), at(), name, body(1))
    chain = fb.ClosedChain(model, (fb.closures.Coupling({"crank": 2.5, "wheel": 1.0}),), ("crank",))
    start = fb.assemble(chain, [0.0])
    assert fb.assemble(chain, [20.0 * np.pi], start)[1] - start[1] == pytest.approx(-50.0 * np.pi, rel=1e-14)


def test_a_step_that_would_take_for_ever_is_refused():
    chain = fb.load("four_bar_crank_rocker")
    motion = Motion([0.0, 1.0], [[0.7], [0.7 + 2e6]], np.zeros((2, 1)), np.zeros((2, 1)))
    with pytest.raises(
        InvalidInputError, match=r"step of motor 0 to sample 1 = 2000000.0 but must be below 1e\+06 rad"
    ):
        fb.drive(chain, motion)
