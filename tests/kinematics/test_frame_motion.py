"""The motion of any frame: Pinocchio's, and the derivative of where it is."""

from __future__ import annotations

import mechanisms
import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin.errors import InvalidInputError, UnknownNameError

PARTS = ("velocity", "angular_velocity", "acceleration", "angular_acceleration")


def driven(chain: fb.ClosedChain, near: np.ndarray, t: np.ndarray) -> fb.Trajectory:
    x = np.array([near[chain.columns(joint)[0]][0] for joint in chain.actuated])
    swing = np.ones((1, chain.na)) * 0.2
    s, c = np.sin(2.0 * t)[:, None], np.cos(2.0 * t)[:, None]
    return fb.drive(chain, fb.Motion(t, x + swing * s, 2.0 * swing * c, -4.0 * swing * s), near=near)


def cases() -> dict[str, tuple[fb.ClosedChain, np.ndarray]]:
    chains = {"five-bar": mechanisms.five_bar(base=mechanisms.TILTED), "spatial four-bar": mechanisms.rssr()}
    found = {name: (chain, fb.diagnose(chain).q) for name, chain in chains.items()}
    found["ball and slide"] = mechanisms.rscr()
    delta = fb.load(fb.io.shipped_path("delta"))
    return {**found, "delta": (delta, fb.diagnose(delta).q)}


CASES = cases()


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("n", [3, 20], ids=["few", "batch"])
def test_every_frame_moves_as_pinocchio_says(name, n):
    chain, q = CASES[name]
    path, model = driven(chain, q, np.linspace(0.0, 1.0, n)), chain.model
    data = model.createData()
    for k, frame in enumerate(model.frames):
        if model.getFrameId(frame.name) != k:
            continue  # another frame of this name comes first
        moved = fb.frame_motion(chain, path, frame.name)
        for i in range(n):
            pin.forwardKinematics(model, data, path.q[i], path.v[i], path.a[i])
            pose = pin.updateFramePlacement(model, data, k)
            V = pin.getFrameVelocity(model, data, k, pin.LOCAL_WORLD_ALIGNED)
            A = pin.getFrameClassicalAcceleration(model, data, k, pin.LOCAL_WORLD_ALIGNED)
            np.testing.assert_allclose(moved.position[i], pose.translation, atol=1e-14)
            np.testing.assert_allclose(moved.rotation[i], pose.rotation, atol=1e-14)
            for part, value in zip(PARTS, (V.linear, V.angular, A.linear, A.angular), strict=True):
                np.testing.assert_allclose(getattr(moved, part)[i], value, atol=1e-12, err_msg=f"{frame.name} {part}")


@pytest.mark.parametrize("name", CASES)
def test_rates_are_the_derivatives_of_the_pose(name):
    chain, q = CASES[name]
    h = 1e-3
    path = driven(chain, q, 0.3 + h * np.arange(-2, 3))
    slope = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12.0 * h)  # of fourth order
    tip = chain.closures[0].frames[1]
    moved = fb.frame_motion(chain, path, tip)
    np.testing.assert_allclose(slope @ moved.position, moved.velocity[2], atol=1e-9)
    np.testing.assert_allclose(slope @ moved.velocity, moved.acceleration[2], atol=1e-9)
    np.testing.assert_allclose(slope @ moved.angular_velocity, moved.angular_acceleration[2], atol=1e-9)
    spin = np.einsum("k,kij->ij", slope, moved.rotation) @ moved.rotation[2].T
    np.testing.assert_allclose(spin, pin.skew(moved.angular_velocity[2]), atol=1e-9)
    assert np.abs(moved.acceleration).max() > 1e-2


def test_both_frames_of_a_point_closure_move_alike():
    chain, q = CASES["five-bar"]
    path = driven(chain, q, np.linspace(0.0, 1.0, 30))
    one, other = (fb.frame_motion(chain, path, frame) for frame in chain.closures[0].frames)
    for part in ("position", "velocity", "acceleration"):
        np.testing.assert_allclose(getattr(one, part), getattr(other, part), atol=1e-13)


def test_the_ground_stands_still():
    chain, q = CASES["five-bar"]
    moved = fb.frame_motion(chain, driven(chain, q, np.linspace(0.0, 1.0, 9)), "universe")
    np.testing.assert_array_equal(moved.position, np.zeros((9, 3)))
    assert not any(getattr(moved, part).any() for part in PARTS)


def test_a_frame_that_does_not_exist_and_a_strange_trajectory_are_refused():
    chain, q = CASES["five-bar"]
    path = driven(chain, q, np.linspace(0.0, 1.0, 3))
    with pytest.raises(UnknownNameError, match="tip_left"):
        fb.frame_motion(chain, path, "tip_lef")
    with pytest.raises(InvalidInputError, match="must belong to this chain"):
        fb.frame_motion(mechanisms.four_bar(), path, "crank")
