"""Cost per sample of the generic road on N four-bars, each with its own crank or all in a row behind one.

In a row the output of each four-bar is the input of the next: a bar straight through its pivot, whose other half is the
crank of the same four-bar turned by half a turn and run backwards, so that every second bar swings as the first does
and none drifts into a singularity, however many there are.
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

HEADINGS = ("four-bars", "own cranks", "by hand", "ratio", "one crank", "by hand", "ratio", "worst difference")
SIZES = (1, 2, 4, 8, 16, 32, 64)
SAMPLES = 500
CRANK, COUPLER, ROCKER, GROUND = 0.2, 0.5, 0.25, 0.5
"""Lengths [m]."""
MIDDLE, SWING = 1.4, 0.35
"""The crank swings by so much about this angle [rad]."""

Case = tuple[fb.ClosedChain, fb.Motion, np.ndarray, Callable[[Sequence[float]], list[float]]]
"""The mechanism, a motion, its first configuration, and its positions in closed form."""


def own_cranks(count: int) -> Case:
    """Return four-bars side by side, cranks swinging at different phases."""
    m, loops, cranks = TreeBuilder(f"{count} four-bars", gravity=(0.0, 0.0, 0.0)), [], []
    for k in range(count):
        m.bar(f"crank_{k}", "", (k, 0.0, 0.0), CRANK)
        loops.append(_loop(m, k, f"crank_{k}", CRANK, COUPLER))
        m.bar(f"rocker_{k}", "", (k + GROUND, 0.0, 0.0), ROCKER)
        m.point(f"pin_{k}_rocker", f"rocker_{k}", (ROCKER, 0.0, 0.0))
        cranks.append(f"crank_{k}")

    def position(x: Sequence[float]) -> list[float]:
        q = []
        for crank in x:
            coupler, rocker = _four_bar(crank, CRANK, ROCKER, 1.0)
            q += [crank, coupler - crank, rocker]
        return q

    motion = _swing(count)
    return m.chain(loops, cranks), motion, np.array(position(motion.q[0].tolist())), position


def one_crank(count: int) -> Case:
    """Return four-bars in a row behind one crank."""
    m, loops, x = TreeBuilder(f"{count} four-bars in a row", gravity=(0.0, 0.0, 0.0)), [], 0.0
    m.bar("crank", "", (0.0, 0.0, 0.0), CRANK)
    for k in range(count):
        before = f"rocker_{k - 1}" if k else "crank"
        arm, other, _ = _in_turn(k)
        loops.append(_loop(m, k, before, -arm if k else arm, COUPLER))
        x += GROUND
        m.bar(f"rocker_{k}", "", (x, 0.0, 0.0), other)
        m.box(f"rocker_{k}", (-other, 0.0, 0.0), (0.0, 0.0, 0.0), width=0.02, thickness=0.01)
        m.point(f"pin_{k}_rocker", f"rocker_{k}", (other, 0.0, 0.0))

    def position(x: Sequence[float]) -> list[float]:
        q, angle = [x[0]], x[0]
        for k in range(count):
            coupler, rocker = _four_bar(angle + np.pi * (k > 0), *_in_turn(k))
            q += [coupler - angle, rocker]
            angle = rocker
        return q

    motion = _swing(1)
    chain = m.chain(loops, ("crank",))
    return chain, motion, np.array(position(motion.q[0].tolist())), position


def _loop(m: TreeBuilder, k: int, arm: str, at: float, coupler: float) -> tuple[str, str, str]:
    """Hang a coupler on an arm; return the closure that it ends in."""
    m.bar(f"coupler_{k}", arm, (at, 0.0, 0.0), coupler)
    m.point(f"pin_{k}_coupler", f"coupler_{k}", (coupler, 0.0, 0.0))
    return f"pin_{k}", f"pin_{k}_coupler", f"pin_{k}_rocker"


def _in_turn(k: int) -> tuple[float, float, float]:
    """Return input arm, output arm and side of the k-th four-bar in a row: forwards, backwards and so on."""
    return (CRANK, ROCKER, 1.0) if k % 2 == 0 else (ROCKER, CRANK, -1.0)


def _four_bar(angle: float, arm: float, other: float, side: float) -> tuple[float, float]:
    """Return the absolute angles of coupler and output from that of the input."""
    start = cmath.rect(arm, angle)
    at = knee(start, complex(GROUND), COUPLER, other, side)
    return cmath.phase(at - start), cmath.phase(at - GROUND)


def _swing(cranks: int) -> fb.Motion:
    t = np.linspace(0.0, 1.0, SAMPLES)
    w = 2.0 * np.pi
    x = w * t[:, None] + np.arange(cranks)
    return fb.Motion(t, MIDDLE + SWING * np.sin(x), SWING * w * np.cos(x), -SWING * w**2 * np.sin(x))


def rows() -> tuple[list[tuple[str, ...]], list[float]]:
    """Measure torque and shaking wrench; return the table and the exponents fitted over the larger half.

    The exponents are in the order of the columns: own cranks, by hand, one crank, by hand.
    """
    out, times = [], []
    for count in SIZES:
        cells, line, worst = [], [], 0.0
        for make in (own_cranks, one_crank):
            road, loop, difference = _measured(make(count))
            worst = max(worst, difference)
            line += [road, loop]
            cells += [f"{1e6 * road:.3g} us", f"{1e6 * loop:.3g} us", f"{loop / road:.2g} x"]
        times.append(line)
        out.append((f"{count}", *cells, f"{worst:.1e}"))
    half = len(SIZES) // 2
    return out, [float(s) for s in np.polyfit(np.log(SIZES[half:]), np.log(times[half:]), 1)[0]]


def _measured(case: Case) -> tuple[float, float, float]:
    """Return seconds a sample, of this library and by hand, and the difference of the torques over the largest."""
    chain, motion, q0, position = case
    hand = HandLoop(chain, q0, position)
    road, loads = best_of(lambda: fb.inverse_dynamics(chain, fb.drive(chain, motion, near=q0)))
    loop, (torque, *_) = best_of(lambda: hand.run(motion))
    return road / SAMPLES, loop / SAMPLES, float(np.abs(loads.torque - torque).max() / np.abs(torque).max())
