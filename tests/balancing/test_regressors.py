"""Every regressor times the present parameters is the directly computed quantity."""

from __future__ import annotations

from functools import cache

import mechanisms
import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin import motion as laws
from fivebar_pin.balancing.regressors import QUANTITIES, regressor
from fivebar_pin.dynamics import inverse_dynamics

ABOUT = (0.03, -0.02, 0.05)


def sprung(chain: fb.ClosedChain) -> tuple[fb.Spring | fb.JointSpring, ...]:
    """A spring from the ground and one between the first and the last body, dampers, and one on every joint."""
    first, last = (f"{chain.joints[k]}_body" for k in (0, -1))
    between = (fb.Spring("universe", last, 20.0, 0.1, 1.0), fb.Spring(first, last, 10.0, 0.0))
    return (*between, *(fb.JointSpring(j, 2.0, 0.3, 0.1) for j in chain.joints))


@cache
def driven(name: str) -> tuple[fb.ClosedChain, fb.Trajectory]:
    """A test mechanism with armature, damping and dry friction, in motion."""
    made = {
        "five_bar": lambda: (mechanisms.five_bar(), None),
        "four_bar": lambda: (mechanisms.four_bar(), None),
        "welded_four_bar": lambda: (mechanisms.welded_four_bar(), None),
        "slider_crank": lambda: (mechanisms.slider_crank(), None),
        "rssr": lambda: (mechanisms.rssr(), np.array([0.3, 0.2, 0.4, 0.5])),
        "rscr": mechanisms.rscr,
        "bennett": mechanisms.bennett,
        "double_four_bar": lambda: (mechanisms.double_four_bar(), np.array([1.2, -1.2, 1.2, -1.2, 1.2])),
    }[name]()
    chain, near = made
    model = chain.model.copy()
    k = np.arange(1.0, chain.nv + 1.0)
    model.armature[:], model.damping[:], model.upperDryFrictionLimit[:] = 0.01 * k, 0.1 * k, 0.2 * k
    model.gravity.linear = np.array([3.0, -8.0, 4.0])
    chain = fb.ClosedChain(model, chain.closures, chain.actuated)
    if name in ("slider_crank", "rssr", "double_four_bar"):
        chain = chain.with_springs(sprung(chain))
    t = np.linspace(0.0, 1.0, 11)
    start = {"rssr": 0.3, "rscr": 0.4, "bennett": 1.1, "double_four_bar": 1.2}.get(name, 1.0)
    size = 0.01 if name == "rscr" else 0.1
    swing = [laws.harmonic(t, start - size, size, period=0.9 + 0.2 * j) for j in range(chain.na)]
    return chain, fb.drive(chain, laws.combine(*swing), near=near)


def direct(chain: fb.ClosedChain, trajectory: fb.Trajectory) -> dict[str, np.ndarray]:
    """All quantities by the other road."""
    loads = inverse_dynamics(chain, trajectory, about=ABOUT)
    momentum = loads.reactions.bodies.momentum.sum(axis=1)
    still = np.zeros_like(trajectory.v)
    at_rest = fb.Trajectory(trajectory.t, trajectory.q, still, still, trajectory.N, trajectory.closure_residual)
    n = len(trajectory)
    return {
        "linear_momentum": momentum[:, :3],
        "angular_momentum": momentum[:, 3:] - np.cross(ABOUT, momentum[:, :3]),
        "shaking_force": loads.shaking_force,
        "shaking_moment": loads.shaking_moment,
        "frame_force": loads.frame_force,
        "frame_moment": loads.frame_moment,
        "torque": loads.torque,
        "gravity_torque": inverse_dynamics(chain.with_springs(()), at_rest).torque,
        "potential_energy": loads.potential_energy[:, None],
        "kinetic_energy": loads.kinetic_energy[:, None],
        "joint_reactions": loads.joint_reactions.reshape(n, -1),
        "closure_reactions": loads.closure_reactions.reshape(n, -1),
    }


@pytest.mark.parametrize("quantity", QUANTITIES)
@pytest.mark.parametrize(
    "name", ["five_bar", "four_bar", "welded_four_bar", "slider_crank", "rssr", "rscr", "bennett", "double_four_bar"]
)
def test_regressor_times_parameters_is_the_direct_computation(name: str, quantity: str) -> None:
    """Y(q, v, a) pi + offset against Pinocchio and Newton-Euler, 1e-12 of the largest value."""
    chain, trajectory = driven(name)
    found = regressor(chain, trajectory, quantity, about=ABOUT)(chain.inertial_parameters)
    wanted = direct(chain, trajectory)[quantity]
    assert found.shape == wanted.shape
    np.testing.assert_array_equal(np.isnan(found), np.isnan(wanted))
    if name == "bennett" and quantity == "closure_reactions":
        assert np.isnan(wanted).all()  # an overconstrained hinge: nothing of it is determinate
        return
    scale = np.nanmax(np.abs(wanted))
    assert scale > 0.0
    assert np.nanmax(np.abs(found - wanted)) <= 1e-12 * scale


def test_regressor_holds_for_other_parameters_than_the_chain_has() -> None:
    """The matrix does not depend on the parameters: another chain's loads come out of the first chain's regressor."""
    chain, trajectory = driven("five_bar")
    other = chain.with_inertias({j: mechanisms.body(11 + k) for k, j in enumerate(chain.joints)})
    found = regressor(chain, trajectory, "torque")(np.stack([chain.inertial_parameters, other.inertial_parameters]))
    wanted = inverse_dynamics(other, trajectory).torque
    np.testing.assert_allclose(found[1], wanted, rtol=0, atol=1e-12 * np.abs(wanted).max())


def test_unknown_quantity_lists_the_known() -> None:
    chain, trajectory = driven("four_bar")
    with pytest.raises(fb.errors.UnknownNameError, match="shaking_force"):
        regressor(chain, trajectory, "shakingforce")


def test_parameters_of_the_wrong_shape_are_refused() -> None:
    chain, trajectory = driven("four_bar")
    with pytest.raises(fb.errors.InvalidInputError, match="shape of parameters"):
        regressor(chain, trajectory, "torque")(np.zeros((2, 10)))


@pytest.mark.parametrize("name", ["five_bar", "rssr"])
def test_shaking_rows_know_no_gravity_and_frame_rows_no_more_than_the_weight(name: str) -> None:
    chain, trajectory = driven(name)
    light = chain.with_gravity((0.0, 0.0, 0.0))
    for part in ("force", "moment"):
        shaking = regressor(chain, trajectory, f"shaking_{part}", about=ABOUT).matrix
        np.testing.assert_array_equal(shaking, regressor(light, trajectory, f"shaking_{part}", about=ABOUT).matrix)
        np.testing.assert_array_equal(shaking, regressor(light, trajectory, f"frame_{part}", about=ABOUT).matrix)
    weight = chain.mass * chain.model.gravity.linear
    frame, shaking = (
        regressor(chain, trajectory, f"{x}_force")(chain.inertial_parameters) for x in ("frame", "shaking")
    )
    np.testing.assert_allclose(frame - shaking, np.tile(weight, (len(frame), 1)), rtol=0, atol=1e-12)
