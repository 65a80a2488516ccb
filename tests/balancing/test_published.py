"""Balancing against results that others published, and against mechanisms that no mass can balance."""

from __future__ import annotations

import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin.balancing import Ball, balance, balance_conditions
from fivebar_pin.balancing.sampling import random_samples


def serial(links: int) -> fb.ClosedChain:
    """A planar arm without any closure."""
    model = pin.Model()
    model.name, joint = "arm", 0
    for k in range(links):
        where = mechanisms.at(0.5 if k else 0.0)
        joint = mechanisms.add(model, joint, pin.JointModelRZ(), where, f"j{k}", mechanisms.body(k))
    return fb.ClosedChain(model, (), tuple(f"j{k}" for k in range(links)))


def trammel() -> fb.ClosedChain:
    """A bar whose ends slide along two perpendicular lines."""
    model = pin.Model()
    model.name = "trammel"
    slide = mechanisms.add(model, 0, pin.JointModelPX(), mechanisms.at(), "along_x", mechanisms.body(1))
    bar = mechanisms.add(model, slide, pin.JointModelRZ(), mechanisms.at(), "bar", mechanisms.body(2))
    other = mechanisms.add(model, 0, pin.JointModelPY(), mechanisms.at(), "along_y", mechanisms.body(3))
    ends = (
        mechanisms.point(model, bar, "end", mechanisms.at(0.5)),
        mechanisms.point(model, other, "eye", mechanisms.at()),
    )
    return fb.ClosedChain(model, (fb.Closure(ends, "3d"),), ("bar",))


def test_two_counterweights_on_the_grounded_links_balance_any_four_bar() -> None:
    """Berkof and Lowen 1969: m1 r1 and m3 r3 follow from the coupler alone, written as complex first moments."""
    chain, reach = mechanisms.four_bar(), 0.5
    pi = chain.inertial_parameters
    first = pi[:, 1] + 1j * pi[:, 2]
    crank, coupler, rocker = 0.4, 1.1, 0.9
    wanted = {
        "crank": -(first[0] + crank * (pi[1, 0] - first[1] / coupler)),
        "rocker": -(first[2] + rocker * first[1] / coupler),
    }
    design = balance(chain, "force", bodies=list(wanted), material=None, region=Ball(reach))
    assert design.added_mass == pytest.approx(sum(map(abs, wanted.values())) / reach, rel=1e-7)
    for change in design.added:
        place = complex(change.place[0], change.place[1])
        assert abs(change.mass * place - wanted[change.body]) < 1e-7


def test_force_balance_of_the_slider_crank_carries_the_slider_on_the_rod_and_both_on_the_crank() -> None:
    """The textbook pair of counterweights: behind the wrist pin on the rod, behind the pivot on the crank."""
    assert balance_conditions(mechanisms.slider_crank(), "force").equations == (
        "mcx(crank) + 0.3 m(rod) + 0.3 m(slider) = 0",
        "mcy(crank) = 0",
        "mcx(rod) + 0.8 m(slider) = 0",
        "mcy(rod) = 0",
    )


def test_an_open_arm_is_balanced_link_by_link_and_never_in_its_moment() -> None:
    """mc2 = 0 and mc1 + l1 m2 = 0; the moment would need links without inertia."""
    arm = serial(2)
    assert balance_conditions(arm, "force").equations[:2] == ("mcx(j0) + 0.5 m(j1) = 0", "mcy(j0) = 0")
    design = balance(arm, "force", region=Ball(0.3))
    pi = design.parameters
    np.testing.assert_allclose(pi[0, 1:3] + [0.5 * pi[1, 0], 0.0], 0.0, atol=1e-14)
    np.testing.assert_allclose(pi[1, 1:3], 0.0, atol=1e-14)
    whole = balance(arm, "dynamic", region=Ball(0.3))
    assert not whole.feasible and any("Izz(j1)" in c for c in whole.certificate.conflict)


def test_a_link_without_a_path_of_hinges_to_the_ground_cannot_be_balanced() -> None:
    """Tepper and Lowen 1972: a trammel reaches the ground through slides only; its condition is that it has no mass."""
    chain = trammel()
    assert "m(along_x) + m(bar) + m(along_y) = 0" in balance_conditions(chain, "force").equations
    design = balance(chain, "force", mode="redesign", region=Ball(5.0))
    assert not design.feasible


@pytest.mark.parametrize(
    ("lengths", "possible"),
    [
        ((0.1, 0.3, 0.1, 0.3), True),  # antiparallelogram
        ((0.2, 0.2, 0.5, 0.5), True),  # kites
        ((0.5, 0.2, 0.2, 0.5), True),
        ((0.4, 1.1, 0.9, 1.0), False),
        ((0.3, 0.5, 0.4, 0.3), False),
        ((0.2, 0.6, 0.6, 0.3), False),
    ],
)
def test_only_antiparallelograms_and_kites_are_reactionless(lengths: tuple[float, ...], possible: bool) -> None:
    """Ricard and Gosselin 2000; Moore, Schicho and Gosselin 2009: without counter-rotations no other four-bar is."""
    chain = mechanisms.four_bar(lengths)
    design = balance(chain, "dynamic", mode="redesign", region=Ball(5.0), masses=(0.1, 100.0))
    assert design.feasible == possible
    if not possible:
        assert design.certificate is not None
        return
    assert design.residual < 1e-13
    near = design.branch if design.branch is not None else random_samples(chain, 10).q[0]
    t = np.zeros(1)
    state = fb.Motion(t, near[None, :1], np.array([[5.0]]), np.array([[-20.0]]))
    path = fb.drive(chain, state, near=near)
    before, after = (fb.inverse_dynamics(c.with_gravity((0.0, 0.0, 0.0)), path) for c in (chain, design.chain))
    for name in ("shaking_force", "shaking_moment"):  # in the plane: the bodies lie at different heights
        part = slice(0, 2) if name == "shaking_force" else slice(2, 3)
        assert np.abs(getattr(after, name)[:, part]).max() <= 1e-11 * np.abs(getattr(before, name)[:, part]).max()


def test_a_chain_without_motors_is_refused() -> None:
    with pytest.raises(fb.errors.InvalidInputError, match="nothing moves"):
        balance_conditions(fb.ClosedChain(pin.Model(), (), ()), "force")
