"""Mass matrix and bias in the actuated coordinates are the mechanism: torques, energy and accelerations agree."""

from __future__ import annotations

import mechanisms
import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin.errors import InvalidInputError, SingularityError, UnknownNameError


def with_losses(chain: fb.ClosedChain) -> fb.ClosedChain:
    """Return the chain with rotors, damping and dry friction in every joint, under slanted gravity."""
    model, rng = chain.model.copy(), np.random.default_rng(3)
    model.armature[:] = rng.uniform(0.01, 0.05, model.nv)
    model.damping[:] = rng.uniform(0.01, 0.5, model.nv)
    model.upperDryFrictionLimit[:] = rng.uniform(0.01, 0.3, model.nv)
    model.lowerDryFrictionLimit[:] = -model.upperDryFrictionLimit
    model.gravity.linear = np.array([1.0, -9.0, 2.0])
    return fb.ClosedChain(model, chain.closures, chain.actuated)


CHAINS = {
    "four-bar": mechanisms.four_bar(),
    "five-bar": mechanisms.five_bar(base=mechanisms.TILTED),
    "slider-crank": mechanisms.slider_crank(),
    "spatial four-bar": mechanisms.rssr(),
    "ball and slide": mechanisms.rscr()[0],
    "overconstrained": mechanisms.spherical_four_bar((0.5, 1.1, 0.9, 1.2)),
    "six-bar": fb.load(fb.io.shipped_path("six_bar_watt")),
    "delta": fb.load(fb.io.shipped_path("delta")),
}


def moving(chain: fb.ClosedChain, seed: int = 0) -> fb.Trajectory:
    """Return a motion with unrelated rates at every sample, near a regular configuration."""
    rng, q0 = np.random.default_rng(seed), fb.diagnose(chain).q
    x = np.array([q0[chain.columns(joint)[0]][0] for joint in chain.actuated])
    t = np.linspace(0.0, 1.0, 25)
    away = 0.05 * np.sin(2.0 * t)[:, None] * rng.uniform(0.2, 1.0, chain.na)
    return fb.drive(chain, fb.Motion(t, x + away, *rng.normal(size=(2, 25, chain.na))), near=q0)


@pytest.mark.parametrize("chain", CHAINS.values(), ids=CHAINS.keys())
def test_torque_is_mass_times_acceleration_plus_bias(chain):
    chain = with_losses(chain)
    path, k = moving(chain), chain.actuated_index
    M, bias = fb.reduced_dynamics(chain, path.q, path.v[:, k])
    torque = fb.inverse_dynamics(chain, path).torque
    inertial = np.einsum("nab,nb->na", M, path.a[:, k])
    scale = np.abs(inertial).max() + np.abs(bias).max()
    assert np.abs(inertial + bias - torque).max() <= 1e-12 * scale
    assert np.abs(inertial).max() > 1e-3 * scale  # both parts were put to the test
    assert np.abs(bias).max() > 1e-3 * scale


@pytest.mark.parametrize("chain", CHAINS.values(), ids=CHAINS.keys())
def test_the_mass_matrix_is_positive_and_gives_the_kinetic_energy(chain):
    chain = with_losses(chain)
    path, k = moving(chain, 1), chain.actuated_index
    M, _ = fb.reduced_dynamics(chain, path.q, path.v[:, k])
    np.testing.assert_array_equal(M, np.swapaxes(M, 1, 2))
    assert np.linalg.eigvalsh(M).min() > 0.0
    loads = fb.inverse_dynamics(chain, path)
    energy = 0.5 * np.einsum("na,nab,nb->n", path.v[:, k], M, path.v[:, k])
    np.testing.assert_allclose(energy, loads.kinetic_energy + loads.rotor_energy, rtol=1e-12)


@pytest.mark.parametrize("name", ["four-bar", "five-bar", "spatial four-bar", "six-bar"])
def test_accelerations_are_those_of_forward_dynamics(name):
    chain = with_losses(CHAINS[name])
    path, k = moving(chain, 2), chain.actuated_index
    tau = np.random.default_rng(5).normal(size=(len(path), chain.na))
    M, bias = fb.reduced_dynamics(chain, path.q, path.v[:, k])
    a = np.linalg.solve(M, (tau - bias)[..., None])[..., 0]
    np.testing.assert_allclose(a, fb.forward_dynamics(chain, path.q, path.v, tau)[:, k], rtol=1e-9, atol=1e-9)


def test_one_state_is_the_batch_without_its_axis():
    chain = with_losses(CHAINS["five-bar"])
    path, k = moving(chain), chain.actuated_index
    M, bias = fb.reduced_dynamics(chain, path.q[3], path.v[3, k])
    assert (M.shape, bias.shape) == ((2, 2), (2,))
    several = fb.reduced_dynamics(chain, path.q[:5], path.v[:5, k])
    np.testing.assert_allclose(M, several[0][3], rtol=1e-13)
    np.testing.assert_allclose(bias, several[1][3], rtol=1e-12)


def test_no_states_give_nothing():
    chain = CHAINS["five-bar"]
    M, bias = fb.reduced_dynamics(chain, np.zeros((0, chain.nq)), np.zeros((0, 2)))
    assert (M.shape, bias.shape) == ((0, 2, 2), (0, 2))


def test_what_cannot_be_asked_is_refused():
    chain = CHAINS["four-bar"]
    q = fb.assembly_modes(chain, [0.8])[0]
    with pytest.raises(InvalidInputError, match=r"closure pin at state 0 = .* Use assemble"):
        fb.reduced_dynamics(chain, q + 0.1, [1.0])
    with pytest.raises(InvalidInputError, match="shape of v_actuated"):
        fb.reduced_dynamics(chain, q, [1.0, 2.0])
    flat = mechanisms.parallelogram()
    with pytest.raises(SingularityError, match="configuration 0 is at a type 2 singularity"):
        fb.reduced_dynamics(flat, np.zeros(3), [1.0])
    with pytest.raises(InvalidInputError, match="undetermined"):
        fb.reduced_dynamics(chain.with_actuated(()), q, np.zeros(0))


def test_torques_are_found_by_the_name_of_their_joint():
    chain = CHAINS["five-bar"]
    loads = fb.inverse_dynamics(chain, moving(chain))
    np.testing.assert_array_equal(loads.torque_of("right"), loads.torque[:, 1])
    np.testing.assert_array_equal(loads.torque_of("left"), loads.torque[:, 0])
    with pytest.raises(UnknownNameError, match=r"left_elbow.*left, right"):
        loads.torque_of("left_elbow")


def test_columns_are_found_by_the_name_of_their_joint():
    chain, q = mechanisms.rscr()
    where = {name: chain.columns(name) for name in chain.joints}
    assert where["crank"] == (slice(0, 1), slice(0, 1))
    assert where["ball"] == (slice(1, 5), slice(1, 4))
    assert where["slide"] == (slice(6, 7), slice(5, 6))
    assert q[where["slide"][0]] == [0.15]
    with pytest.raises(UnknownNameError, match="elbow"):
        chain.columns("elbow")
    with pytest.raises(UnknownNameError):
        chain.columns("universe")
