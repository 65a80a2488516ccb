"""One decomposition decides on rank: it solves what it says, and every bound is where it is written down."""

from __future__ import annotations

import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin._arrays import inverse
from fivebar_pin.errors import SingularityError
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.mechanism.rank import (
    LEFT_OUT,
    RANK_TOLERANCE,
    Decomposed,
    factored,
    pseudo_inverse,
    ranks_of,
    singular_values,
    truncated_inverse,
)
from tests.mechanism.test_plane import two_four_bars


def matrices(m: int, nv: int, rank: int, n: int = 5) -> np.ndarray:
    """Return random matrices (n, m, nv) of a rank, their singular values of size one."""
    rng = np.random.default_rng(m + 10 * nv + 100 * rank)
    return rng.normal(size=(n, m, rank)) @ rng.normal(size=(n, rank, nv))


SHAPES = [(3, 5, 3), (3, 5, 2), (5, 3, 3), (5, 3, 2), (4, 4, 4), (4, 4, 0)]


@pytest.mark.parametrize(("m", "nv", "rank"), SHAPES)
@pytest.mark.parametrize("n", [1, 5])
def test_a_decomposition_solves_as_the_pseudo_inverse_does(m, nv, rank, n):
    J = matrices(m, nv, rank, n)
    d, rng = Decomposed.of(J), np.random.default_rng(2)
    assert d.rank == rank
    assert (d.ranks == rank).all()
    X = np.linalg.pinv(J, rcond=1e-9)
    rows, torque = rng.normal(size=(n, m)), rng.normal(size=(n, nv))
    np.testing.assert_allclose(d.solve(rows, rank), np.einsum("nkm,nm->nk", X, rows), atol=1e-12)
    np.testing.assert_allclose(d.carry(torque, rank), np.einsum("nkm,nk->nm", X, torque), atol=1e-12)
    np.testing.assert_allclose(d.carrier(rank), np.swapaxes(X, 1, 2), atol=1e-12)
    np.testing.assert_allclose(J @ d.tangent(rank), 0.0, atol=1e-12)
    np.testing.assert_allclose(d.left_null(rank) @ J, 0.0, atol=1e-12)
    assert d.tangent(rank).shape == (n, nv, nv - rank)
    assert d.left_null(rank).shape == (n, m - rank, m)
    velocity = rng.normal(size=(n, nv))
    size = np.linalg.norm(np.einsum("nmk,nk->nm", J, velocity), axis=1)
    assert (d.rate(velocity) <= size * (1.0 + 1e-12) + 1e-15).all()
    assert (d.rate(velocity) >= size / np.sqrt(m) - 1e-12).all()


def test_a_decomposition_of_nothing_leaves_everything_free():
    d = Decomposed.of(np.zeros((3, 0, 4)))
    assert d.rank == 0
    np.testing.assert_array_equal(d.tangent(0), np.broadcast_to(np.eye(4), (3, 4, 4)))
    np.testing.assert_array_equal(d.smallest(0), np.ones(3))


def test_a_large_jacobian_is_decomposed_block_by_block_to_the_same():
    rng = np.random.default_rng(5)
    J = np.zeros((1, 90, 120))
    for k in range(30):
        J[0, 3 * k : 3 * k + 3, 4 * k : 4 * k + 4] = matrices(3, 4, 2 if k % 3 == 0 else 3, 1)
    J = J[:, rng.permutation(90)][:, :, rng.permutation(120)]
    d = Decomposed.of(J)
    assert d.rank == 80
    np.testing.assert_allclose(J @ d.tangent(80), 0.0, atol=1e-12)
    np.testing.assert_allclose(singular_values(J[0]), np.linalg.svd(J[0], compute_uv=False), atol=1e-12)
    rows = rng.normal(size=(1, 90))
    np.testing.assert_allclose(d.solve(rows, 80)[0], np.linalg.pinv(J[0], rcond=1e-9) @ rows[0], atol=1e-10)


@pytest.mark.parametrize(
    ("s", "rank"),
    [
        ([10.0, 11.0 * RANK_TOLERANCE], 2),
        ([10.0, 9.0 * RANK_TOLERANCE], 1),
        ([1e-3, 1.1 * RANK_TOLERANCE], 2),
        ([1e-3, 0.9 * RANK_TOLERANCE], 1),
        ([0.9 * RANK_TOLERANCE, 0.0], 0),
        ([], 0),
    ],
)
def test_a_singular_value_counts_against_the_largest_or_one_whichever_is_more(s, rank):
    assert ranks_of(np.array(s)) == rank


