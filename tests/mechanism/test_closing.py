"""One iteration closes loops, whichever coordinates move; its rules lead to the same configurations."""

from __future__ import annotations

import mechanisms
import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin.mechanism import manifold
from fivebar_pin.mechanism.closing import Limits, closed_enough, iterate, polish, residual_of, search
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.mechanism.manifold import ROUND_OFF, manifold_of
from fivebar_pin.mechanism.mobility import close_all

CHAINS = {
    "four-bar": mechanisms.four_bar(),
    "five-bar": mechanisms.five_bar(base=mechanisms.TILTED),
    "slider-crank": mechanisms.slider_crank(),
    "spatial four-bar": mechanisms.rssr(),
    "overconstrained": mechanisms.spherical_four_bar((0.5, 1.1, 0.9, 1.2)),
}


def place(chain: fb.ClosedChain) -> np.ndarray:
    return fb.assembly_modes(chain, np.full(chain.na, 0.8), starts=32)[0]


def test_samples_go_where_the_rule_sends_them_and_stay_when_they_are_done():
    loops = loops_of(CHAINS["four-bar"])
    seen = []

    def rule(here, which):
        seen.append(which.tolist())
        return here.q + 1.0, which > len(seen)  # sample 0, then 1, then 2 is done

    q = iterate(loops, np.zeros((4, 3)), rule, most=3)
    assert seen == [[0, 1, 2, 3], [2, 3], [3]]
    np.testing.assert_array_equal(q[:, 0], [1.0, 1.0, 2.0, 3.0])


def test_an_iteration_leaves_the_array_it_is_given_alone():
    loops, q = loops_of(CHAINS["four-bar"]), np.full((2, 3), 0.4)
    iterate(loops, q, lambda here, which: (here.q + 1.0, which < 0), most=5)
    polish(loops, q)
    search(loops, q)
    np.testing.assert_array_equal(q, 0.4)


@pytest.mark.parametrize("chain", CHAINS.values(), ids=CHAINS.keys())
def test_every_road_ends_at_round_off(chain):
    loops, closed, q = loops_of(chain), manifold_of(chain), place(chain)
    rng = np.random.default_rng(4)
    starts = loops.tree.integrate(np.repeat(q[None], 5, axis=0), 0.02 * rng.normal(size=(5, chain.nv)))
    near = polish(loops, starts)
    assert near.residual.max() < 1e-14
    np.testing.assert_array_equal(loops.actuated_of(near.q), loops.actuated_of(starts))  # the motors stay
    sought = search(loops, starts)
    assert np.abs(residual_of(loops, sought)).max() < 1e-8
    np.testing.assert_allclose(polish(loops, sought).q, near.q, atol=1e-10)
    _, residual = close_all(chain, starts, 1e-12)
    assert residual.max() < 1e-14
    least = [closed.project(start, 1e-12) for start in starts]
    assert max(float(np.abs(point.reduced).max()) for point in least) < 100.0 * ROUND_OFF
    for k, point in enumerate(least):
        away, other = (
            np.linalg.norm(loops.tree.difference(starts[k : k + 1], x[None]) / loops.column_scale)
            for x in (point.q[0], near.q[k])
        )
        assert away <= other * (1.0 + 1e-6)  # steps in all coordinates go less far than those of the passive ones


@pytest.mark.parametrize("chain", CHAINS.values(), ids=CHAINS.keys())
def test_a_chart_leads_to_the_configuration_with_its_coordinates(chain):
    closed, q = manifold_of(chain), place(chain)
    point = closed.project(q, 1e-12)
    rank = closed.rank_of(point)
    chart = closed.chart_at(point, rank)
    xi = np.full(chart.B.shape[1], 0.05)
    reached = closed.solve(chart, xi, point.q[0], rank)
    np.testing.assert_allclose(closed.coordinates(chart, reached.q[0]), xi, atol=1e-14)
    assert reached.gap[0] < 1e-14
    assert closed.solve(chart, xi + 1e6, point.q[0], rank) is None


