"""Guards of the integrator, each where no other one speaks."""

from __future__ import annotations

from dataclasses import replace

import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin.dynamics.equations import EquationsOfMotion
from fivebar_pin.errors import SingularityError, SolverError
from fivebar_pin.simulation import integrator, output, singular_step
from fivebar_pin.simulation.chart_motion import (
    ChartMotion,
    ClosedState,
    Inputs,
    Node,
    first_node,
    is_smooth,
    next_node,
)
from fivebar_pin.springs import JointSpring

FLAT = 0.3
"""When the double four-bar below lies flat [s]."""


def rod(joint: object, friction: float = 0.0) -> fb.ClosedChain:
    """Return a rod of 1 kg and 1 m on a joint, without gravity: an open chain."""
    model = pin.Model()
    inertia = pin.Inertia(1.0, np.array([0.5, 0.0, 0.0]), np.diag([0.0, 1.0, 1.0]) / 12.0)
    mechanisms.add(model, 0, joint, mechanisms.at(), "hinge", inertia)
    model.gravity.linear = np.zeros(3)
    model.upperDryFrictionLimit = np.array([friction])
    model.lowerDryFrictionLimit = np.array([-friction])
    return fb.ClosedChain(model, (), ("hinge",))


def on_its_way_flat() -> tuple[fb.ClosedChain, np.ndarray, np.ndarray]:
    """Return the double four-bar without gravity, turning at a constant 1 rad/s to where it loses rank."""
    chain = mechanisms.double_four_bar().with_gravity(np.zeros(3))
    sense = np.array([1.0 if j.startswith("upright") else -1.0 for j in chain.joints])
    return chain, FLAT * sense, -sense


def motion_from(chain: fb.ClosedChain, q: np.ndarray, v: np.ndarray) -> ChartMotion:
    """Return the motion without torque in the chart around a state at t = 0."""
    system, inputs = EquationsOfMotion.of(chain), Inputs(np.zeros(chain.na), {})
    point = system.manifold.at(q[None])
    rank = system.manifold.rank_of(point)
    node = first_node(system, inputs, ClosedState(point, v, rank), 0.0)
    return ChartMotion(system, inputs, rank, system.manifold.chart_at(point, rank), node)


def reached_at(motion: ChartMotion, t: float) -> Node | None:
    """Return the node of the turning double four-bar at a time."""
    xi, u = np.split(motion.start(), 2)
    return next_node(motion, t, np.concatenate([xi + t * u, u]))


def test_a_chart_is_left_before_the_angle_that_it_counts_wraps():
    """The tangent of a single hinge never turns: only the distance tells that the chart is worn."""
    t = np.array([0.0, 1.0, 2.0])
    motion = fb.simulate(rod(pin.JointModelRUBZ()), [1.0, 0.0], [10.0], None, t)
    np.testing.assert_allclose(motion.q, np.stack([np.cos(10.0 * t), np.sin(10.0 * t)], axis=1), rtol=0.0, atol=1e-12)


def test_a_step_that_lands_on_another_branch_is_taken_again(monkeypatch):
    """The corrector is led to the other assembly mode once: the motion comes out as without that."""
    chain = mechanisms.four_bar()
    mine, other = fb.assembly_modes(chain, [0.8])
    v, t = fb.complement(chain, mine)[:, 0], np.array([0.0, 0.5])
    right, tries = fb.simulate(chain, mine, v, None, t), []

    def astray(motion: ChartMotion, t: float, y: np.ndarray) -> Node | None:
        tries.append(t)
        node = next_node(motion, t, y)
        manifold = motion.system.manifold
        return (
            node
            if len(tries) != 5
            else replace(node, point=manifold.at(other[None]), v=fb.complement(chain, other)[:, 0])
        )

    monkeypatch.setattr(integrator, "next_node", astray)
    found = fb.simulate(chain, mine, v, None, t)
    assert tries[5] < tries[4], "the step was not taken again"
    np.testing.assert_allclose(found.q, right.q, rtol=0.0, atol=1e-9)


def test_a_way_is_smooth_when_it_agrees_with_the_rates_at_both_ends():
    chain, q, v = on_its_way_flat()
    motion = motion_from(chain, q, v)
    reached = reached_at(motion, 0.1)
    assert is_smooth(motion.system, motion.node, reached)
    for share, smooth in ((0.01, True), (0.03, False)):
        faster = replace(reached, v=reached.v * (1.0 + 2.0 * share))
        assert is_smooth(motion.system, motion.node, faster) is smooth


