"""Following a branch: what is certified is true, no sampling leaves it, and what is blocked is told."""

from __future__ import annotations

import calls
import certificates
import numpy as np
import pytest
from certificates import FAMILIES, Found, judge, prepared
from mechanisms import bennett, five_bar, four_bar, parallelogram, rssr, slider_crank
from sampled import Driven, Sampled
from test_newton import every_mechanism

import fivebar_pin as fb
from fivebar_pin.engine import tables as e
from fivebar_pin.engine.tables import BLOCKED, FOLLOWED, TOGETHER
from fivebar_pin.mechanism.complement import complement_of, rates_of
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import loops_of

ROUND_OFF = 1e-11
"""Difference of two roads to one regular configuration [rad, or chain lengths]."""


def lines(*corners, parts=1) -> np.ndarray:
    """Return points on the straight lines between corners (k, na)."""
    corners = np.array(corners, dtype=float).reshape(len(corners), -1)
    at = np.arange((len(corners) - 1) * parts + 1) / parts
    return np.column_stack([np.interp(at, np.arange(len(corners)), c) for c in corners.T])


def away(chain: fb.ClosedChain, q: np.ndarray, other: np.ndarray) -> float:
    loops = loops_of(chain)
    d = loops.tree.difference(np.atleast_2d(q), np.atleast_2d(other)) / loops.column_scale
    return float(np.abs(d).max())


def swing(chain: fb.ClosedChain, q: np.ndarray, n: int, size: float = 0.1) -> tuple[np.ndarray, ...]:
    """Return a small motion of all motors that starts at q: x, v, a (n, na)."""
    loops = loops_of(chain)
    scale, phase = size * loops.column_scale[chain.actuated_index], np.arange(chain.na)
    t = np.linspace(0.0, 2.0, n)[:, None]
    x = loops.actuated_of(q[None]) + scale * (np.sin(t + phase) - np.sin(phase))
    return x, scale * np.cos(t + phase), -scale * np.sin(t + phase)


@every_mechanism
def test_motion_of_all_coordinates_is_that_of_the_numpy_road(make):
    """Closed, on the motors' coordinates, with the complement, rates and accelerations that NumPy finds there."""
    chain, q = make()
    loops, (x, v, a) = loops_of(chain), swing(chain, q, 40)
    d = Driven(chain, x, q, v=v, a=a)
    assert (d.status, d.done) == (FOLLOWED, 40)
    here = Configurations(loops, d.q)
    assert here.gap.max() < 1e-12 * max(1.0, float(np.abs(here.poses.p[1]).max()))
    np.testing.assert_allclose(d.gap, here.gap, rtol=0.0, atol=1e-12 * max(1.0, float(np.abs(here.poses.p[1]).max())))
    exact = chain.nq == chain.nv  # a cosine and a sine are not
    np.testing.assert_allclose(loops.actuated_of(d.q), x, rtol=0.0, atol=0.0 if exact else 1e-14)
    scale = np.linalg.norm(1.0 / here.passive.sigma)
    np.testing.assert_allclose(d.N, complement_of(here), rtol=0.0, atol=1e-11 * scale)
    v_all, a_all, _ = rates_of(here, v, a)
    np.testing.assert_allclose(d.v, v_all, rtol=0.0, atol=1e-11 * scale)
    np.testing.assert_allclose(d.a, a_all, rtol=0.0, atol=1e-10 * scale)


@every_mechanism
def test_any_sampling_leads_to_the_same_place(make):
    """One sample at the end, few, uneven ones, repeated ones, and there and back."""
    chain, q = make()
    x, _, _ = swing(chain, q, 400, 0.3)
    x = x[:300]
    fine = Driven(chain, x, q)
    assert fine.status == FOLLOWED
    rng = np.random.default_rng(0)
    uneven = np.unique(np.r_[0, np.cumsum(rng.geometric(0.05, 60)) % 299, 299])
    ways = [np.arange(0, 300, 23), uneven, np.repeat(uneven, 3), np.r_[np.arange(0, 300, 40), np.arange(299, -1, -37)]]
    for which in ways:
        coarse = Driven(chain, x[which], q)
        assert coarse.status == FOLLOWED
        assert away(chain, coarse.q, fine.q[which]) < ROUND_OFF