def test_a_search_keeps_limits():
    chain = CHAINS["four-bar"]
    loops, q = loops_of(chain), place(chain)
    start = q + np.array([0.3, 0.2, -0.2])
    every = np.arange(3)
    limits = Limits(np.array([0]), start[:1] - 0.05, start[:1] + 0.05)
    found = search(loops, start[None], columns=every, limits=limits)
    assert limits.inside(loops, found)[0]
    assert closed_enough(loops, np.abs(residual_of(loops, found)).max(axis=1), 1e-8)[0]
    free = search(loops, start[None], columns=every)
    assert not limits.inside(loops, free)[0]  # the limits did hold something


def test_a_sample_that_is_closed_does_not_end_the_work_on_the_others():
    chain = CHAINS["four-bar"]
    loops, q = loops_of(chain), place(chain)
    far = q + np.array([0.0, 0.15, -0.15])
    for starts in (np.stack([q, far]), np.stack([far, q])):
        closed = polish(loops, starts)
        assert closed.residual.max() < 1e-15
        np.testing.assert_allclose(closed.q[0], closed.q[1], atol=1e-14)


def test_what_is_closed_stays_where_it_is():
    chain = CHAINS["spatial four-bar"]
    loops, q = loops_of(chain), place(chain)
    nearly = loops.tree.integrate(q[None], np.full((1, chain.nv), 2e-14))  # closed, though not to the last digit
    starts = np.concatenate([nearly, loops.tree.integrate(q[None], np.full((1, chain.nv), 0.05))])
    found, _ = close_all(chain, starts, 1e-12)
    np.testing.assert_array_equal(found[0], nearly[0])
    assert np.abs(found[1] - starts[1]).max() > 1e-3


def test_steps_of_least_length_end_where_they_no_longer_help():
    chain = mechanisms.four_bar(base=mechanisms.at(31.7, -23.1, 11.3, (0.7, -0.4, 1.1)))
    loops, q = loops_of(chain), place(chain)
    rng, left = np.random.default_rng(6), []
    for _ in range(20):
        rule, looks = manifold._LeastSteps(), []

        def counted(here, which, rule=rule, looks=looks):
            looks.append(float(np.abs(here.reduced).max()))
            return rule(here, which)

        iterate(loops, q[None] + 0.02 * rng.normal(size=(1, 3)), counted, most=50)
        assert len(looks) < 10
        assert float(np.abs(rule.reached.reduced).max()) == min(looks)  # the best one met is kept
        left.append(min(looks))
    assert max(left) > ROUND_OFF  # else the rule was not needed


def test_round_off_far_from_the_origin_ends_an_iteration_too():
    """30 m away a gap of 1e-14 m is all that can be asked: less than one metre away leaves 2e-15."""
    chain = mechanisms.four_bar(base=mechanisms.at(31.7, -23.1, 11.3, (0.7, -0.4, 1.1)))
    closed = manifold_of(chain)
    rng, q = np.random.default_rng(6), place(chain)
    ends = []
    for _ in range(20):
        point = closed.project(q + 0.02 * rng.normal(size=3), 1e-12)
        rank = closed.rank_of(point)
        chart = closed.chart_at(point, rank)
        reached = closed.solve(chart, np.full(chart.B.shape[1], 0.03), point.q[0], rank)
        assert reached is not None
        ends.append(float(np.abs(reached.reduced).max()))
    assert max(ends) > ROUND_OFF  # else the rule was not needed
    assert max(ends) < 1e-13


def test_a_sample_that_is_thrown_far_away_is_left_there():
    """An open start where the passive columns are all but singular: its first step leads off, and none follows."""
    loops, low, high = loops_of(mechanisms.parallelogram()), -1.0, 1.0

    def start(rocker: float) -> Configurations:
        return Configurations(loops, np.array([[0.3, 0.9, rocker]]))

    assert start(low).passive.sign != start(high).passive.sign
    while high - low > 1e-6:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if start(middle).passive.sign == start(low).passive.sign else (low, middle)
    step = start(low).passive.solve(start(low).residual)[0]
    assert np.abs(step).max() > 1e4
    found = polish(loops, start(low).q)
    assert found.correction[0] == pytest.approx(np.abs(step).max(), rel=1e-12)
    assert found.residual[0] > 1e-3
