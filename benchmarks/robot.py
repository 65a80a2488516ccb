"""A robot of four legs on a fixed base: 40 joints, 24 motors, 8 loops.

A leg hangs on a joint that turns about the vertical and one that rolls; below them a five-bar lies in the plane of the
leg, driven by both of its hips, and its shank carries a four-bar that tilts a foot, on which a toe turns. The five-bar
and the four-bar are intersections of circles, so that a hand-written loop has positions in closed form here too.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Sequence

import numpy as np

import fivebar_pin as fb
from benchmarks.handwritten import HandLoop
from benchmarks.positions import knee
from benchmarks.timing import best_of
from fivebar_pin.shipped import TreeBuilder

HEADINGS = ("task", "hand-written loop", "this library", "ratio", "worst difference")
SAMPLES = 1000
HIPS = {
    "front_left": (0.25, 0.15),
    "front_right": (0.25, -0.15),
    "hind_left": (-0.25, 0.15),
    "hind_right": (-0.25, -0.15),
}
"""Where the legs hang, x forwards and y to the left [m]."""
APART, THIGH, SHANK = 0.06, 0.18, 0.22
"""Distance of the two hips of a five-bar, its driven and its other bars [m]."""
BEYOND = 0.04
"""How far the shank reaches beyond the knee pin of the five-bar to the ankle [m]."""
MOUNT, CRANK, ROD, ANKLE = 0.10, 0.05, 0.15, 0.05
"""Place of the foot's crank along the shank, the crank, the rod, the lever of the foot [m]."""
FOOT = 0.08
"""From the ankle to the toe [m]."""
MOTORS = {"yaw": 0.0, "roll": 0.0, "hip_1": -2.3, "hip_2": -0.84, "crank": 1.5, "toe": 0.3}
"""Motors of a leg, and the angles that they swing about [rad]."""
SWING = 0.25
"""Largest angle that a motor swings to either side [rad]."""
STANDING = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Axes of the plane of a leg: x forwards, y up, z to the right."""
ALONG = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""Axes of a roll: z forwards."""


LOOPS = (("K", "shank", "strut"), ("A", "rod", "foot"))
"""Closures of a leg: the knee of the five-bar, the lever of the foot."""


def robot() -> fb.ClosedChain:
    """Return the robot, with a closed configuration "home"."""
    m, loops, home = TreeBuilder("quadruped", gravity=(0.0, 0.0, -9.81)), [], {}
    for leg, (x, y) in HIPS.items():
        loops += _leg(m, leg, (x, y, 0.0))
        home |= {f"{leg}_{joint}": angle for joint, angle in _angles(list(MOTORS.values())).items()}
    return m.chain(loops, [f"{leg}_{motor}" for leg in HIPS for motor in MOTORS], home)


def _leg(m: TreeBuilder, leg: str, at: tuple[float, float, float]) -> list[tuple[str, str, str]]:
    """Build one leg; return its closures."""

    def name(joint: str) -> str:
        return f"{leg}_{joint}"

    m.joint(name("yaw"), at=at)
    m.box(name("yaw"), (0.0, 0.0, 0.0), (0.0, 0.0, -0.05), width=0.03, thickness=0.03)
    m.joint(name("roll"), name("yaw"), at=(0.0, 0.0, -0.05), axes=ALONG)
    m.box(name("roll"), (0.0, 0.0, -0.5 * APART), (0.0, 0.0, 0.5 * APART), width=0.03, thickness=0.03)
    for k, (hip, bar, length) in enumerate((("hip_1", "shank", SHANK + BEYOND), ("hip_2", "strut", SHANK))):
        m.joint(name(hip), name("roll"), at=(0.0, 0.0, (k - 0.5) * APART), axes=ALONG.T @ STANDING)
        m.box(name(hip), (0.0, 0.0, 0.0), (THIGH, 0.0, 0.0), width=0.02, thickness=0.01)
        m.bar(name(bar), name(hip), (THIGH, 0.0, 0.0), length)
        if bar == "shank":  # joints are numbered depth first, as Pinocchio wants them
            _foot(m, name)
    ends = {"K_shank": SHANK, "K_strut": SHANK, "A_rod": ROD, "A_foot": ANKLE}
    for end, x in ends.items():
        m.point(name(end), name(end[2:]), (x, 0.0, 0.0))
    return [(name(loop), name(f"{loop}_{one}"), name(f"{loop}_{two}")) for loop, one, two in LOOPS]


