"""Blocks are factorised and solved as by NumPy: square, tall and mixed, of every size."""

from __future__ import annotations

import calls
import numpy as np
import pytest
from coupled import coupled, random_ratios
from mechanisms import bennett, parallelogram, spherical_four_bar
from sampled import Sampled

from fivebar_pin.engine import tables as e
from fivebar_pin.mechanism.loops import loops_of

SQUARE = [(n, n, n) for n in (1, 2, 3, 4, 5, 6, 9, 12)]
TALL = [(2, 1, 2), (3, 2, 3), (5, 3, 5), (7, 6, 7)]
MIXED = [(2, 1, 1), (3, 2, 2), (5, 3, 3), (8, 6, 6)]  # as many rows of each as are independent
TALL_AND_MIXED = [(4, 2, 3), (7, 3, 5)]
SHAPES = [*SQUARE, *TALL, *MIXED, *TALL_AND_MIXED]
every_shape = pytest.mark.parametrize("shape", SHAPES, ids=str)


class System:
    """One block of these rows, passive columns and rank, at a Jacobian."""

    def __init__(self, shape: tuple[int, int, int], seed: int = 0) -> None:
        rows, self.n, rank = shape
        self.rng = np.random.default_rng([seed, *shape])
        self.s = Sampled(coupled(random_ratios(self.rng, rows, self.n + 3, rank), 3))
        calls.closures(self.s.I, self.s.W)
        (self.g,) = self.s.blocks
        self.scale = loops_of(self.s.chain).column_scale

    @property
    def A(self) -> np.ndarray:
        """The passive columns of the rows, combined where they are mixed (height, n)."""
        s, mix = self.s, self.s.of(self.g, e.MIX)
        J, height = s.J[:, : self.n], s.of(self.g, e.HEIGHT)
        return J if mix < 0 else s.W[mix : mix + height * len(J)].reshape(height, -1) @ J

    def overwrite(self, J: np.ndarray) -> None:
        """Put another Jacobian (rows, columns) in the place of the one that stands there."""
        first = self.s.of(self.s.rows[0], e.JACOBIAN0)
        self.s.W[first : first + J.size] = J.ravel()

    def factorise(self) -> bool:
        return bool(calls.factorise(self.s.I, self.s.W))

    def sign(self) -> float:
        return float(self.s.numbers(e.SIGNS, 1)[0])

    def solve(self, lead: np.ndarray, x_a: np.ndarray) -> np.ndarray:
        """Solve J x = lead for the passive part of x."""
        s = self.s
        for r, value in zip(s.rows, lead, strict=True):
            s.W[s.of(r, e.LEAD)] = value
        x = s.numbers(e.X, s.chain.nv)
        x[:] = np.r_[np.full(self.n, np.nan), x_a]
        calls.solve(s.I, s.W)
        return np.array(x[: self.n])

    def norm(self) -> float:
        return float(calls.inverse_norm(self.s.I, self.s.W, self.g))


@every_shape
def test_the_block_is_as_asked_for(shape):
    rows, n, rank = shape
    system = System(shape)
    assert [system.s.of(system.g, f) for f in (e.RAW, e.WIDTH, e.HEIGHT)] == [rows, n, rank]
    assert (system.s.of(system.g, e.MIX) >= 0) is (rank < rows)
    np.testing.assert_allclose(np.linalg.matrix_rank(system.A), n)


@every_shape
def test_what_is_solved_solves_all_rows(shape):
    system = System(shape)
    assert system.factorise()
    for _ in range(5):
        x = system.rng.normal(size=system.n + 3)
        found = system.solve(system.s.J @ x, x[system.n :])
        np.testing.assert_allclose(found, x[: system.n], rtol=0.0, atol=1e-12 * np.linalg.cond(system.A))


@pytest.mark.parametrize("shape", [*TALL, *TALL_AND_MIXED], ids=str)
def test_of_rows_that_contradict_each_other_the_least_squares_are_solved(shape):
    system = System(shape)
    assert system.factorise() and system.sign() == 1.0
    lead, mix = system.rng.normal(size=shape[0]), system.s.of(system.g, e.MIX)
    M = np.eye(shape[0]) if mix < 0 else system.s.W[mix : mix + shape[2] * shape[0]].reshape(shape[2], -1)
    expected = np.linalg.lstsq(system.A, M @ lead, rcond=None)[0]
    found = system.solve(lead, np.zeros(3))
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * np.linalg.cond(system.A) ** 2)


@pytest.mark.parametrize("shape", [*SQUARE, *MIXED], ids=str)
def test_signs_are_those_of_determinants(shape):
    seen = set()
    for seed in range(12):
        system = System(shape, seed)
        assert system.factorise()
        assert system.sign() == np.sign(np.linalg.det(system.A))
        seen.add(system.sign())
    assert seen == {1.0, -1.0}


@pytest.mark.parametrize("shape", SQUARE[1:], ids=str)
def test_the_largest_of_a_column_is_its_pivot(shape):
    """A first column of 1e-17 beside ones costs no digit; a first number of zero neither."""
    for head in (1e-17, 0.0):
        system = System(shape)
        J = system.s.J
        J[0, 0] = head
        system.overwrite(J)
        x = system.rng.normal(size=system.n + 3)
        assert system.factorise()
        assert system.sign() == np.sign(np.linalg.det(system.A))
        found = system.solve(J @ x, x[system.n :])
        np.testing.assert_allclose(found, x[: system.n], rtol=0.0, atol=1e-13 * np.linalg.cond(system.A))


