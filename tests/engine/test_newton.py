"""Closing: quadratic, to round-off, and refused where nothing closes, nothing is regular or nothing is a number."""

from __future__ import annotations

import calls
import numpy as np
import pinocchio as pin
import pytest
from equations import Equations
from mechanisms import (
    TILTED,
    add,
    at,
    bennett,
    body,
    five_bar,
    four_bar,
    parallelogram,
    rscr,
    rssr,
    slider_crank,
    spherical_four_bar,
    welded_four_bar,
)
from sampled import Sampled
from test_links import FAR
from tied_chains import EXAMPLES

import fivebar_pin as fb
from fivebar_pin.closures import Coupling
from fivebar_pin.engine import closing
from fivebar_pin.engine import tables as e
from fivebar_pin.engine.sweeping import left_open
from fivebar_pin.mechanism.complement import complement_of
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.mechanism.prepared import prepared_of

SHIPPED = [name for name in fb.io.shipped() if "gram" not in name]


def shipped(name: str) -> tuple[fb.ClosedChain, np.ndarray]:
    chain = fb.load(name)
    return chain, at_home(chain, next(iter(chain.references.values())))


def at_home(chain: fb.ClosedChain, q: np.ndarray) -> np.ndarray:
    """Return a configuration closed to round-off near q."""
    return fb.assemble(chain, loops_of(chain).actuated_of(q[None])[0], near=q)


def small(make, *x_a: float):
    def made() -> tuple[fb.ClosedChain, np.ndarray]:
        chain = make()
        return chain, fb.assemble(chain, x_a)

    return made


MECHANISMS = {
    **{name: (lambda name=name: shipped(name)) for name in SHIPPED},
    "slider-crank, tilted": small(lambda: slider_crank(base=TILTED), 0.7),
    "five-bar by hinges, far away": small(lambda: five_bar(kind="revolute", base=FAR), 2.0, 1.0),
    "welded four-bar": small(welded_four_bar, 0.7),
    "RSSR": small(rssr, 0.3),
    "RSCR": rscr,
    "Bennett": bennett,
    "spherical four-bar": small(lambda: spherical_four_bar((0.5, 1.0, 0.9, 1.2)), 0.7),
    **EXAMPLES,
}
every_mechanism = pytest.mark.parametrize("make", MECHANISMS.values(), ids=MECHANISMS.keys())


def moved_by(chain: fb.ClosedChain, q: np.ndarray, size: float, seed: int = 1) -> np.ndarray:
    """Return q with its passive coordinates moved by about so much [rad, or chain lengths]."""
    loops = loops_of(chain)
    tangent = np.random.default_rng(seed).uniform(-1.0, 1.0, chain.nv) * loops.column_scale * size
    tangent[chain.actuated_index] = 0.0
    return loops.tree.integrate(q[None], tangent[None])[0]


def largest(chain: fb.ClosedChain, q: np.ndarray) -> float:
    """Return the largest closure residual by Pinocchio's frames, scaled."""
    return float(np.abs(Equations(chain, q, np.zeros(chain.nv)).residual).max())


@every_mechanism
def test_what_was_moved_a_little_closes_where_it_was(make):
    chain, q = make()
    s, loops = Sampled(chain), loops_of(chain)
    far = max(1.0, float(np.abs(loops.tree.poses(q[None]).p[1]).max()))  # places are that large, and their last digits
    for size in (1e-12, 1e-6, 1e-3, 2e-2):
        assert s.close(moved_by(chain, q, size))
        assert largest(chain, s.q) <= 1e-14 * far
        difference = loops.tree.difference(q[None], s.q[None])[0] / loops.column_scale
        assert np.abs(difference).max() < 1e-12 * far
        np.testing.assert_array_equal(loops.actuated_of(s.q[None]), loops.actuated_of(q[None]))


@every_mechanism
def test_every_step_squares_what_is_open(make):
    """|c_1| = C |c_0|^2 with one C from 2e-2 down to where squares are round-off."""
    chain, q = make()
    s, found = Sampled(chain), []
    for size in (1e-2, 1e-3, 1e-4, 1e-5):
        s.set(q=moved_by(chain, q, size))
        found.append(calls.step(s.I, s.W))
    before, after = np.array(found).T
    C = after[0] / before[0] ** 2
    assert C < 5.0
    np.testing.assert_allclose(after, C * before**2, rtol=0.15, atol=2e-12)


@every_mechanism
def test_what_it_moved_by_is_the_way_between(make):
    """`MOVED` gathers the steps of Newton."""
    chain, q = make()
    s, loops = Sampled(chain), loops_of(chain)
    start = moved_by(chain, q, 1e-3)
    s.numbers(e.MOVED, chain.nv)[:] = 0.0
    assert s.close(start)
    expected = loops.tree.difference(start[None], s.q[None])[0]
    np.testing.assert_allclose(s.numbers(e.MOVED, chain.nv), expected, rtol=0.0, atol=1e-5)
    assert np.abs(s.numbers(e.MOVED, chain.nv)).max() > 1e-6


