"""What the benchmarks compare with is right: closed forms, loops by hand, and the five-bar in another engine."""

from __future__ import annotations

import numpy as np
import pytest

import fivebar_pin as fb
from benchmarks import foreign, ladder, mechanisms, robot
from benchmarks.handwritten import HandLoop
from benchmarks.positions import closed_form
from fivebar_pin import Motion, paper

SAMPLES = 25


def case(name: str, samples: int = SAMPLES):
    """Return a mechanism, its motion at some samples, its first configuration and its positions in closed form."""
    if name == "robot":
        chain = robot.robot()
        return chain, robot.swing(chain, np.random.default_rng(0), samples), chain.references["home"], robot.position
    if name in ("own cranks", "one crank"):
        chain, motion, q0, position = getattr(ladder, name.replace(" ", "_"))(3)
    else:
        chain = fb.load(fb.io.shipped_path(name))
        motion, q0 = mechanisms._swing(chain)
        position = closed_form(chain, q0)
    few = np.linspace(0, len(motion) - 1, samples).astype(int)
    return chain, Motion(*(getattr(motion, x)[few] for x in "tqva")), q0, position


@pytest.mark.parametrize("name", [*fb.io.shipped(), "own cranks", "one crank", "robot"])
def test_loops_by_hand_and_their_closed_forms_agree_with_the_library(name):
    chain, motion, q0, position = case(name)
    trajectory = fb.drive(chain, motion, near=q0, limits="ignore")
    loads = fb.inverse_dynamics(chain, trajectory)
    if position is not None:
        q = np.array([position(x) for x in motion.q.tolist()])
        np.testing.assert_allclose(np.exp(1j * q), np.exp(1j * trajectory.q), rtol=0.0, atol=1e-12)
    hand = HandLoop(chain, q0, position)
    torque, force, moment, reactions = hand.run(motion, joint_forces=True)
    for ours, theirs in ((loads.torque, torque), (loads.shaking_force, force), (loads.shaking_moment, moment)):
        np.testing.assert_allclose(theirs, ours, rtol=0.0, atol=1e-10 * max(1.0, np.abs(ours).max()))
    assert np.isfinite(reactions).all()
    k = SAMPLES // 2
    a = hand.accelerations(trajectory.q[k], trajectory.v[k], loads.torque[k])
    np.testing.assert_allclose(a, trajectory.a[k], rtol=0.0, atol=1e-9 * np.abs(trajectory.a[k]).max())


def test_only_the_3rrr_has_no_closed_form():
    assert [name for name in fb.io.shipped() if case(name)[-1] is None] == ["planar_3rrr"]


@pytest.mark.parametrize("make", [foreign._mujoco_inverse, foreign._mujoco_rne, foreign._mujoco_motors])
def test_mujoco_gives_the_torques_of_the_paper(make):
    task = foreign._task(paper.table_1("I", "unbalanced"), SAMPLES)
    assert foreign._difference(make(task), task, 0) < 1e-12


def test_the_robot_has_forty_joints_and_eight_loops_and_keeps_clear_of_singularities():
    chain = robot.robot()
    assert (chain.nv, chain.na, len(chain.closures)) == (40, 24, 8)
    diagnosis = fb.diagnose(chain)
    assert diagnosis.mobility == chain.na


def test_cranks_in_a_row_swing_alike_however_many_there_are():
    chain, _, q, _ = ladder.one_crank(64)
    outputs = [q[chain.columns(f"rocker_{k}")[0]][0] for k in range(64)]
    np.testing.assert_allclose(np.exp(1j * np.array(outputs[1::2])), -np.exp(1j * q[0]), rtol=0.0, atol=1e-11)
    assert np.ptp(np.exp(1j * np.array(outputs[::2]))) < 1e-11
