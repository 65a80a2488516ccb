"""What is prepared for the engine: triangular order of blocks, motors of each, independent rows, sealed vectors."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import add, at, bennett, body, five_bar, four_bar, point, rscr, side_by_side, welded_four_bar
from random_chains import random_chain
from tied_chains import geared_five_bar, planetary_train

import fivebar_pin as fb
from fivebar_pin.closures import Coupling
from fivebar_pin.closures.rows import along, tilt
from fivebar_pin.engine import tables as e
from fivebar_pin.mechanism.layout import blocks_of, joined_rows, split
from fivebar_pin.mechanism.prepared import prepared_of


def laid_out(chain: fb.ClosedChain) -> list[tuple[int, int, int, list[int], list[int]]]:
    """Return raw rows, height, width, columns and motors of every block."""
    I = prepared_of(chain).I
    found = []
    for g in range(I[e.BLOCKS], I[e.BLOCKS_END], e.BLOCK_SIZE):
        columns = I[I[g + e.COLUMN_LIST] :][: I[g + e.WIDTH]]
        motors = I[I[g + e.MOTOR_LIST] :][: I[g + e.MOTOR_COUNT]]
        found.append((int(I[g + e.RAW]), int(I[g + e.HEIGHT]), len(columns), columns.tolist(), motors.tolist()))
    return found


def ladder(count: int, *, sharing: bool) -> fb.ClosedChain:
    """Return four-bars side by side on one crank, or in a row where the rocker of each is the crank of the next."""
    model, closures, x = pin.Model(), [], 0.0
    crank = add(model, 0, pin.JointModelRZ(), at(), "crank", body(1))
    for k in range(count):
        coupler = add(model, crank, pin.JointModelRZ(), at(0.4, 0.0, 0.1 * k * sharing), f"coupler{k}", body(2))
        x = 1.0 if sharing else x + 1.0
        rocker = add(model, 0, pin.JointModelRZ(), at(x, 0.0, 0.1 * k * sharing), f"rocker{k}", body(3))
        ends = point(model, coupler, f"end{k}", at(1.1)), point(model, rocker, f"pin{k}", at(0.9))
        closures.append(fb.Closure(ends, name=f"loop{k}"))
        crank = crank if sharing else rocker
    return fb.ClosedChain(model, closures[::-1], ("crank",))


@pytest.mark.parametrize("sharing", [True, False])
def test_a_ladder_of_loops_is_as_many_blocks_each_with_the_one_motor(sharing):
    found = laid_out(chain := ladder(5, sharing=sharing))
    assert [block[:3] for block in found] == [(2, 2, 2)] * 5
    assert all(motors == [0] for *_, motors in found)
    assert sorted(k for *_, columns, _ in found for k in columns) == chain.passive_index.tolist()
    if not sharing:  # each needs the rocker of the one before, though the closures were named the other way round
        assert [columns for *_, columns, _ in found] == [[1 + 2 * k, 2 + 2 * k] for k in range(5)]


def test_loops_that_share_nothing_have_motors_of_their_own():
    found = laid_out(side_by_side((0.4, 1.1, 0.9, 1.0), (0.3, 1.0, 0.9, 1.1), (0.4, 1.2, 0.9, 1.0)))
    assert sorted(motors for *_, motors in found) == [[0], [1], [2]]


def test_a_shared_platform_is_one_block_with_all_motors():
    (block,) = laid_out(fb.load("planar_3rrr"))
    assert block[:3] == (4, 4, 4)  # two loops of two rows; the platform hangs on one leg
    assert block[4] == [0, 1, 2]


def test_a_coupling_is_solved_before_the_loop_that_needs_it():
    gears, loop = laid_out(geared_five_bar()[0])
    assert gears[:3] == (1, 1, 1) and loop[:3] == (2, 2, 2)
    assert gears[4] == loop[4] == [0]
    (train,) = laid_out(planetary_train())  # planet and carrier turn in both meshes
    assert train[:3] == (2, 2, 2)


def test_a_chain_of_couplings_is_solved_from_the_motor_on_whatever_their_order():
    model = pin.Model()
    for k in range(6):
        add(model, 0, pin.JointModelRZ(), at(0.1 * k), f"wheel{k}", body(k))
    ties = [Coupling({f"wheel{k}": 1.0, f"wheel{k + 1}": 2.0}, name=f"mesh{k}") for k in (3, 0, 4, 2, 1)]
    found = laid_out(fb.ClosedChain(model, ties, ("wheel2",)))
    order = [k for *_, columns, _ in found for k in columns]
    assert sorted(order) == [0, 1, 3, 4, 5] and order.index(1) < order.index(0)
    assert order.index(3) < order.index(4) < order.index(5)
    assert all(block[:3] == (1, 1, 1) and block[4] == [0] for block in found)


@pytest.mark.parametrize(
    ("make", "shape"),
    [
        (five_bar, (2, 2, 2)),
        (lambda: five_bar(kind="revolute"), (2, 2, 2)),
        (lambda: welded_four_bar(base=at(0.3, 0.1, 0.2, (0.4, 0.5, 0.6))), (3, 3, 3)),
        (lambda: bennett()[0], (5, 5, 2)),
        (lambda: rscr()[0], (5, 5, 5)),
    ],
)
def test_rows_that_say_nothing_are_left_out(make, shape):
    (block,) = laid_out(make())
    assert block[:3] == shape


def test_rows_that_depend_on_others_of_their_group_are_mixed():
    """Two welds of one planar loop: six rows in the plane, of which three are independent everywhere."""
    model = pin.Model()
    crank = add(model, 0, pin.JointModelRZ(), at(), "crank", body(1))
    arm = add(model, crank, pin.JointModelRZ(), at(0.5), "arm", body(2))
    slide = add(model, arm, pin.JointModelPX(), at(0.4), "slide", body(3))
    ends = [
        (point(model, 0, f"base{k}", at(0.9, 0.1 * k)), point(model, slide, f"end{k}", at(0.1, 0.1 * k)))
        for k in (0, 1)
    ]
    chain = fb.ClosedChain(model, [fb.Closure(x, "6d", name=f"weld{k}") for k, x in enumerate(ends)], ())
    raw, height, width, columns, _ = laid_out(chain)[0]
    assert (raw, width, columns) == (6, 3, [0, 1, 2])
    assert height < raw


def random_triangle(rng: np.random.Generator, sizes: list[int], density: float) -> np.ndarray:
    """Return a shuffled pattern of blocks of these sizes, each one connected, with anything below them."""
    n, ends = sum(sizes), np.cumsum([0, *sizes])
    pattern = np.zeros((n, n), dtype=bool)
    for start, end in pairwise(ends):
        size = end - start
        block = np.eye(size, dtype=bool) | np.roll(np.eye(size, dtype=bool), 1, axis=1)  # a ring
        pattern[start:end, start:end] = block | (rng.random((size, size)) < density)
        pattern[start:end, :start] = rng.random((size, start)) < density
    return pattern[np.ix_(rng.permutation(n), rng.permutation(n))]


@pytest.mark.parametrize("density", [0.0, 0.1, 0.5])
@pytest.mark.parametrize("sizes", [[1], [1, 1, 1, 1], [2, 2, 2], [3, 1, 4, 2], [6], [1, 5, 1, 2, 2]], ids=str)
def test_a_triangle_is_split_into_its_blocks_in_order(sizes, density):
    for seed in range(10):
        pattern = random_triangle(np.random.default_rng([seed, len(sizes)]), sizes, density)
        parts = split(pattern)
        assert sorted(len(rows) for rows, _ in parts) == sorted(sizes)
        assert all(len(rows) == len(columns) for rows, columns in parts)
        for axis in (0, 1):
            assert sorted(np.concatenate([part[axis] for part in parts]).tolist()) == list(range(len(pattern)))
        known: set[int] = set()
        for rows, columns in parts:
            known |= set(columns.tolist())
            assert set(np.flatnonzero(pattern[rows].any(axis=0)).tolist()) <= known


def test_a_system_without_a_matching_stays_whole():
    pattern = np.array([[1, 0, 0], [1, 0, 0], [1, 1, 1]], dtype=bool)
    ((rows, columns),) = split(pattern)
    assert rows.tolist() == columns.tolist() == [0, 1, 2]


def test_motors_of_a_block_are_those_of_the_blocks_it_needs():
    """x2 by motor 0, x3 by x2 and motor 1, x4 by nothing."""
    touched = [np.array(x) for x in ([0, 2], [1, 2, 3], [4])]
    group = np.arange(3), np.array([2, 3, 4]), None
    found = {int(b.columns[0]): b.inputs.tolist() for b in blocks_of([group], touched, np.array([0, 1]))}
    assert found == {2: [0], 3: [0, 1], 4: []}


def test_mixed_and_tall_groups_stay_whole():
    touched = [np.array([0, 2]), np.array([1, 3])]
    (mixed,) = blocks_of([(np.arange(2), np.array([2, 3]), np.eye(2))], touched, np.array([0, 1]))
    (tall,) = blocks_of([(np.arange(2), np.array([2]), None)], touched, np.array([0, 1]))
    assert mixed.columns.tolist() == [2, 3] and mixed.inputs.tolist() == [0, 1]
    assert (tall.height, tall.factors) == (2, 3)


def test_joined_rows_are_combinations_of_direction_and_number():
    rows = along([1.0, 0.0, 0.0], 0.3), along([0.0, 1.0, 0.0], -0.2)
    (one,) = joined_rows(rows, np.array([[0.6, 0.8]]))
    np.testing.assert_allclose([*one.direction, one.number], [0.6, 0.8, 0.0, 0.6 * 0.3 - 0.8 * 0.2], rtol=1e-15)
    n = np.array([0.0, 0.0, 1.0])
    (two,) = joined_rows((tilt([1.0, 0.0, 0.0], n), tilt([0.0, 1.0, 0.0], n)), np.array([[0.6, 0.8]]))
    assert two.sort == "tilt"
    np.testing.assert_array_equal(two.other, n)


def test_vectors_are_made_once_and_sealed_and_memory_is_not():
    chain = random_chain(3)
    prepared = prepared_of(chain)
    assert prepared_of(chain) is prepared
    for vector in (prepared.I, prepared.W):
        with pytest.raises(ValueError, match="read-only"):
            vector[0] = 1
    W = prepared.memory()
    assert W is prepared.memory() and W.flags.writeable
    np.testing.assert_array_equal(W[: prepared.W.size], prepared.W)
    assert prepared.I[e.MEMORY] == prepared.W.size == W.size - chain.na**2  # behind it there is room for M_bar


def test_designs_of_one_mechanism_differ_in_their_constants_only():
    """The records stay the same, and so does the memory before the first sample."""
    chain = four_bar()
    heavier = chain.with_inertias({"coupler": body(9, mass=4.0)})
    one, two = prepared_of(chain), prepared_of(heavier)
    np.testing.assert_array_equal(one.I, two.I)
    constants = int(one.I[e.CONSTANTS])
    assert np.count_nonzero(one.W[:constants] != two.W[:constants])
    np.testing.assert_array_equal(one.W[constants:], two.W[constants:])
