"""Every mechanism that ships, and a robot's legs: conditions, a force balanced design, a proof or a design beyond."""

from __future__ import annotations

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin.balancing import Ball, balance, balance_conditions, pareto
from fivebar_pin.balancing.sampling import random_samples
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.io import shipped, shipped_path
from fivebar_pin.shipped import mechanisms

RANKS = {  # force, dynamic, whether planar
    "delta": (18, 57, False),
    "five_bar_case_I": (6, 11, True),
    "five_bar_case_II": (6, 11, True),
    "four_bar_antiparallelogram": (4, 8, True),
    "four_bar_crank_rocker": (4, 8, True),
    "four_bar_parallelogram": (4, 8, True),
    "four_bar_reactionless": (4, 8, True),
    "planar_3rrr": (10, 19, True),
    "six_bar_stephenson": (6, 13, True),
    "six_bar_watt": (6, 13, True),
    "slider_crank": (4, 7, True),
    "spatial_rssr": (7, 23, False),
}


def states(chain: fb.ClosedChain, seed: int) -> fb.Trajectory:
    """Unrelated closed states at random speeds, consistent one by one."""
    from fivebar_pin.mechanism.complement import rates_of
    from fivebar_pin.mechanism.configurations import Configurations
    from fivebar_pin.mechanism.loops import loops_of

    samples = random_samples(chain, 20, seed=seed)
    rng = np.random.default_rng(seed)
    va, aa = rng.normal(size=(2, len(samples), chain.na)) * 5.0
    v, a, N = rates_of(Configurations(loops_of(chain), samples.q), va, aa)
    return fb.Trajectory(np.arange(float(len(samples))), samples.q, v, a, N, np.zeros(len(samples)))


def check_force_balanced(chain: fb.ClosedChain, design: fb.balancing.Design) -> None:
    """Forces of random states cancel, in the plane of motion or in space, relative to those of the single bodies."""
    still = chain.with_gravity((0.0, 0.0, 0.0))
    path = states(still, 3)
    before = inverse_dynamics(still, path).shaking_force
    loads = inverse_dynamics(design.chain.with_gravity((0.0, 0.0, 0.0)), path)
    bodies = np.abs(loads.reactions.bodies.rate[..., :3]).max()
    assert np.abs(before).max() > 1e-3 * bodies
    assert np.abs(loads.shaking_force).max() <= 1e-11 * bodies


def test_every_shipped_mechanism_is_in_the_table() -> None:
    assert set(shipped()) == set(RANKS)


@pytest.mark.parametrize("name", sorted(RANKS))
def test_conditions_and_force_balance_of_every_shipped_mechanism(name: str) -> None:
    chain = fb.load(shipped_path(name))
    force, dynamic, planar = RANKS[name]
    conditions = balance_conditions(chain, "force")
    assert conditions.space.planar == planar
    assert conditions.gap > 1e6
    assert conditions.rank == force
    assert balance_conditions(chain, "dynamic").rank == dynamic
    design = balance(chain, "force")
    assert design.feasible
    assert design.residual < 1e-13
    assert -1e-12 <= design.gap < 1e-6 * max(chain.mass, design.objective)
    if np.abs(conditions.residual()).max() > 1e-9 * chain.mass:
        check_force_balanced(chain, design)


def test_the_shipped_reactionless_four_bar_satisfies_the_dynamic_conditions_of_its_branch() -> None:
    chain = fb.load(shipped_path("four_bar_reactionless"))
    residuals = []
    for q in fb.assembly_modes(chain, [1.0]):
        conditions = balance_conditions(chain, "dynamic", near=q)
        residuals.append(float(np.abs(conditions.residual()).max()))
    assert min(residuals) < 1e-12 < max(residuals)


@pytest.mark.parametrize("sides", [("left",), ("left", "right")])
def test_the_legs_of_the_solo_robot(sides: tuple[str, ...]) -> None:
    """Real inertias, a base that is a robot's trunk, one loop and two."""
    chain = mechanisms.solo_legs(sides)
    conditions = balance_conditions(chain, "force")
    assert conditions.space.planar
    assert conditions.rank == 6 * len(sides)
    assert balance_conditions(chain, "dynamic").rank == 11 * len(sides)
    design = balance(chain, "force", region=Ball(0.2))
    assert design.feasible
    path = states(chain.with_gravity((0.0, 0.0, 0.0)), 1)
    loads = inverse_dynamics(design.chain.with_gravity((0.0, 0.0, 0.0)), path)
    bodies = np.abs(loads.reactions.bodies.rate[..., :3]).max()
    assert np.abs(loads.shaking_force).max() <= 1e-11 * bodies


def test_static_balance_under_gravity_takes_no_more_than_force_balance() -> None:
    chain = fb.load(shipped_path("slider_crank"))
    gravity = balance(chain, "static", gravity=(0.0, -1.0, 0.0))
    assert gravity.objective <= balance(chain, "force").objective + 1e-9


def test_front_of_a_spatial_mechanism() -> None:
    chain = fb.load(shipped_path("spatial_rssr"))
    front = pareto(chain, "force", "added_mass", "inertia", 4, motions=states(chain, 0))
    assert (np.diff(front.values[:, 0]) > 0).all() and (np.diff(front.values[:, 1]) < 0).all()