def _foot(m: TreeBuilder, name: Callable[[str], str]) -> None:
    m.bar(name("crank"), name("shank"), (MOUNT, 0.0, 0.0), CRANK)
    m.bar(name("rod"), name("crank"), (CRANK, 0.0, 0.0), ROD)
    m.joint(name("foot"), name("shank"), at=(SHANK + BEYOND, 0.0, 0.0))
    m.box(name("foot"), (-FOOT, 0.0, 0.0), (0.0, 0.0, 0.0), width=0.02, thickness=0.02)
    m.bar(name("toe"), name("foot"), (-FOOT, 0.0, 0.0), 0.03)


def _angles(motors: Sequence[float]) -> dict[str, float]:
    """Return all joint angles of a leg, in the order of the tree, from those of its motors."""
    yaw, roll, first, second, crank, toe = motors
    start, end = -0.5 * APART + cmath.rect(THIGH, first), 0.5 * APART + cmath.rect(THIGH, second)
    at = knee(start, end, SHANK, SHANK, -1.0)
    tip, ankle = MOUNT + cmath.rect(CRANK, crank), complex(SHANK + BEYOND)
    lever = knee(tip, ankle, ROD, ANKLE, 1.0)
    return {
        "yaw": yaw,
        "roll": roll,
        "hip_1": first,
        "shank": cmath.phase(at - start) - first,
        "crank": crank,
        "rod": cmath.phase(lever - tip) - crank,
        "foot": cmath.phase(lever - ankle),
        "toe": toe,
        "hip_2": second,
        "strut": cmath.phase(at - end) - second,
    }


def position(x: Sequence[float]) -> list[float]:
    """Return the configuration (40,) of the robot from its motors (24,)."""
    each = len(MOTORS)
    return [angle for k in range(0, len(x), each) for angle in _angles(x[k : k + each]).values()]


def swing(chain: fb.ClosedChain, rng: np.random.Generator, samples: int = SAMPLES) -> fb.Motion:
    """Return a random smooth motion of all motors: three harmonics each, about home, a second long."""
    t = np.linspace(0.0, 1.0, samples)
    q, v, a = (np.zeros((samples, chain.na)) for _ in range(3))
    q += list(MOTORS.values()) * len(HIPS)
    for h, share in enumerate(SWING * rng.dirichlet(np.ones(3), chain.na).T, start=1):
        w, phase = 2.0 * np.pi * h, 2.0 * np.pi * rng.random(chain.na)
        x = w * t[:, None] + phase
        q += share * np.sin(x)
        v += share * w * np.cos(x)
        a -= share * w**2 * np.sin(x)
    return fb.Motion(t, q, v, a)


def rows(*, seed: int = 0) -> list[tuple[str, ...]]:
    """Measure torque and shaking wrench from a motion of the motors, per sample, and accelerations of one state."""
    chain = robot()
    q0, motion = chain.references["home"], swing(chain, np.random.default_rng(seed))
    hand = HandLoop(chain, q0, position)
    loop, by_hand = best_of(lambda: hand.run(motion))
    road, (trajectory, loads) = best_of(lambda: _road(chain, motion, q0))
    out = [
        _row(f"torque and shaking wrench, {SAMPLES} samples", loop / SAMPLES, road / SAMPLES, by_hand[0], loads.torque)
    ]
    k = SAMPLES // 3
    state = trajectory.q[k], trajectory.v[k], loads.torque[k]
    loop, by_hand = best_of(lambda: hand.accelerations(*state))
    road, a = best_of(lambda: fb.forward_dynamics(chain, *state))
    out.append(_row("accelerations of one state", loop, road, by_hand, a))
    return out


def _road(chain: fb.ClosedChain, motion: fb.Motion, q0: np.ndarray) -> tuple[fb.Trajectory, fb.Loads]:
    trajectory = fb.drive(chain, motion, near=q0)
    return trajectory, fb.inverse_dynamics(chain, trajectory)


def _row(task: str, loop: float, road: float, by_hand: np.ndarray, ours: np.ndarray) -> tuple[str, ...]:
    worst = float(np.abs(ours - by_hand).max() / np.abs(by_hand).max())
    return task, f"{1e6 * loop:.3g} us", f"{1e6 * road:.3g} us", f"{loop / road:.2g} x", f"{worst:.1e}"
