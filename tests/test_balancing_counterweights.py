"""Counterweights that can be made: exact where the asked inertia allows it, honest about the difference where not."""

from __future__ import annotations

import mechanisms
import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin import paper
from fivebar_pin.balancing import Ball, Disc, balance, realise
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.errors import InfeasibleError, InvalidInputError, UnknownNameError

STEEL = Disc(7850.0, 0.01)


def case_I() -> tuple[fb.ClosedChain, fb.Trajectory]:
    linkage = paper.table_1("I", "unbalanced")
    motion = paper.default_motion(samples=31)
    return linkage.chain(), fb.drive(linkage.chain(), motion, near=linkage.configuration(*motion.q[0]))


def sampled(shape: str, size: tuple[float, ...], density: float, n: int = 400) -> tuple[float, float]:
    """Mass and polar inertia of a flat piece, by summing over a grid."""
    a, b, t = size
    half = a if shape == "disc" else 0.5 * a
    edge = np.linspace(-half, half, n + 1)
    x, y = np.meshgrid(0.5 * (edge[1:] + edge[:-1]), 0.5 * (edge[1:] + edge[:-1]))
    r2 = x * x + y * y
    inside = (r2 <= a * a) & (r2 >= b * b) if shape == "disc" else np.abs(y) <= 0.5 * b
    cell = density * t * (edge[1] - edge[0]) ** 2
    return float(cell * inside.sum()), float(cell * r2[inside].sum())


@pytest.mark.parametrize("line", [None, (1.0, 0.0, 0.0)])
def test_discs_made_for_the_design_carry_exactly_its_parameters(line: tuple[float, ...] | None) -> None:
    chain, path = case_I()
    disc = Disc(STEEL.density, STEEL.thickness, line)
    design = balance(
        chain,
        "force",
        region=Ball(0.1),
        counterweight=disc,
        motions=path,
        minimise={"rms_torque": 1.0, "added_mass": 0.2},
    )
    made = realise(design, material=STEEL.density, thickness=STEEL.thickness)
    assert (made.deviation <= 1e-9).all()
    for w, change in zip(made.weights, (c for c in design.added if c.mass), strict=True):
        mass, inertia = sampled("disc", w.size, w.density)
        assert mass == pytest.approx(change.mass, rel=2e-2)
        assert inertia == pytest.approx(change.inertia[2, 2], rel=4e-2)
        np.testing.assert_allclose(w.pose[:3, 3], change.place, atol=1e-15)
        if line:
            assert abs(change.place[1]) < 1e-9
    loads = inverse_dynamics(made.chain, path)
    assert np.abs(loads.shaking_force).max() < 1e-13
    assert np.sqrt((loads.torque**2).sum(axis=1).mean()) == pytest.approx(design.terms["rms_torque"], rel=1e-6)


def test_discs_cost_more_than_point_masses_and_less_the_denser_they_are() -> None:
    chain, _ = case_I()
    points = balance(chain, "force", region=Ball(0.1))
    steel = balance(chain, "force", region=Ball(0.1), counterweight=STEEL)
    lead = balance(chain, "force", region=Ball(0.1), counterweight=Disc(11340.0, 0.01))
    assert points.objective < lead.objective < steel.objective


@pytest.mark.parametrize("shape", ["disc", "bar"])
def test_less_inertia_than_a_solid_piece_has_is_stated_and_leaves_the_force_balance(shape: str) -> None:
    """The least mass design asks for point masses; mass and place stay exact."""
    chain, path = case_I()
    design = balance(chain, "force", region=Ball(0.1))
    made = realise(design, shape=shape, thickness=0.01)
    assert (made.deviation[:2] <= 1e-12).all()
    assert made.deviation[2] > 1e-6
    for w in made.weights:
        mass, _ = sampled(shape, w.size, w.density)
        assert mass == pytest.approx(w.parameters[0], rel=2e-2)
    assert np.abs(inverse_dynamics(made.chain, path).shaking_force).max() < 1e-13
    assert "inertia off by" in str(made)


def test_a_bar_meets_a_large_inertia_exactly() -> None:
    chain, _ = case_I()
    slim = Disc(STEEL.density, STEEL.thickness / 3.0)  # what a disc of a third of the thickness needs, a bar has
    design = balance(chain, "force", region=Ball(0.1), counterweight=slim)
    made = realise(design, shape="bar", thickness=STEEL.thickness)
    assert (made.deviation <= 1e-9).all()
    for w in made.weights:
        assert w.size[0] > w.size[1]


def test_counterweights_are_drawn_in_their_own_colour_where_they_are() -> None:
    chain, _ = case_I()
    made = realise(balance(chain, "force", region=Ball(0.1)), thickness=0.01)
    own = made.chain.visuals[len(chain.visuals) :]
    assert [v.shape for v in own] == ["cylinder"] * 3
    assert all(v.rgba != w.rgba for v in own for w in chain.visuals)
    assert made.chain.mass == pytest.approx(0.66, abs=1e-6)
    np.testing.assert_allclose(own[0].placement[:3, 3], [-0.1, 0.0, 0.0], atol=1e-6)


def test_spatial_mechanisms_get_balls() -> None:
    chain = mechanisms.rssr()
    design = balance(chain, "force", region=Ball(1.0))
    made = realise(design, shape="ball", material="tungsten")
    assert (made.deviation[:2] <= 1e-12).all()
    assert np.abs(design.conditions.residual(made.chain)).max() < 1e-13
    with pytest.raises(InvalidInputError, match="ball"):
        realise(design)
    with pytest.raises(InvalidInputError, match="planar"):
        balance(chain, "force", counterweight=STEEL)


def test_bad_requests_are_refused_with_what_is_known() -> None:
    chain, _ = case_I()
    design = balance(chain, "force", region=Ball(0.1))
    with pytest.raises(UnknownNameError, match="disc, bar, ball"):
        realise(design, shape="cone")
    with pytest.raises(UnknownNameError, match="steel"):
        realise(design, material="stel")
    with pytest.raises(InvalidInputError, match="density"):
        realise(design, material=-1.0)
    with pytest.raises(InvalidInputError, match="thickness"):
        realise(design, thickness=0.0)
    with pytest.raises(InvalidInputError, match="must not leave the plane"):
        balance(chain, "force", counterweight=Disc(7850.0, 0.01, (0.0, 0.0, 1.0)))
    with pytest.raises(InvalidInputError, match="mode 'add'"):
        realise(balance(chain, "force", mode="redesign", region=Ball(0.1)))
    with pytest.raises(InfeasibleError, match="Farkas"):
        realise(balance(chain, "dynamic", region=Ball(0.1)))
