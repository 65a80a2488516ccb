"""Overconstrained mechanisms whose dimensions are rounded: at a stated closure tolerance they are what they were."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin
import pytest
from mechanisms import bennett, spherical_four_bar

import fivebar_pin as fb
from fivebar_pin.cli._moving import standing, sway
from fivebar_pin.errors import AssemblyError, InvalidInputError

EXACT: dict[str, Callable[[], fb.ClosedChain]] = {
    "Bennett": lambda: bennett()[0],
    "spherical four-bar": lambda: spherical_four_bar((0.6, 1.4, 1.2, 1.3), kind="revolute"),
}


def rounded(chain: fb.ClosedChain, grain: float) -> fb.ClosedChain:
    """Return the chain with all placements as a CAD program would write them."""

    def written(M: pin.SE3) -> pin.SE3:
        rpy = np.round(pin.rpy.matrixToRpy(M.rotation) / grain) * grain
        return pin.SE3(pin.rpy.rpyToMatrix(rpy), np.round(M.translation / grain) * grain)

    model = chain.model.copy()
    for j in range(1, model.njoints):
        model.jointPlacements[j] = written(model.jointPlacements[j])
    for frame in model.frames:
        frame.placement = written(frame.placement)
    return fb.ClosedChain(model, chain.closures, chain.actuated)


cases = pytest.mark.parametrize("make", EXACT.values(), ids=EXACT.keys())
grains = pytest.mark.parametrize("grain", [1e-5, 1e-6, 1e-7])


@cases
@grains
def test_mobility_and_redundancy_are_those_of_the_exact_mechanism(make, grain):
    exact = fb.diagnose(make())
    d = fb.diagnose(rounded(make(), grain).with_tolerance(20.0 * grain))
    assert d.ok and d.closed, str(d)
    assert (d.mobility, d.generic_mobility, d.rank) == (exact.mobility, exact.generic_mobility, exact.rank) != (0, 0, 0)
    assert len(d.redundant) == len(exact.redundant)
    assert 0.0 < d.gap < 20.0 * grain
    chain = rounded(make(), grain).with_tolerance(20.0 * grain)
    assert np.isfinite(fb.complement(chain, d.q)).all()
    nearby = fb.diagnose(chain, d.q + 0.01 * np.arange(1.0, chain.nq + 1.0))
    assert nearby.closed and nearby.rank == d.rank
    assert np.abs(nearby.q - d.q).max() < 0.1


@cases
@grains
def test_it_is_driven_and_simulated_with_the_misfit_told(make, grain):
    """The motion is that of the exact mechanism up to the rounding; forward dynamics gives the accelerations back."""
    exact, chain = make(), rounded(make(), grain).with_tolerance(20.0 * grain)
    q0 = standing(exact)
    path, model = sway(chain, fb.assemble(chain, q0[:1], q0), samples=25), sway(exact, q0, samples=25)
    assert path is not None and model is not None
    assert 0.0 < path.worst_closure < 20.0 * grain
    np.testing.assert_allclose(path.q, model.q, rtol=0.0, atol=100.0 * grain)
    np.testing.assert_allclose(path.a, model.a, rtol=0.0, atol=1e3 * grain * np.abs(model.a).max())
    coarse = fb.Motion(path.t[::6], path.q[::6, :1], path.v[::6, :1], path.a[::6, :1])
    again = fb.drive(chain, coarse, path.q[0], limits="ignore")  # as near to closed, from however far
    np.testing.assert_allclose(again.q, path.q[::6], rtol=0.0, atol=1e-12)
    loads = fb.inverse_dynamics(chain, path)
    other = fb.inverse_dynamics(chain, path, road="complement")
    np.testing.assert_allclose(loads.torque, other.torque, rtol=0.0, atol=1e-12 * np.abs(loads.torque).max())
    a = fb.forward_dynamics(chain, path.q[7], path.v[7], loads.torque[7])
    np.testing.assert_allclose(a, path.a[7], rtol=0.0, atol=1e-9 * np.abs(path.a).max())
    free = fb.simulate(chain, path.q[0], path.v[0], None, np.linspace(0.0, 0.1, 3))
    assert free.worst_closure < 20.0 * grain


@cases
def test_without_a_tolerance_it_is_told_to_state_one(make):
    d = fb.diagnose(rounded(make(), 1e-5))
    assert not d.ok
    assert any("state how far its loops may stay open: closure_tolerance" in p.text for p in d.problems)


def test_what_nothing_closes_is_not_said_to_move():
    chain = rounded(EXACT["spherical four-bar"](), 1e-5)
    d = fb.diagnose(chain)
    assert not d.closed
    assert "mobility and actuation are those of closed loops only" in str(d)
    assert "mobility     " not in str(d)
    with pytest.raises(AssemblyError, match=r"anywhere that was looked.* state how far its loops may stay open"):
        standing(chain)


@pytest.mark.parametrize("tolerance", [-1e-9, 0.1, float("nan")])
def test_a_tolerance_is_one_of_rounding(tolerance):
    with pytest.raises(InvalidInputError, match="closure tolerance"):
        bennett()[0].with_tolerance(tolerance)