@pytest.mark.parametrize(("m", "nv", "rank"), [(3, 5, 3), (4, 6, 3)])
def test_the_factorisation_for_a_known_rank_agrees_with_the_decomposition(m, nv, rank):
    J = matrices(m, nv, rank)
    f, s = factored(J, rank), np.linalg.svd(J, compute_uv=False)
    np.testing.assert_allclose(f.back, np.linalg.pinv(J, rcond=1e-9), atol=1e-12)
    np.testing.assert_allclose(J @ f.tangent, 0.0, atol=1e-12)
    np.testing.assert_allclose(
        np.swapaxes(f.tangent, 1, 2) @ f.tangent, np.eye(nv - rank)[None].repeat(5, 0), atol=1e-14
    )
    assert (f.sigma <= s[:, rank - 1] * (1.0 + 1e-12)).all()
    assert (f.sigma >= s[:, rank - 1] / np.sqrt(rank) * (1.0 - 1e-12)).all()
    assert f.tied.max() < 1e-12


def test_nothing_to_factorise_leaves_everything_free():
    f = factored(np.zeros((2, 0, 3)), 0)
    np.testing.assert_array_equal(f.tangent, np.broadcast_to(np.eye(3), (2, 3, 3)))
    assert (f.back.shape, f.sigma.tolist(), f.tied.tolist()) == ((2, 3, 0), [1.0, 1.0], [0.0, 0.0])


def test_a_rank_above_the_one_expected_shows_in_the_tie():
    assert factored(matrices(4, 6, 4), 3).tied.min() > 1e-3


@pytest.mark.parametrize("k", [1, 2, 3])
def test_inverses_of_singular_matrices_are_nan_and_the_others_right(k):
    M = matrices(k, k, k)
    M[2] = 0.0
    X, determinant = inverse(M)
    good = [0, 1, 3, 4]
    np.testing.assert_allclose(X[good] @ M[good], np.eye(k)[None].repeat(4, 0), atol=1e-12)
    np.testing.assert_allclose(determinant, np.linalg.det(M), rtol=1e-12, atol=1e-15)
    assert np.isnan(X[2]).all()


def test_a_tall_inverse_tells_its_smallest_singular_value_and_a_flat_one_none():
    M = matrices(4, 3, 3)
    X, smallest = pseudo_inverse(M)
    np.testing.assert_allclose(X @ M, np.eye(3)[None].repeat(5, 0), atol=1e-12)
    np.testing.assert_allclose(smallest, np.linalg.svd(M, compute_uv=False)[:, -1], rtol=1e-12)
    np.testing.assert_array_equal(pseudo_inverse(matrices(3, 4, 3))[1], 0.0)


def test_flat_directions_are_left_out_of_a_step():
    J = np.diag([1.0, 2.0 * LEFT_OUT, 0.5 * LEFT_OUT])[None]
    np.testing.assert_allclose(truncated_inverse(J)[0], np.diag([1.0, 0.5 / LEFT_OUT, 0.0]), rtol=1e-12, atol=1e-12)


def test_configurations_are_what_the_loops_say():
    chain = mechanisms.double_four_bar()
    loops = loops_of(chain)
    q = np.random.default_rng(1).normal(size=(4, chain.nq))
    here, seen = Configurations(loops, q), loops.see(q)
    np.testing.assert_array_equal(here.residual, seen.residual)
    np.testing.assert_array_equal(here.gap, np.abs(here.residual).max(axis=1))
    np.testing.assert_array_equal(here.J, seen.J)
    scaled = loops.row_scale[:, None] * here.J * loops.column_scale
    np.testing.assert_allclose(here.whole.s, np.linalg.svd(scaled, compute_uv=False), atol=1e-14)
    kept = here.independent.s
    np.testing.assert_allclose(kept, here.whole.s[:, : kept.shape[1]], atol=1e-14)  # nothing but zeros is left out
    assert here.rank == loops.rank(here.J[0]) == 4
    np.testing.assert_allclose(scaled @ here.free, 0.0, atol=1e-14)