@every_mechanism
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_is_refused(make, value):
    """Uncompiled, the cosine of infinity raises."""
    chain, q = make()
    s = Sampled(chain)
    for k in range(chain.nq):
        wrong = np.array(q)
        wrong[k] = value
        assert not s.close(wrong)


def test_closing_keeps_what_is_closed():
    """At round-off nothing moves."""
    chain, q = shipped("five_bar_case_I")
    s = Sampled(chain)
    assert s.close(q)
    closed = s.q
    for _ in range(3):
        assert s.close(closed)
        assert np.abs(s.q - closed).max() <= 4e-16 * np.abs(closed).max()


def test_a_loop_out_of_reach_is_refused():
    chain = four_bar((1.0, 0.5, 0.5, 2.5))
    s = Sampled(chain)
    for crank in np.linspace(0.5, 5.8, 20):
        assert not s.close(np.array([crank, 0.3, -0.4]))


@pytest.mark.parametrize("turn", [0.0, np.pi])
def test_a_flat_mechanism_is_closed_but_not_regular(turn):
    """It either says that it is not closed, or tells an inverse without bound."""
    s = Sampled(parallelogram())
    if s.close(np.array([turn, -turn, turn])):
        assert calls.inverse_norm(s.I, s.W, s.blocks[0]) > 1e7


def test_a_step_longer_than_a_correction_is_refused():
    """Nearly stretched, Newton would throw the links about; it does not move them instead."""
    chain = four_bar((0.4, 1.1, 0.9, 1.0))
    s = Sampled(chain)
    thrown = np.array([0.7, 0.0, 0.7 + 1e-3])  # coupler and rocker nearly parallel
    assert not s.close(thrown)
    np.testing.assert_array_equal(s.q, thrown)
    assert np.abs(s.numbers(e.X, 3)).max() > closing._ASTRAY


def test_the_residual_that_is_told_is_the_largest_and_never_passes_over_what_is_no_number():
    chain, q = shipped("delta")
    s = Sampled(chain)
    s.set(q=moved_by(chain, q, 1e-2))
    for k, r in enumerate(s.rows):
        calls.closures(s.I, s.W)
        expected = np.abs(s.per_row(e.RESIDUAL)).max()
        assert calls.largest(s.I, s.W) == expected
        for value in (np.nan, np.inf, -np.inf):
            s.W[s.of(r, e.RESIDUAL)] = value
            assert calls.largest(s.I, s.W) == np.inf
        s.W[s.of(r, e.RESIDUAL)] = -1e3 - k
        assert calls.largest(s.I, s.W) == 1e3 + k


@every_mechanism
def test_a_motion_that_is_no_number_never_counts_as_closed(make):
    """Whichever row it opens: of two numbers, max() takes the first where the second is none."""
    chain, q = make()
    prepared, q = prepared_of(chain), q[None]
    N = complement_of(Configurations(loops_of(chain), q))
    assert calls.residual(prepared.I, prepared.memory(), q) < 1e-12
    assert left_open(prepared.I, prepared.memory(), q, N, 0) < 1e-9
    for k in range(chain.nq):
        lost = np.array(q)
        lost[0, k] = np.nan
        assert calls.residual(prepared.I, prepared.memory(), lost) == np.inf
        assert left_open(prepared.I, prepared.memory(), lost, N, 0) == np.inf
    for k in range(chain.nv):
        lost = np.array(N)
        lost[0, k, 0] = np.nan
        assert left_open(prepared.I, prepared.memory(), q, lost, 0) == np.inf


def test_a_slide_of_a_large_chain_may_be_corrected_by_metres():
    """Steps count in lengths of the chain: here a rack of some 100 m is 3 m off."""
    model = pin.Model()
    add(model, 0, pin.JointModelRZ(), at(), "pinion", body(1))
    add(model, 0, pin.JointModelPX(), at(100.0, 50.0), "rack", body(2))
    chain = fb.ClosedChain(model, (Coupling({"rack": 1.0, "pinion": 50.0}),), ("pinion",))
    s = Sampled(chain)
    assert chain.length > 50.0
    assert s.close(np.array([0.3, -12.0]))
    np.testing.assert_allclose(s.q, [0.3, -15.0], rtol=1e-15)
    assert not s.close(np.array([0.3, 1e4]))


@every_mechanism
def test_the_gap_that_is_told_is_in_metres_and_radians(make):
    """The largest of all rows, as by NumPy, also where it is more than one; rows of coordinates know no unit."""
    chain, q = make()
    for size in (0.0, 0.05, 2.0):
        moved = moved_by(chain, q, size)
        expected = Configurations(loops_of(chain), moved[None]).gap[0]
        s = Sampled(chain)
        found = calls.residual(s.I, s.W, moved[None])
        if all(s.of(r, e.SORT) == e.RATIOS or s.of(r, e.SORT) == e.LENGTH for r in s.rows):
            np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
        else:  # rows of points are combined, which moves the largest by no more than this
            assert expected / np.sqrt(3.0) - 1e-12 <= found * 1.0000001
            assert found <= np.sqrt(3.0) * expected + 1e-9
