"""The equations of motion of the motors, compiled, are those of all coordinates, and stand back where they are not."""

from __future__ import annotations

import numpy as np
import pytest
from moving_chains import NAMES, loaded, moving, pushed

import fivebar_pin as fb
from fivebar_pin.dynamics import forward, reduced
from fivebar_pin.dynamics.motor_equations import motor_equations


@pytest.mark.parametrize("name", NAMES)
def test_accelerations_of_the_motors_and_of_the_tangent_space_are_the_same(name):
    """Forward dynamics by either is the inverse of inverse dynamics, with everything that can act."""
    bare, path = moving(name)
    chain = loaded(bare)
    loads = fb.inverse_dynamics(chain, path, external=pushed(chain))
    given = chain, path.q, path.v, loads.torque, loads.external
    by_motors, general = forward._by_motors(*given), forward._by_tangent_space(*given)
    assert (by_motors is None) == (name == "Bennett")
    size = np.abs(path.a).max()
    np.testing.assert_allclose(general, path.a, rtol=0, atol=1e-11 * size)
    if by_motors is not None:
        np.testing.assert_allclose(by_motors, path.a, rtol=0, atol=1e-12 * size)


@pytest.mark.parametrize("name", NAMES)
def test_reduced_equations_by_the_motors_are_those_of_all_coordinates(name):
    bare, path = moving(name, 4)
    chain = loaded(bare)
    va = path.v[:, chain.actuated_index]
    M, bias = fb.reduced_dynamics(chain, path.q, va)
    M_all, bias_all = reduced._by_all_coordinates(chain, path.q, va)
    np.testing.assert_allclose(M, M_all, rtol=0, atol=1e-12 * np.abs(M_all).max())
    np.testing.assert_allclose(bias, bias_all, rtol=0, atol=1e-11 * np.abs(bias_all).max())
    np.testing.assert_array_equal(M, np.swapaxes(M, 1, 2))


def test_states_near_a_bound_are_looked_at_more_closely():
    """A configuration open by half the bound, a velocity that opens the loops by half of it: no equations at once."""
    chain, path = moving("five_bar_case_I", 3)
    q, v = np.array(path.q), np.array(path.v)
    for there, expected in ((q, True), (q + np.r_[0.0, 5e-9 / chain.length, 0.0, 0.0], False)):
        found = motor_equations(chain, there, v, {}, forward.CLOSED)
        assert (found is not None) == expected
    faster = v * (1.0 + np.r_[0.0, 5e-9, 0.0, 0.0])
    assert motor_equations(chain, q, faster, {}, forward.CLOSED) is None
    assert motor_equations(chain, q, faster, {}, forward.CLOSED, driven=True) is not None