DEAD = np.arccos((0.9**2 + 1.0 - 1.5**2) / 1.8)  # input angle at which coupler and rocker of the second lie in line


def two_with_a_dead_point(*, first: bool) -> tuple[fb.ClosedChain, np.ndarray]:
    """Return two independent four-bars in one chain, one at its dead point, and the configuration.

    Input 0.9 m, coupler 1.1 m, rocker 0.4 m, ground 1 m: it can be driven up to where coupler and rocker lie in line.
    """
    lengths = {True: (0.9, 1.1, 0.4, 1.0), False: (0.4, 1.1, 0.9, 1.0)}
    model, closures, q = pin.Model(), [], []
    for k, dead in enumerate((first, not first)):
        a, b, c, d = lengths[dead]
        where = mechanisms.at(0.0, 0.0, 0.2 * k)
        crank = mechanisms.add(model, 0, pin.JointModelRZ(), where, f"crank{k}", mechanisms.body(3 * k))
        coupler = mechanisms.add(model, crank, pin.JointModelRZ(), mechanisms.at(a), f"coupler{k}", mechanisms.body(9))
        rocker = mechanisms.add(
            model, 0, pin.JointModelRZ(), where * mechanisms.at(d), f"rocker{k}", mechanisms.body(8)
        )
        ends = (
            mechanisms.point(model, coupler, f"coupler{k}_end", mechanisms.at(b)),
            mechanisms.point(model, rocker, f"rocker{k}_end", mechanisms.at(c)),
        )
        closures.append(fb.Closure(ends, "3d", name=f"pin{k}"))
        if dead:
            line = np.angle(d - a * np.exp(1j * DEAD))
            q += [DEAD, line - DEAD, line + np.pi]
        else:
            angles = mechanisms.four_bar_angles(0.8, (a, b, c, d))
            q += [0.8, angles[1], angles[0] + angles[1] + angles[2] + np.pi]
    return fb.ClosedChain(model, closures, ("crank0", "crank1")), np.array(q)


@pytest.mark.parametrize("first", [True, False], ids=["first at its dead point", "second at its dead point"])
def test_one_group_at_its_dead_point_makes_the_whole_singular(first):
    chain, q = two_with_a_dead_point(first=first)
    assert np.abs(fb.closure_residual(chain, q)).max() < 1e-12
    with pytest.raises(SingularityError, match="type 2 singularity"):
        fb.complement(chain, q)
    x = q[[0, 3]]
    back = np.array(x)
    back[0 if first else 1] -= 0.3
    regular = fb.assemble(chain, back, near=q)
    with pytest.raises(SingularityError, match="configuration 1 is") as met:
        fb.complement(chain, np.stack([regular, q, regular]))
    assert (met.value.sample, met.value.sigma < 1e-7) == (1, True)
    still = fb.Motion(np.array([0.0, 0.1]), np.stack([x, x]), np.zeros((2, 2)), np.zeros((2, 2)))
    with pytest.raises(SingularityError) as caught:
        fb.drive(chain, still, near=q)
    assert (caught.value.sample, caught.value.time) == (0, 0.0)
    assert caught.value.sigma < 1e-7
    N = fb.complement(chain, regular)  # back from the dead point both groups are
    assert np.abs(N[[0, 3]] - np.eye(2)).max() == 0.0


@pytest.mark.parametrize("first", [True, False])
def test_the_nearest_group_tells_how_near_a_singularity_is(first):
    chain, q = two_with_a_dead_point(first=first)
    x = q[[0, 3]]
    x[0 if first else 1] -= 1e-3
    loops = loops_of(chain)
    passive = Configurations(loops, fb.assemble(chain, x, near=q)[None]).passive
    alone = [1.0 / np.linalg.norm(X[0] / g.scale[:, None]) for g, X in zip(passive.groups, passive.X, strict=True)]
    assert passive.sigma[0] == pytest.approx(min(alone), rel=1e-12)
    assert min(alone) < 0.1 * max(alone)


def test_two_regular_groups_are_inverted_alone():
    chain = two_four_bars(0.4)
    q = fb.assembly_modes(chain, [0.5, 0.9])[0]
    N = fb.complement(chain, q)
    assert not N[:3, 1].any()
    assert not N[3:, 0].any()
