"""Closure forces by the factors of the passive columns are those of least norm, and open where the rows say so."""

from __future__ import annotations

from dataclasses import replace

import families
import numpy as np
import pytest
from mechanisms import TILTED, at, five_bar, parallelogram, point
from moving_chains import NAMES, loaded, moving, pushed

import fivebar_pin as fb
from fivebar_pin.dynamics.by_factors import structure_of
from fivebar_pin.dynamics.reactions import Reactions, _by_decomposition, determinate
from fivebar_pin.errors import SolverError
from fivebar_pin.mechanism.loops import loops_of

EQUAL = 1e-12  # of the largest force
SEEN = ("joint", "closure", "joint_local", "closure_local")


def swing(chain: fb.ClosedChain) -> fb.Trajectory:
    """Return the motion of a five-bar that is far from all its ends."""
    t = np.linspace(0.0, 1.0, 3)
    swings = (fb.motion.harmonic(t, mean, 0.25, period=0.6, phase=k) for k, mean in enumerate((2.0, 1.0)))
    return fb.drive(chain, fb.motion.combine(*swings))


def by_decomposition(loads: fb.Loads) -> Reactions:
    """Return the reactions by the singular value decomposition of every sample's closures."""
    chain, path = loads.chain, loads.trajectory
    unbalanced = np.array(loads.tree_torque)
    unbalanced[:, chain.actuated_index] -= loads.torque
    found = _by_decomposition(chain, path, unbalanced, loads.external)
    return Reactions(chain, path, loads.external, *found, False, len(chain.closures))


def assert_same(one: Reactions, two: Reactions) -> None:
    size = np.abs(two.wrench).max() + np.abs(two.multipliers).max(initial=0.0)
    for name in (*SEEN, "multipliers", "wrench"):
        np.testing.assert_allclose(getattr(one, name), getattr(two, name), rtol=0, atol=EQUAL * size, err_msg=name)
    np.testing.assert_array_equal(one.determinate_rows, two.determinate_rows)
    np.testing.assert_allclose(determinate(one.free), determinate(two.free), rtol=0, atol=EQUAL)
    assert one.mismatch <= EQUAL * size


@pytest.mark.parametrize("name", NAMES)
def test_factors_and_decomposition_agree_and_leave_the_same_open(name):
    chain, path = moving(name)
    heavy = loaded(chain)
    for loads in (fb.inverse_dynamics(chain, path), fb.inverse_dynamics(heavy, path, external=pushed(heavy))):
        assert loads.reactions.regular == (name != "Bennett")
        assert_same(loads.reactions, by_decomposition(loads))


RANDOM = {
    **{
        f"{kind} {seed}": (lambda k=kind, s=seed: families.six_bar(k, s, home=True))
        for kind in ("watt", "stephenson")
        for seed in range(4)
    },
    **{f"RRR {legs}": (lambda k=legs: families.planar_rrr(k, 1, home=True)) for legs in (3, 4)},
}


@pytest.mark.parametrize("name", RANDOM)
def test_they_agree_on_random_linkages(name):
    chain = RANDOM[name]()
    home = chain.references["home"]
    x, fast = loops_of(chain).actuated_of(home[None]), np.ones((1, chain.na))
    path = fb.drive(chain, fb.Motion(np.zeros(1), x, fast, fast), near=home, limits="ignore")
    heavy = loaded(chain)
    loads = fb.inverse_dynamics(heavy, path, external=pushed(heavy))
    assert loads.reactions.regular
    assert_same(loads.reactions, by_decomposition(loads))


def test_what_is_open_depends_on_the_axes_and_on_where_the_joint_is():
    """A force out of the plane turns about a joint of the loop, but not where the closure lies on an axis of it."""
    chain = five_bar()
    path = swing(chain)
    seen = fb.inverse_dynamics(chain, path).reactions
    assert np.isnan(seen.closure[:, 0]).all(axis=0).tolist() == [False, False, True, False, False, False]
    assert np.isnan(seen.joint).any(axis=(0, 1)).tolist() == [False, False, True, True, True, False]
    tilted = five_bar(base=TILTED)
    reactions = fb.inverse_dynamics(tilted, swing(tilted)).reactions
    assert np.isnan(reactions.joint[..., :3]).all()
    assert np.isnan(reactions.joint_local[..., :3]).any(axis=(0, 1)).tolist() == [False, False, True]


def test_where_a_configuration_is_singular_its_closures_are_decomposed():
    """Coupler and cranks of a parallelogram in line: the rows lose rank, and more is open than elsewhere."""
    chain = parallelogram()
    flat, bent = np.zeros(3), np.array([0.4, -0.4, 0.4])
    for q, regular in ((np.stack([bent, bent]), True), (np.stack([bent, flat]), False)):
        zero = np.zeros((2, 3))
        path = fb.Trajectory(np.arange(2.0), q, zero, zero, fb.complement(chain, np.stack([bent, bent])), np.zeros(2))
        loads = fb.inverse_dynamics(chain, path)
        assert loads.reactions.regular == regular
        assert_same(loads.reactions, by_decomposition(loads))


def test_rows_of_two_closures_that_say_the_same_are_decomposed():
    """A second pin on the axis of the first: its rows follow from those of the other closure, not from their own."""
    base = five_bar()
    model = base.model.copy()
    ends = [model.frames[model.getFrameId(name)] for name in base.closures[0].ends]
    above = tuple(point(model, int(f.parentJoint), f"{f.name}_above", f.placement * at(0.0, 0.0, 0.1)) for f in ends)
    chain = fb.ClosedChain(model, (*base.closures, fb.Closure(above, "3d", name="above")), base.actuated)
    assert structure_of(base) is not None
    assert structure_of(chain) is None
    loads = fb.inverse_dynamics(chain, swing(chain))
    assert_same(loads.reactions, by_decomposition(loads))
    assert not loads.reactions.determinate_rows[0, :2].any()


def test_a_closure_that_holds_nothing_carries_nothing():
    base = five_bar()
    model = base.model.copy()
    ends = point(model, 0, "here", at()), point(model, model.getJointId("left"), "there", at())
    chain = fb.ClosedChain(model, (*base.closures, fb.Closure(ends, "3d", name="idle")), base.actuated)
    loads = fb.inverse_dynamics(chain, swing(chain))
    assert_same(loads.reactions, by_decomposition(loads))
    assert not loads.reactions.determinate_rows[:, loops_of(chain).anchored[1].rows].any()


def test_an_open_tree_has_joint_reactions_alone():
    chain = fb.ClosedChain(five_bar().model, (), five_bar().joints)
    n, rng = 3, np.random.default_rng(0)
    q, v, a = rng.normal(size=(3, n, 4))
    path = fb.Trajectory(np.arange(3.0), q, v, a, np.tile(np.eye(4), (n, 1, 1)), np.zeros(n))
    loads = fb.inverse_dynamics(chain, path)
    assert loads.reactions.regular
    assert loads.closure_reactions.shape == (3, 0, 6)
    assert_same(loads.reactions, by_decomposition(loads))


def test_a_spring_without_direction_is_refused_by_the_reactions_too():
    chain, path = moving("rod four-bar", 3)
    loads = fb.inverse_dynamics(chain, path)
    meeting = chain.with_springs((fb.Spring("crank_body", "universe", 5.0, 0.1),))
    with pytest.raises(SolverError, match="crank_body~universe has its ends on one point"):
        _ = replace(loads, chain=meeting).reactions
