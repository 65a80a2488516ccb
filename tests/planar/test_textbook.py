"""Linkages of the textbooks, in their own words, against what geometry and energy say of them by hand."""

from __future__ import annotations

import numpy as np
import pytest

import fivebar_pin as fb
from fivebar_pin.planar import Linkage

ROUND = 1e-13
"""Round-off of positions, torques and forces of the size of one [m, N m, N]."""
G = 9.81


def driven(chain: fb.ClosedChain, span: float, samples: int = 61) -> tuple[fb.Trajectory, fb.Loads]:
    """Drive the only motor by `span` from home."""
    home = chain.references["home"]
    start = float(home[chain.actuated_index[0]])
    t = np.linspace(0.0, 1.0, samples)
    trajectory = fb.drive(chain, fb.motion.cycloidal(t, start, start + span), near=home)
    return trajectory, fb.inverse_dynamics(chain, trajectory)


def path(chain: fb.ClosedChain, trajectory: fb.Trajectory, frame: str) -> np.ndarray:
    return fb.frame_motion(chain, trajectory, frame).position[:, :2]


def actuated(chain: fb.ClosedChain, trajectory: fb.Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    i = chain.actuated_index[0]
    return trajectory.q[:, i], trajectory.v[:, i], trajectory.a[:, i]


def meet(p: np.ndarray, at_p: float, q: np.ndarray, at_q: float, side: int) -> np.ndarray:
    """Return where circles about two points meet, left (+1) or right (-1) of the way from p to q."""
    u = (q - p) / np.linalg.norm(q - p)
    x = (at_p**2 - at_q**2 + np.sum((q - p) ** 2)) / (2.0 * np.linalg.norm(q - p))
    return p + x * u + side * np.sqrt(at_p**2 - x**2) * np.array([-u[1], u[0]])


def test_peaucelliers_point_runs_on_the_line_that_inversion_makes_of_the_cranks_circle() -> None:
    r, arm, side = 0.12, 0.4, 0.22
    P = r * np.array([1.0 + np.cos(0.5), np.sin(0.5)])
    A, B = (meet(np.zeros(2), arm, P, side, k) for k in (1, -1))
    made = Linkage("peaucellier")
    made.ground(O=(0, 0), Q=(r, 0))
    made.points(P=P, A=A, B=B, R=A + B - P)
    for name, ends in (
        ("crank", "QP"),
        ("a", "OA"),
        ("b", "OB"),
        ("ap", "AP"),
        ("pb", "PB"),
        ("ar", "AR"),
        ("br", "BR"),
    ):
        made.bar(name, *ends)
    made.motor("crank", at="Q")
    chain = made.chain()
    trajectory, _ = driven(chain, 0.4)
    R = path(chain, trajectory, "ar_R")
    np.testing.assert_allclose(R[:, 0], (arm**2 - side**2) / (2.0 * r), rtol=0.0, atol=ROUND)
    assert np.ptp(R[:, 1]) > 0.1


def jansen(theta: float) -> dict[str, np.ndarray]:
    """Return the points of Jansen's leg with his eleven lengths [m]."""
    a, b, c, d, e, f, g, h, i, j, k, drop, m = (
        np.array([38.0, 41.5, 39.3, 40.1, 55.8, 39.4, 36.7, 65.7, 49.0, 50.0, 61.9, 7.8, 15.0]) * 1e-3
    )
    B, C = np.array([-a, -drop]), m * np.array([np.cos(theta), np.sin(theta)])
    D, F = meet(C, j, B, b, -1), meet(C, k, B, c, 1)
    E = meet(D, e, B, d, -1)
    K = meet(E, f, F, g, -1)
    return {"O": np.zeros(2), "B": B, "C": C, "D": D, "E": E, "F": F, "G": K, "H": meet(K, h, F, i, -1)}


def test_jansens_foot_follows_its_circles_and_closes_its_path() -> None:
    made, points = Linkage("jansen"), jansen(0.3)
    made.ground(O=points["O"], B=points["B"])
    made.points({name: points[name] for name in "CDEFGH"})
    for name, ends in (
        ("crank", "OC"),
        ("j", "CD"),
        ("top", "BDE"),
        ("k", "CF"),
        ("c", "BF"),
        ("f", "EG"),
        ("foot", "GFH"),
    ):
        made.bar(name, *ends)
    made.motor("crank", at="O")
    chain = made.chain()
    trajectory, loads = driven(chain, 2.0 * np.pi)
    foot = path(chain, trajectory, "foot_H")
    theta = actuated(chain, trajectory)[0]
    np.testing.assert_allclose(foot, [jansen(x)["H"] for x in theta], rtol=0.0, atol=ROUND)
    np.testing.assert_allclose(foot[0], foot[-1], rtol=0.0, atol=ROUND)
    assert loads.power_residual() < ROUND and loads.momentum_residual() < ROUND


def test_a_scissor_lift_rises_by_pythagoras() -> None:
    made, stages, w, h = Linkage("lift"), 4, 0.3, 0.1
    made.points({f"{side}{k}": (x, k * h) for k in range(stages + 1) for side, x in (("A", 0.0), ("B", w))})
    made.points({f"M{k}": (0.5 * w, (k + 0.5) * h) for k in range(stages)})
    made.ground("A0")
    for k in range(stages):
        made.bar(f"up{k}", f"A{k}", f"B{k + 1}", f"M{k}")
        made.bar(f"down{k}", f"B{k}", f"A{k + 1}", f"M{k}")
    made.slide("foot", "B0", mass=0.2)
    made.motor("foot")
    chain = made.chain()
    trajectory, _ = driven(chain, -0.05)
    foot, top = path(chain, trajectory, "foot_B0"), path(chain, trajectory, f"down{stages - 1}_A{stages}")
    np.testing.assert_allclose(top[:, 1], stages * np.sqrt(w**2 + h**2 - foot[:, 0] ** 2), rtol=0.0, atol=ROUND)


def test_a_scotch_yoke_is_a_sine_and_its_torque_that_of_its_energy() -> None:
    r, yoke, block, start = 0.1, 2.0, 0.3, 0.7
    made = Linkage("scotch")
    made.ground(O=(0, 0))
    made.points(C=(r * np.cos(start), r * np.sin(start)), Y=(r * np.cos(start) + 0.2, 0))
    made.bar("crank", "O", "C", density=0.0)
    made.slide("yoke", "Y", mass=yoke)
    made.slide("block", "C", on="yoke", angle=0.5 * np.pi, mass=block)
    made.motor("crank", at="O")
    chain = made.chain()
    trajectory, loads = driven(chain, 2.0 * np.pi)
    q, v, a = actuated(chain, trajectory)
    s, c = np.sin(q), np.cos(q)
    np.testing.assert_allclose(path(chain, trajectory, "yoke_Y")[:, 0], r * c + 0.2, rtol=0.0, atol=ROUND)
    torque = r**2 * ((yoke * s**2 + block) * a + yoke * s * c * v**2) + block * G * r * c
    np.testing.assert_allclose(loads.torque[:, 0], torque, rtol=0.0, atol=ROUND)
    np.testing.assert_allclose(loads.shaking_force[:, 0], (yoke + block) * r * (c * v**2 + s * a), rtol=0.0, atol=ROUND)


def test_the_middle_of_an_oldham_coupling_goes_round_twice_as_fast() -> None:
    e, start, middle = 0.05, 0.4, 0.7
    u = np.array([np.cos(start), np.sin(start)])
    made = Linkage("oldham")
    made.ground(A=(0, 0), B=(e, 0))
    made.points(C=e * u[0] * u)
    made.bar("one", "A")
    made.mass("one", at="A", mass=1.0, inertia=1e-3)
    made.slide("middle", "C", on="one", angle=start, through=(0, 0), mass=middle)
    made.slide("other", "B", on="middle", angle=start + 0.5 * np.pi, through=e * u[0] * u)
    made.mass("other", at="B", mass=1.0, inertia=2e-3)
    made.motor("one", at="A")
    chain = made.chain()
    trajectory, loads = driven(chain, 2.0 * np.pi)
    q, _, a = actuated(chain, trajectory)
    turned = q - q[0] + start
    round_twice = 0.5 * e * np.stack([1.0 + np.cos(2.0 * turned), np.sin(2.0 * turned)], axis=1)
    np.testing.assert_allclose(path(chain, trajectory, "middle_C"), round_twice, rtol=0.0, atol=ROUND)
    torque = (3e-3 + middle * e**2) * a + middle * G * e * np.cos(2.0 * turned)
    np.testing.assert_allclose(loads.torque[:, 0], torque, rtol=0.0, atol=ROUND)


def test_springs_and_dampers_of_a_slider_crank_ask_for_the_torque_of_their_power() -> None:
    r, rod, start, piston = 0.1, 0.3, 1.0, 0.5
    made = Linkage("engine")
    made.ground(A=(0, 0))
    made.points(C=(r * np.cos(start), r * np.sin(start)), B=(0.34, 0))
    made.bar("crank", "A", "C", density=0.0)
    made.bar("rod", "C", "B", length=rod, density=0.0)
    made.slide("piston", "B", mass=piston)
    made.spring("A", "B", stiffness=50.0, length=0.15, damping=3.0)
    made.motor("crank", at="A")
    plain = made.chain()
    chain = plain.with_springs([*plain.springs, fb.JointSpring("piston", 80.0, 0.5, 2.0)])
    trajectory, loads = driven(chain, 2.0 * np.pi)
    q, v, a = actuated(chain, trajectory)
    s, c = np.sin(q), np.cos(q)
    away = np.sqrt(rod**2 - (r * s) ** 2)
    x, slope = r * c + away, -r * s - r**2 * s * c / away
    bend = -r * c - r**2 * ((c**2 - s**2) * away**2 + (r * s * c) ** 2) / away**3
    push = piston * (slope * a + bend * v**2) + 50.0 * (x - 0.15) + 80.0 * (x - 0.5) + (3.0 + 2.0) * slope * v
    np.testing.assert_allclose(loads.torque[:, 0], push * slope, rtol=0.0, atol=ROUND)
    along_the_rod = np.linalg.norm(loads.joint_reactions[:, chain.joints.index("crank"), :2], axis=1)
    np.testing.assert_allclose(along_the_rod, np.abs(push) * rod / away, rtol=0.0, atol=100.0 * ROUND)
    assert loads.power_residual() == pytest.approx(0.0, abs=ROUND)