def test_one_sample_and_repeated_ones_stay_where_they_are():
    chain = five_bar()
    q = fb.assemble(chain, [2.0, 1.0])
    for n in (1, 2, 5):
        d = Driven(chain, np.tile([2.0, 1.0], (n, 1)), q)
        assert (d.status, d.done) == (FOLLOWED, n)
        np.testing.assert_array_equal(d.q, np.tile(d.q[0], (n, 1)))
        np.testing.assert_array_equal(d.v, np.zeros((n, 4)))


@pytest.mark.parametrize("turns", [1, -1, 3])
def test_two_samples_many_turns_apart_are_joined_turn_by_turn(turns):
    """A crank-rocker comes back to where it was, with the turns of its crank counted and no other."""
    chain = four_bar()
    q = fb.assemble(chain, [0.7])
    d = Driven(chain, [[0.7], [0.7 + 2.0 * np.pi * turns]], q)
    assert (d.status, d.done) == (FOLLOWED, 2)
    np.testing.assert_allclose(d.q[1] - d.q[0], 2.0 * np.pi * turns * np.array([1.0, -1.0, 0.0]), rtol=0.0, atol=1e-12)


def test_corners_and_reversals_do_not_lead_astray():
    """Squares in the plane of both motors, walked both ways and with a stop in each corner."""
    chain = five_bar()
    q = fb.assemble(chain, [2.0, 1.0])
    square = [[2.0, 1.0], [2.6, 1.0], [2.6, 1.7], [2.0, 1.7], [2.0, 1.0]]
    for corners in (square, square[::-1], [c for c in square for _ in range(2)]):
        coarse, fine = Driven(chain, lines(*corners), q), Driven(chain, lines(*corners, parts=57), q)
        assert coarse.status == fine.status == FOLLOWED
        assert away(chain, coarse.q, fine.q[::57]) < ROUND_OFF
        assert away(chain, coarse.q[0], coarse.q[-1]) < ROUND_OFF


def side(q: np.ndarray) -> np.ndarray:
    """Return which of its two modes a four-bar is on: the sense of coupler and rocker (n,)."""
    return np.sign(np.sin(q[:, 0] + q[:, 1] - q[:, 2]))


