"""Slides: on the ground, on bars, carried and carrying, and cut."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import fivebar_pin as fb
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.planar import Linkage


def place(chain: fb.ClosedChain, frame: str, q: np.ndarray) -> np.ndarray:
    data = chain.model.createData()
    pin.framesForwardKinematics(chain.model, data, q)
    return np.array(data.oMf[chain.model.getFrameId(frame)].translation)[:2]


def angle(chain: fb.ClosedChain, frame: str, q: np.ndarray) -> float:
    data = chain.model.createData()
    pin.framesForwardKinematics(chain.model, data, q)
    R = data.oMf[chain.model.getFrameId(frame)].rotation
    return float(np.arctan2(R[1, 0], R[0, 0]))


def drive(chain: fb.ClosedChain, by: float = 0.5) -> fb.Trajectory:
    """Return the motion of all motors by the same angle from home, there and back."""
    t = np.linspace(0.0, 1.0, 21)
    home = chain.references["home"]
    at = home[chain.actuated_index]
    x, v, a = np.sin(np.pi * t) ** 2, np.pi * np.sin(2 * np.pi * t), 2 * np.pi**2 * np.cos(2 * np.pi * t)
    way = by * np.ones(at.size)
    return fb.drive(chain, fb.Motion(t, at + np.outer(x, way), np.outer(v, way), np.outer(a, way)), near=home)


def test_a_slider_crank_is_the_formula() -> None:
    made = Linkage("slider_crank")
    made.ground(A=(0, 0))
    made.points(C=(0.05, 0.087), B=(0.34, 0.02))
    made.bar("crank", "A", "C", length=0.1)
    made.bar("rod", "C", "B", length=0.3)
    made.slide("slider", "B", through=(0.7, 0.02), mass=0.2)
    made.motor("crank", at="A")
    chain = made.chain()
    assert chain.parameters["slider_offset"] == pytest.approx(0.02, abs=1e-16)
    trajectory = drive(chain)
    k = chain.model.idx_qs[chain.model.getJointId("crank")]
    phi = trajectory.q[:, k]
    x = 0.1 * np.cos(phi) + np.sqrt(0.3**2 - (0.02 - 0.1 * np.sin(phi)) ** 2)
    for q, expected in zip(trajectory.q, x, strict=True):
        np.testing.assert_allclose(place(chain, "slider_B", q), [expected, 0.02], rtol=0.0, atol=1e-14)
    moved = chain.with_parameters(slider_offset=-0.01, slider_angle=0.3)
    q = fb.assemble(moved, [0.4], near=moved.references["home"])
    line = np.array([np.cos(0.3), np.sin(0.3)])
    assert place(moved, "slider_B", q) @ [-line[1], line[0]] == pytest.approx(-0.01, abs=1e-14)


def inverted(*, on_bar: bool) -> Linkage:
    """Return an inverted slider-crank (quick return): a block on the crank's end slides along a rocker, or the rocker
    is said to slide on the block."""
    made = Linkage("quick_return")
    made.ground(A=(0, 0), B=(0, -0.2))
    made.points(C=(0.05, 0.087), T=(0.2, 0.6))
    made.bar("crank", "A", "C")
    direction = float(np.angle(complex(0.05, 0.087) - complex(0, -0.2)))
    if on_bar:
        made.bar("rocker", "B", "T", density=0.0)
        made.slide("block", "C", on="rocker", angle=direction)
    else:
        made.bar("block", "C")
        made.slide("rocker", "B", on="block", angle=direction, through=(0.05, 0.087))
    made.mass("rocker", at="B", mass=0.5, inertia=0.01)
    made.mass("block", at="C", mass=0.1)
    made.motor("crank", at="A")
    return made


def test_a_block_on_a_rocker_and_a_rocker_on_a_block_are_the_same_machine() -> None:
    one, two = (inverted(on_bar=x).chain() for x in (True, False))
    first, second = drive(one), drive(two)
    loads = [fb.inverse_dynamics(c, t) for c, t in ((one, first), (two, second))]
    for word in ("torque", "shaking_force", "shaking_moment", "frame_force", "com"):
        np.testing.assert_allclose(getattr(loads[0], word), getattr(loads[1], word), rtol=0.0, atol=1e-12)
    assert np.abs(loads[0].torque).max() > 0.05
    for q in second.q:
        ray = complex(*place(two, "block_C", q)) - complex(0, -0.2)
        assert angle(two, "rocker_B", q) == pytest.approx(np.angle(ray), abs=1e-13)


def test_a_bar_may_hang_on_the_block_that_slides_along_it() -> None:
    """The tree reaches the rod through its block; the rod's points lie where the sketch has them all the same."""
    made = Linkage("reversed")
    made.ground(A=(0, 0), B=(0.5, 0))
    made.points(C=(0.1, 0.2), D=(0.45, 0.3), T=(0.0, 0.2))
    made.bar("crank", "A", "C")
    made.bar("rod", "D", "T")
    made.slide("collar", "C", on="rod", angle=0.1, through=(0.1, 0.2))
    made.bar("arm", "B", "D")
    made.motor("crank", at="A")
    made.motor("arm", at="B")
    chain = made.chain()
    assert chain.model.names[chain.model.parents[chain.model.getJointId("rod")]] == "collar"
    home = chain.references["home"]
    for frame, point in (("rod_D", (0.45, 0.3)), ("rod_T", (0.0, 0.2)), ("collar_C", (0.1, 0.2))):
        np.testing.assert_allclose(place(chain, frame, home), point, rtol=0.0, atol=1e-15)
    start = angle(chain, "rod_D", home) - angle(chain, "collar_C", home)
    for q in drive(chain, by=0.3).q:
        turned = angle(chain, "rod_D", q) - angle(chain, "collar_C", q)
        assert np.exp(1j * turned) == pytest.approx(np.exp(1j * start), abs=1e-13)


