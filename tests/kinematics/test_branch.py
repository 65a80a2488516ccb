"""Guards of the branch that a motion follows, each where no other one speaks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import add, at, body, four_bar, point, spherical_four_bar

import fivebar_pin as fb
from fivebar_pin import Motion
from fivebar_pin.errors import BranchError, SingularityError
from fivebar_pin.kinematics import branch
from fivebar_pin.mechanism.closing import CLOSED
from fivebar_pin.mechanism.loops import loops_of

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


def misled(monkeypatch, chain: fb.ClosedChain, start: np.ndarray, wrong: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Drive a swing twice, the second time with a few samples begun from a wrong place; return both ways."""
    loops, n = loops_of(chain), 21
    X = start[chain.actuated_index] + np.linspace(0.0, 0.1, n)[:, None]
    between = branch._between

    def leading_astray(loops, index, nodes, X):
        guess = between(loops, index, nodes, X)
        guess[8:12] = wrong
        loops.set_actuated(guess, X)
        return guess

    right = branch.track(loops, start, X, CLOSED)
    monkeypatch.setattr(branch, "_between", leading_astray)
    return right.q, branch.track(loops, start, X, CLOSED).q


def test_a_sample_that_closes_on_a_mode_of_another_sign_is_closed_again(monkeypatch):
    mine, other = fb.assembly_modes(four_bar(), [0.8])
    right, found = misled(monkeypatch, four_bar(), mine, other)
    np.testing.assert_allclose(found, right, rtol=0.0, atol=1e-9)


def test_a_sample_that_closes_on_the_other_side_is_closed_again_where_no_determinant_tells(monkeypatch):
    chain = spherical_four_bar((0.5, 1.2, 1.0, 1.1))
    mine, other = fb.assembly_modes(chain, [0.8])
    right, found = misled(monkeypatch, chain, mine, other)
    np.testing.assert_allclose(found, right, rtol=0.0, atol=1e-9)


def test_a_sample_that_takes_a_long_correction_is_closed_again_where_the_sign_is_the_same(monkeypatch):
    """Both loops turned over: the determinant of the whole is the same, and only the way there tells."""
    chain = in_a_row(FIRST, SECOND)
    mine, other = (assembled([FIRST, SECOND], 0.8, [mode, mode]) for mode in (0, 1))
    loops = loops_of(chain)
    assert branch.node_at(loops, mine, mine[:1]).sign == branch.node_at(loops, other, other[:1]).sign
    off = 0.3 * (np.array(chain.joints) == "coupler1")
    right, found = misled(monkeypatch, chain, mine, other + off)
    np.testing.assert_allclose(found, right, rtol=0.0, atol=1e-9)


def test_a_stretch_that_does_not_lead_to_its_next_node_is_a_change_of_mode():
    chain = four_bar()
    loops, X = loops_of(chain), np.linspace(0.8, 0.9, 11)[:, None]
    nodes = [branch.node_at(loops, fb.assembly_modes(chain, X[k])[mode], X[k]) for k, mode in ((0, 0), (10, 1))]
    with pytest.raises(BranchError, match="passes another assembly mode between two samples") as info:
        branch._fill(loops, np.array([0, 10]), nodes, X, CLOSED)
    assert info.value.sample == 10


def jumps(n: int) -> bool:
    """Whether a crank is taken over the few degrees at half a turn where its rocker and coupler do not reach it."""
    chain = four_bar((0.4, 0.8, 0.599, 1.0))
    crank = np.linspace(1.4, 4.7, n)[:, None]
    motion = Motion(np.linspace(0.0, 1.0, n), crank, np.full((n, 1), 3.3), np.zeros((n, 1)))
    start = max(fb.assembly_modes(chain, [1.4]), key=lambda q: q[1])
    try:
        fb.drive(chain, motion, start)
    except SingularityError:
        return False
    return True


@pytest.mark.parametrize("alone", ["sign", "trust", "drop", None])
def test_each_guard_of_a_step_keeps_a_motion_from_a_jump_by_itself(monkeypatch, alone):
    """Sign of the determinant, size of the correction and loss of the singular value cover each other; none is idle."""
    correct, polish = branch._correct, branch.polish

    def signless(loops, q):
        here = correct(loops, q)
        here.sign = np.ones_like(here.sign)
        return here

    def polished(loops, q):
        closed = polish(loops, q)
        return replace(closed, sign=np.ones_like(closed.sign))

    if alone != "sign":
        monkeypatch.setattr(branch, "_correct", signless)
        monkeypatch.setattr(branch, "polish", polished)
    if alone != "trust":
        monkeypatch.setattr(branch, "_TRUST", np.inf)
    if alone != "drop":
        monkeypatch.setattr(branch, "_DROP", 0.0)
    assert [jumps(n) for n in (5, 17)] == [alone is None] * 2


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