@pytest.mark.parametrize("near", [1e-1, 1e-2, 1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("n", [2, 7, 60])
def test_a_mode_is_kept_past_a_nearly_singular_place(near, n):
    """A nearly even parallelogram lies nearly flat at half a turn; the longer ground lets its crank pass."""
    for lengths in ((0.5, 1.0, 0.5 + near, 1.0), (0.5, 1.0 + near, 0.5 + 2.0 * near, 1.0)):
        chain = four_bar(lengths)
        for q in fb.assembly_modes(chain, [0.4]):
            d = Driven(chain, np.linspace(0.4, 0.4 + 2.0 * np.pi, n)[:, None], q)
            assert d.status == FOLLOWED
            assert np.all(side(d.q) == side(q[None]))
            assert abs(np.sin(0.5 * (d.q[-1, 2] - q[2]))) < 1e-9


@pytest.mark.parametrize("n", [2, 3, 10, 41])
def test_a_way_through_a_singularity_is_blocked_there(n):
    """A parallelogram lies flat at crank 0, whichever side it comes from."""
    chain = parallelogram()
    for start, end in ((0.6, -0.5), (-0.6, 0.5)):
        for q in fb.assembly_modes(chain, [start]):
            x = np.linspace(start, end, n)[:, None]
            d = Driven(chain, x, q)
            assert d.status == BLOCKED and 0 < d.done < n
            assert np.all(x[: d.done] * start > 0.0)
            assert d.here[0] * start >= 0.0
            assert np.isfinite(d.q[: d.done]).all() and np.isnan(d.q[d.done :]).all()
            there = Driven(chain, d.here[:1], d.here)  # what is kept is all of the last point
            I = Sampled(chain).I
            for field in (e.NORMS, e.SIGNS, e.J_HERE):
                np.testing.assert_allclose(d.W[I[field]], there.W[I[field]], rtol=1e-3)


def test_a_way_out_of_reach_is_blocked_at_its_end_and_the_last_point_is_kept():
    chain = four_bar((1.0, 0.6, 0.7, 1.5))  # reaches to where coupler and rocker are straight
    q = fb.assemble(chain, [0.2])
    reach = np.arccos((1.0 + 1.5**2 - 1.3**2) / (2.0 * 1.5))
    d = Driven(chain, np.linspace(0.2, 2.0, 30)[:, None], q)
    assert d.status == BLOCKED
    assert 0.0 < reach - d.here[0] < 1e-6
    assert fb.closure_residual(chain, d.here).size and np.abs(fb.closure_residual(chain, d.here)).max() < 1e-12
    assert Driven(chain, np.linspace(0.2, reach - 1e-6, 3)[:, None], q).status == FOLLOWED


def test_a_start_that_is_singular_or_open_is_blocked_at_once():
    chain = parallelogram()
    assert (Driven(chain, [[0.0]], np.zeros(3)).status, Driven(chain, [[0.0]], np.zeros(3)).done) == (BLOCKED, 0)
    out = four_bar((1.0, 0.5, 0.5, 2.5))
    assert Driven(out, [[1.0]], [1.0, 0.3, -0.4]).status == BLOCKED


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_motors_that_go_to_what_is_no_number_are_blocked(value):
    chain = five_bar()
    q = fb.assemble(chain, [2.0, 1.0])
    for k in (1, 2):
        x = np.tile([2.0, 1.0], (4, 1))
        x[1, 0], x[k, 1] = 2.1, value
        d = Driven(chain, x, q)
        assert (d.status, d.done) == (BLOCKED, k)


@pytest.mark.parametrize(
    "make",
    [
        lambda: (four_bar(), ("crank", "rocker"), fb.assemble(four_bar(), [0.7])),
        lambda: (bennett()[0], ("first", "third"), bennett()[1]),
    ],
)
def test_motors_that_closures_tie_to_each_other_are_told(make):
    chain, actuated, q = make()
    tied = fb.ClosedChain(chain.model, chain.closures, actuated)
    d = Driven(tied, loops_of(tied).actuated_of(q[None]), q)
    assert (d.status, d.done) == (TOGETHER, 0)


@pytest.mark.parametrize("make", [five_bar, lambda: fb.load("delta"), lambda: rssr(ball=False), slider_crank])
def test_nothing_is_left_of_another_drive(make):
    """Memory after drives that were blocked or no numbers, and with anything in it: the same to the last digit."""
    chain = make()
    home = chain.references.get("home")
    q = fb.assemble(chain, loops_of(chain).actuated_of(home[None])[0], home) if home is not None else None
    q = fb.assemble(chain, [2.0, 1.0][: chain.na] if chain.na == 2 else [0.4]) if q is None else q
    x, v, a = swing(chain, q, 50, 0.2)
    clean = Driven(chain, x, q, v=v, a=a)
    assert clean.status == FOLLOWED
    rng, I = np.random.default_rng(1), Sampled(chain).I
    dirty = [Driven(chain, x[::-1], clean.q[-1]).W, Driven(chain, np.vstack([x, x[-1:] + 50.0]), q).W]
    dirty.append(Driven(chain, np.vstack([x, x[-1:] * np.nan]), q, v=np.vstack([v, v[-1:] * np.inf])).W)
    for fill in (lambda k: rng.normal(size=k), lambda k: np.full(k, np.nan)):
        W = np.array(clean.W)
        for first, count in ((e.Q_HERE, chain.nq), (e.V_HERE, chain.nv), (e.X, chain.nv), (e.MOVED, chain.nv)):
            W[I[first] : I[first] + count] = fill(count)
        for g in Sampled(chain).blocks:
            W[I[g + e.WEAK] : I[g + e.WEAK] + I[g + e.WIDTH]] = fill(int(I[g + e.WIDTH]))
        dirty.append(W)
    for W in dirty:
        again = Driven(chain, x, q, v=v, a=a, W=W)
        for name in ("q", "v", "a", "N", "gap"):
            np.testing.assert_array_equal(getattr(again, name), getattr(clean, name))


def test_the_last_steps_are_kept_for_the_next_prediction():
    chain = five_bar()
    d = Driven(chain, [[2.0, 1.0], [2.03, 1.04], [2.036, 1.048], [2.036, 1.06]], fb.assemble(chain, [2.0, 1.0]))
    I = Sampled(chain).I
    np.testing.assert_allclose(d.W[I[[e.LAST_STEP, e.SECOND_STEP]]], [0.012, 0.01], rtol=1e-12)


def test_predictions_are_integrals_of_parabolas():
    """h (w_0 N(0) + w_1 N(-h_1) + w_2 N(-h_1 - h_2)) is the integral of N from 0 to h, as far as steps are even."""
    rng = np.random.default_rng(0)
    for _ in range(200):
        h, h1, h2 = rng.uniform(1.0, 3.0, 3)
        for degree, steps in (
            (2, (h, h1, h2)),
            (1, (h, h1, 0.0)),
            (1, (h, h1, 0.1)),
            (0, (h, 0.2, h2)),
            (0, (h, 0.0, 0.0)),
        ):
            w = calls.weights(*steps)
            c = np.polynomial.Polynomial(rng.normal(size=degree + 1))
            found = steps[0] * np.dot(w, c(np.array([0.0, -steps[1], -steps[1] - steps[2]])))
            np.testing.assert_allclose(found, c.integ()(steps[0]), rtol=1e-12, atol=1e-12)
            assert np.count_nonzero(w) == degree + 1


@pytest.mark.parametrize("family", FAMILIES)
def test_what_is_certified_is_where_a_fine_subdivision_arrives(family):
    found = judge(family, 400, 11)
    assert found.wrong == []
    assert found.counts["certified"] > (20 if family == "platform" else 100)


def steps_by(family: str, count: int):
    """Yield a mechanism, its point before a step, and the step, whether certified or not."""
    k = made = 0
    while made < count:
        rng = np.random.default_rng([5, k])
        k += 1
        usable = prepared(family, rng)
        if usable is None:
            continue
        s, q = usable
        for _ in range(4):
            if certificates.step(s, q, rng, Found()) and away(s.chain, s.q, q) > 0.0:
                made += 1
                yield s, q


def scaled_rows(s: Sampled, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return residual and Jacobian of all rows, scaled (rows,), (rows, nv)."""
    other = Sampled(s.chain).set(q, np.zeros(s.chain.nv), np.zeros(s.chain.nv))
    calls.closures(other.I, other.W)
    return other.per_row(e.RESIDUAL), other.J * loops_of(s.chain).column_scale


def reaches(s: Sampled, rows: list[int], delta: np.ndarray) -> np.ndarray:
    """Return the travel D and the arm Λ of the closures of rows, by the last point (rows, 2)."""
    out = []
    for r in rows:
        closure = s.of(r, e.CLOSURE)
        if r != s.of(closure, e.ROW0) or s.of(r, e.SORT) == e.RATIOS:
            out.append((0.0, 0.0))
            continue
        point = s.W[s.of(r, e.WRENCH) + e.POINT :][:3]
        entries_ = range(s.of(r, e.ENTRIES), s.of(r, e.ENTRIES_END), e.ENTRY_SIZE)
        D = sum(abs(delta[s.of(k, e.COLUMN)]) for k in entries_)
        longest = max(np.linalg.norm(point - s.W[s.of(k, e.ENTRY_CENTRE) :][:3]) for k in entries_)
        direction = s.of(r, e.DIRECTION)
        arm = max(1.0, longest * s.W[direction + e.UNIT])
        if s.of(r, e.SORT) == e.LENGTH:
            arm *= (1.0 + longest / s.W[direction + e.OFFSET]) ** 2
        out.append((D, arm))
    return np.array(out)


@pytest.mark.parametrize("family", FAMILIES)
def test_the_certificate_is_the_one_of_its_equations_and_bounds_what_it_says(family):
    """Term by term, and by residual and Jacobian at points of the chord."""
    checked = 0
    for s, q in steps_by(family, 25):
        loops, delta = loops_of(s.chain), s.numbers(e.MOVED, s.chain.nv) / loops_of(s.chain).column_scale
        (_, J0), (_, J1) = scaled_rows(s, q), scaled_rows(s, s.q)
        straight = s.chain.nq == s.chain.nv
        chord = loops.tree.integrate(np.tile(q, (3, 1)), np.outer([0.25, 0.5, 0.75], s.numbers(e.MOVED, s.chain.nv)))
        between = [scaled_rows(s, x) for x in chord] if straight else []
        numbers = {r: k for k, r in enumerate(s.rows)}
        for g in s.blocks:
            rows, columns = s.listed(g, e.ROW_LIST, e.RAW).tolist(), s.listed(g, e.COLUMN_LIST, e.WIDTH)
            which, n = [numbers[r] for r in rows], len(columns)
            D, arm = reaches(s, rows, delta).T
            change, bend = np.linalg.norm((J1 - J0)[np.ix_(which, columns)]), np.linalg.norm((J1 - J0)[which] @ delta)
            J_rate, c_rate = np.sqrt(n) * np.linalg.norm(arm * D**2), np.linalg.norm(arm * D**3)
            for beta in (0.1, 1.0, 3.0):
                left = 1.0 - beta * (change / 2.0 + J_rate / 8.0)
                beta_s = beta / left
                eta = beta_s * (bend + c_rate) / 8.0
                expected = beta_s * n * np.linalg.norm(arm) * eta if left > 0.0 else np.inf
                np.testing.assert_allclose(calls.contraction(s.I, s.W, g, beta), expected, rtol=1e-9, atol=1e-20)
            for at, (c, J) in zip((0.25, 0.5, 0.75), between, strict=bool(between)):
                assert np.linalg.norm(c[which]) <= (bend + c_rate) / 8.0 + 1e-12
                line = ((1.0 - at) * J0 + at * J1 - J)[np.ix_(which, columns)]
                assert np.linalg.norm(line) <= J_rate / 8.0 + 1e-12
            checked += 1
    assert checked >= 25


@pytest.mark.parametrize("family", FAMILIES)
def test_a_certificate_needs_every_block_contracting_from_either_end_and_no_sign_turned(family):
    """Each of its conditions broken by itself, and what is certified held against all of them."""
    accepted = refused = 0
    for s, _ in steps_by(family, 80 if family == "platform" else 24):
        blocks, nb = s.blocks, len(s.blocks)
        for _ in range(20):  # until the norms of large blocks stay
            calls.certify(s.I, s.W)
        certified, signs, before = calls.certify(s.I, s.W), s.numbers(e.SIGNS_BEFORE, nb), s.numbers(e.NORMS_BEFORE, nb)
        same, norms = np.array_equal(s.numbers(e.SIGNS, nb), signs), np.array(s.numbers(e.NORMS, nb))

        def worst(betas):
            return max(calls.contraction(s.I, s.W, g, b) for g, b in zip(blocks, betas, strict=True))  # noqa: B023

        for old in (np.array(before), 0.0 * norms, *np.outer([3.0, 30.0, 1e3], norms)):
            bound = worst(np.maximum(norms, old))
            if abs(bound - 0.5) > 0.05:  # norms of large blocks are told to some per cent
                before[:] = old
                assert calls.certify(s.I, s.W) == (same and bound <= 0.5)
                accepted, refused = accepted + (bound <= 0.5), refused + (bound > 0.5)
        if certified and worst(norms) < 0.45 and worst(np.full(nb, 1e6)) > 0.5:
            for k in range(nb):
                before[:] = 0.0
                signs[k] *= -1.0
                assert not calls.certify(s.I, s.W)
                signs[k] *= -1.0
            assert calls.certify(s.I, s.W)
            before[:] = 1e6
            assert not calls.certify(s.I, s.W)
    assert accepted and refused > 20