@every_shape
def test_columns_that_vanish_or_are_no_numbers_are_singular(shape):
    for value in (0.0, np.nan):
        system = System(shape)
        J = system.s.J
        J[:, system.n - 1] = value
        system.overwrite(J)
        assert not system.factorise()
        assert system.sign() == 0.0


@pytest.mark.parametrize("shape", TALL, ids=str)
def test_a_column_that_is_nearly_reflected_already_loses_no_digit(shape):
    """The reflection goes to the far side: (1, 1e-9, ...) to -1, never to 1."""
    for tail in (1e-9, 0.0):
        for head in (1.0, -1.0):
            system = System(shape)
            J = system.s.J
            J[:, 0] = [head, *(tail * np.arange(1.0, shape[0]))]
            system.overwrite(J)
            x = system.rng.normal(size=system.n + 3)
            assert system.factorise()
            found = system.solve(J @ x, x[system.n :])
            np.testing.assert_allclose(found, x[: system.n], rtol=0.0, atol=1e-13 * np.linalg.cond(system.A))


@pytest.mark.parametrize("shape", [(5, 5, 5), (9, 9, 9)], ids=str)
def test_a_block_too_singular_for_numbers_is_forgotten(shape):
    """Its inverse overflows; the next regular one is told as if it had not been there."""
    system = System(shape)
    J = system.s.J
    assert system.factorise()
    norm = system.norm()
    tiny = np.array(J)
    tiny[:, 0] *= 1e-200
    with np.errstate(all="ignore"):
        system.overwrite(tiny)
        assert system.factorise()
        assert not system.norm() < 1e100
    system.overwrite(J)
    assert system.factorise()
    np.testing.assert_allclose(system.norm(), norm, rtol=0.3)


def test_one_singular_block_among_regular_ones_is_told():
    """Whichever of the three it is."""
    s = Sampled(coupled(np.array([[1.0, 0, 0, 2], [0, 3, 0, 1], [0, 0, 2, 1]]), 1))
    calls.closures(s.I, s.W)
    assert len(s.blocks) == 3 and calls.factorise(s.I, s.W)
    for k, r in enumerate(s.rows):
        W = np.array(s.W)
        W[s.of(r, e.JACOBIAN0)] = 0.0
        assert not calls.factorise(s.I, W)
        signs = W[s.I[e.SIGNS] :][:3]
        assert signs[k] == 0.0 and np.count_nonzero(signs) == 2


@pytest.mark.parametrize("shape", [x for x in SQUARE if x[0] <= 4], ids=str)
def test_inverses_of_small_blocks_have_their_frobenius_norm(shape):
    system = System(shape)
    assert system.factorise()
    scaled = system.A * system.scale[: system.n]
    np.testing.assert_allclose(system.norm(), np.linalg.norm(np.linalg.inv(scaled)), rtol=1e-12)


@pytest.mark.parametrize("shape", [x for x in SHAPES if x not in SQUARE[:4]], ids=str)
def test_inverses_of_large_blocks_come_to_have_their_largest_singular_value(shape):
    """Never more, and nearly as much after a few samples; those that come out small and square have Frobenius' norm."""
    system = System(shape)
    assert system.factorise()
    exact = np.linalg.norm(np.linalg.pinv(system.A * system.scale[: system.n]), 2)
    norms = [system.norm() for _ in range(100)]
    if (shape[2], shape[1]) not in [(n, n) for n in range(5)]:
        assert norms[0] <= exact * (1.0 + 1e-12) and norms[0] >= 0.2 * exact
        assert max(norms) <= exact * (1.0 + 1e-12)
        np.testing.assert_allclose(norms[-1], exact, rtol=0.02)
    else:
        np.testing.assert_allclose(norms, np.linalg.norm(np.linalg.inv(system.A * system.scale[: system.n])))


@pytest.mark.parametrize("made", [bennett, lambda: (spherical_four_bar((0.5, 1.0, 0.9, 1.2)), None)])
def test_mechanisms_with_too_many_rows_have_tall_blocks(made):
    chain, _ = made()
    (g,) = (s := Sampled(chain)).blocks
    assert s.of(g, e.HEIGHT) > s.of(g, e.WIDTH)


def test_a_mechanism_that_lies_flat_is_singular_but_for_round_off():
    chain = parallelogram()
    s = Sampled(chain).set(q=np.zeros(chain.nq))
    calls.closures(s.I, s.W)
    assert not calls.factorise(s.I, s.W) or calls.inverse_norm(s.I, s.W, s.blocks[0]) > 1e12


@pytest.mark.parametrize("n", [5, 6, 9])
@pytest.mark.parametrize("weakest", [1e-1, 1e-3, 1e-6])
def test_the_weakest_direction_is_found_wherever_it_lies(n, weakest):
    """Orthogonal to where the iteration starts, or to what was weakest before, as in symmetric mechanisms.

    Each column of V is the weakest in turn, the first after the start (1, ..., 1) in the units of the columns.
    """
    system = System((n, n, n))
    scale = system.scale[:n]
    U, V = (np.linalg.qr(system.rng.normal(size=(n, n)))[0] for _ in range(2))
    V = np.linalg.qr(np.column_stack([1.0 / scale, V[:, 1:]]))[0]
    s, J = system.s, system.s.J
    for k in (1, 2, 1, 0, n - 1):
        sigma = np.ones(n)
        sigma[k] = weakest
        J[:, :n] = U @ np.diag(sigma) @ V.T / scale
        system.overwrite(J)
        for _ in range(3):
            assert system.factorise()
            norm = system.norm()
        np.testing.assert_allclose(norm, 1.0 / weakest, rtol=0.02)
    assert s.of(system.g, e.HEIGHT) == n
