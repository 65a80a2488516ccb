"""External wrenches are checked once and moved once: every road that takes them agrees, and refuses alike."""

from __future__ import annotations

import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin.dynamics.wrenches import checked_wrenches, moved_to_origin
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.mechanism.loops import loops_of

CHAIN = mechanisms.five_bar(base=mechanisms.TILTED)
Q = fb.diagnose(CHAIN).q
T = np.linspace(0.0, 1.0, 12)
X = np.array([Q[CHAIN.columns(joint)[0]][0] for joint in CHAIN.actuated])
PATH = fb.drive(CHAIN, fb.Motion(T, X + 0.1 * T[:, None], np.full((12, 2), 0.1), np.zeros((12, 2))), near=Q)
FORCES = {"tip_left": np.array([3.0, -2.0, 1.0, 0.3, 0.5, -0.7]), "universe": np.arange(6.0), "right": np.arange(6.0)}
ROADS = {
    "inverse dynamics": lambda forces: fb.inverse_dynamics(CHAIN, PATH, external=forces),
    "forward dynamics": lambda forces: fb.forward_dynamics(CHAIN, PATH.q, PATH.v, external=forces),
    "energy balance": lambda forces: fb.energy_balance(CHAIN, PATH, external=forces),
}


def test_torques_are_those_of_pinocchios_frame_jacobians():
    model, tree = CHAIN.model, loops_of(CHAIN).tree
    poses = tree.poses(PATH.q)
    acting = moved_to_origin(CHAIN, poses, checked_wrenches(CHAIN, FORCES, 12))
    torques = acting.torques(tree, poses)
    for k, (name, force) in enumerate(FORCES.items()):
        for i in range(12):
            data = model.createData()
            J = pin.computeFrameJacobian(model, data, PATH.q[i], model.getFrameId(name), pin.LOCAL_WORLD_ALIGNED)
            np.testing.assert_allclose(torques[k, i], J.T @ force, atol=1e-13)


def test_bodies_and_ground_together_carry_the_total():
    poses = loops_of(CHAIN).tree.poses(PATH.q)
    acting = moved_to_origin(CHAIN, poses, checked_wrenches(CHAIN, FORCES, 12))
    on_bodies = acting.on_bodies(CHAIN.model.njoints - 1)
    np.testing.assert_allclose(on_bodies.sum(axis=1) + acting.on_ground, acting.total, atol=1e-14)
    np.testing.assert_array_equal(acting.on_ground, np.broadcast_to(FORCES["universe"], (12, 6)))
    assert (np.abs(on_bodies).max(axis=(0, 2)) > 0.0).tolist() == [False, True, True, False]


def test_forward_dynamics_undoes_inverse_dynamics_with_them():
    torque = fb.inverse_dynamics(CHAIN, PATH, external=FORCES).torque
    a = fb.forward_dynamics(CHAIN, PATH.q, PATH.v, torque, external=FORCES)
    np.testing.assert_allclose(a, PATH.a, atol=1e-11)
    assert np.abs(fb.forward_dynamics(CHAIN, PATH.q, PATH.v, torque) - PATH.a).max() > 1e-2


def test_their_power_is_in_the_energy_balance():
    loads = fb.inverse_dynamics(CHAIN, PATH, external=FORCES)
    assert loads.power_residual() < 1e-12
    assert loads.momentum_residual() < 1e-12
    assert fb.energy_balance(CHAIN, PATH, torque=loads.torque, external=FORCES).residual() < 1e-12
    assert fb.energy_balance(CHAIN, PATH, torque=loads.torque).residual() > 1e-3


@pytest.mark.parametrize("road", ROADS.values(), ids=ROADS.keys())
def test_every_road_refuses_the_same(road):
    with pytest.raises(UnknownNameError, match=r"frame of an external force.*tip_left"):
        road({"tip_lefd": np.zeros(6)})
    with pytest.raises(InvalidInputError, match=r"shape of external\['tip_left'\]"):
        road({"tip_left": np.zeros(3)})
    with pytest.raises(InvalidInputError, match=r"shape of external\['tip_left'\]"):
        road({"tip_left": np.zeros((3, 6))})
    with pytest.raises(InvalidInputError, match=r"external\['tip_left'\]\[2\] = nan but must be finite"):
        road({"tip_left": np.r_[0.0, 0.0, np.nan, np.zeros(3)]})


def test_a_simulation_refuses_an_unknown_frame_too():
    with pytest.raises(UnknownNameError, match="frame of an external force"):
        fb.simulate(CHAIN, PATH.q[0], PATH.v[0], t=[0.0, 0.1], external={"tip_lefd": np.zeros(6)})