def ring() -> Linkage:
    made = Linkage("ring")
    made.ground(A=(0, 0))
    made.points(P=(0.1, 0.0), Q=(0.1, 0.1), R=(0.0, 0.1))
    made.slide("a", "P", "A", on="c", angle=0.3)
    made.slide("b", "Q", on="a", angle=1.3)
    made.slide("c", "R", on="b", angle=2.3)
    for name, point in (("a", "P"), ("b", "Q"), ("c", "R")):
        made.mass(name, at=point, mass=1.0, inertia=0.01)
    made.motor("a", at="A")
    made.motor("b")
    return made


def test_a_ring_of_slides_is_closed_by_a_weld_on_a_block() -> None:
    """Three bodies that slide on each other in a ring: the last slide is cut; two freedoms, turn and shape."""
    chain = ring().chain()
    assert [c.kind.value for c in chain.closures] == ["6d"]
    found = fb.diagnose(chain, chain.references["home"])
    assert found.mobility == 2 and found.gap < 1e-14
    trajectory = drive(chain, by=0.05)
    loads = fb.inverse_dynamics(chain, trajectory)
    assert np.abs(loads.power_residual()).max() < 1e-10


def test_the_name_of_the_block_is_taken() -> None:
    made = ring()
    made.bar(f"{made.chain().closures[0].name}_block", "A")
    with pytest.raises(InvalidInputError, match="is needed for a sliding block"):
        made.chain()


def test_a_driven_slide_is_a_motor_of_the_tree() -> None:
    made = Linkage("jack")
    made.ground(A=(0, 0), B=(0.4, 0))
    made.points(P=(0.2, 0.2))
    made.bar("cylinder", "A")
    made.bar("arm", "B", "P")
    made.slide("rod", "P", on="cylinder", angle=np.pi / 4.0, through=(0, 0))
    made.motor("rod")
    chain = made.chain()
    assert chain.actuated == ("rod",)
    assert chain.references["home"][chain.actuated_index[0]] == pytest.approx(np.hypot(0.2, 0.2), abs=1e-15)
    q = fb.assemble(chain, [0.3], near=chain.references["home"])
    assert np.linalg.norm(place(chain, "arm_P", q)) == pytest.approx(0.3, abs=1e-13)


def test_a_motor_of_a_bar_that_does_not_slide_needs_its_point() -> None:
    made = inverted(on_bar=True)
    made.motor("crank")
    with pytest.raises(InvalidInputError, match="needs the point where it turns"):
        made.chain()