@pytest.mark.parametrize(("before", "ends"), [(1e-3, True), (1e-6, False), (-1e-6, False), (-1e-3, True)])
def test_no_step_ends_where_round_off_would_show_in_the_velocity(before, ends):
    motion = motion_from(*on_its_way_flat())
    assert (reached_at(motion, FLAT - before) is not None) is ends


@pytest.mark.parametrize(("off", "there"), [(0.0, False), (1e-9, False), (1e-3, True)])
def test_there_is_no_rate_where_the_closures_lose_rank(off, there):
    """The tangent space is any of several there; a step of which a stage falls on it must be taken otherwise."""
    motion = motion_from(*on_its_way_flat())
    xi, u = np.split(motion.start(), 2)
    rate = motion.rate(FLAT + off, np.concatenate([xi + (FLAT + off) * u, u]))
    assert np.isfinite(rate).all() == there
    assert np.isnan(rate).all() != there


def test_no_state_is_asked_for_beyond_the_end_when_a_singular_instant_lies_just_before():
    """A step over the instant would be as long after it as before; what acts may not be defined there."""
    chain, q, v = on_its_way_flat()
    end, asked = FLAT + 1e-2, []

    def tau(t: float, q: np.ndarray, v: np.ndarray) -> list[float]:
        asked.append(t)
        return [0.0]

    motion = fb.simulate(chain, q, v, tau, [0.0, end])
    assert max(asked) <= end
    np.testing.assert_allclose(motion.q[-1], q + end * v, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("within", [0.1, 0.29, 0.31, 0.7])
def test_a_singular_instant_is_seen_when_it_lies_within_what_is_looked_at(within):
    """While the singular value only falls up to the edge of what is looked at, there is no telling where it ends."""
    ahead = singular_step.singular_ahead(motion_from(*on_its_way_flat()), within)
    assert ahead is None if within < FLAT else ahead == pytest.approx(FLAT, abs=1e-6)


def test_a_collocated_step_is_not_believed_when_two_orders_disagree():
    """Both have converged: only their difference tells that the step is too long for the tolerance."""
    chain = rod(pin.JointModelRZ()).with_springs([JointSpring("hinge", 3.0, 0.0)])
    motion, fine = motion_from(chain, np.array([1.0]), np.array([0.0])), np.full(2, 1e-11)
    for h, believed in ((0.2, True), (0.55, False)):
        rates = np.repeat(motion.rate(0.0, motion.start())[None], singular_step._EIGHT.c.size, axis=0)
        assert singular_step._substitute(motion, singular_step._EIGHT, rates, h, 1e-11, fine) is not None
        assert (singular_step.step_over(motion, h, 1e-11, fine) is not None) is believed


def test_a_step_that_is_hardly_determined_anywhere_is_an_error(monkeypatch):
    """Of the twenty states that an interpolation goes through, ten at least must be clear of the singular instant."""
    motion = motion_from(*on_its_way_flat())
    xi, u = np.split(motion.start(), 2)
    reached = reached_at(motion, 0.1)

    def across(clear: int) -> output._Across:
        values = iter([1.0] * clear + [0.0] * (output._THROUGH - clear))
        monkeypatch.setattr(output, "sigma_of", lambda point, rank: next(values))
        return output._Across(motion, lambda t: np.concatenate([xi + t * u, u]), motion.node, reached)

    assert across(10).times.size == 10
    with pytest.raises((SingularityError, SolverError), match="not determined over a whole step"):
        across(9)


def test_a_push_that_is_shorter_than_a_step_is_not_slept_through():
    """A joint at rest is looked at eight times a step: 4 ms of 3 s above its friction break it loose."""

    def push(t: float, q: np.ndarray, v: np.ndarray) -> list[float]:
        return [2.0 * np.exp(-(((t - 1.508) / 0.0018) ** 2))]

    motion = fb.simulate(rod(pin.JointModelRZ(), friction=0.5), [0.0], [0.0], push, [0.0, 1.0, 3.0])
    assert abs(motion.q[1, 0]) < 1e-12
    assert motion.q[2, 0] > 1e-5


def test_a_hopeless_simulation_is_given_up_long_before_its_steps_are_used():
    """A spring of 1e12 N m/rad and a time span of minutes: a hundred steps tell that they lead nowhere."""
    stiff = rod(pin.JointModelRZ()).with_springs([JointSpring("hinge", 1e12, 0.0)])
    with pytest.raises(SolverError, match=r"took 100 steps \(of 3000\)"):
        fb.simulate(stiff, [0.1], [0.0], None, [0.0, 1e3], max_steps=3000)
