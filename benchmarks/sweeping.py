"""Other lengths of a five-bar, all at once against one chain after the other."""

from __future__ import annotations

import numpy as np

import fivebar_pin as fb
from benchmarks.timing import best_of

HEADINGS = ("designs", "threads", "together", "per design", "one by one, per design", "ratio", "worst difference")
SAMPLES = 201
FEW = 20  # designs that are made chains of their own


def five_bar() -> tuple[fb.ClosedChain, fb.Motion]:
    """Return a five-bar of uniform bars and a motion of its cranks."""
    made = fb.planar.Linkage("five_bar")
    made.ground(A=(0.0, 0.0), B=(0.2, 0.0))
    made.points(C=(-0.06, 0.14), D=(0.26, 0.14), P=(0.1, 0.28))
    for name, one, other in (("left", "A", "C"), ("left_rod", "C", "P"), ("right", "B", "D"), ("right_rod", "D", "P")):
        made.bar(name, one, other)
    made.motor("left", at="A")
    made.motor("right", at="B")
    chain = made.chain()
    t, swing, w = np.linspace(0.0, 1.0, SAMPLES), np.array([0.4, 0.3]), 2.0 * np.pi
    q, v, a = (
        np.outer(np.sin(w * t), swing),
        w * np.outer(np.cos(w * t), swing),
        -w * w * np.outer(np.sin(w * t), swing),
    )
    return chain, fb.Motion(t, chain.references["home"][chain.actuated_index] + q, v, a)


def lengths(chain: fb.ClosedChain, n: int) -> dict[str, np.ndarray]:
    """Return random lengths of three bars (n,) each."""
    rng = np.random.default_rng(0)
    return {name: chain.parameters[name] * rng.uniform(0.8, 1.25, n) for name in ("left", "left_rod", "right")}


def one_by_one(chain: fb.ClosedChain, motion: fb.Motion, values: dict[str, np.ndarray], n: int) -> np.ndarray:
    """Return the peak torques of some designs, each made a chain."""
    found = []
    for k in range(n):
        other = chain.with_parameters({name: float(x[k]) for name, x in values.items()})
        loads = fb.inverse_dynamics(other, fb.drive(other, motion))
        found.append(np.abs(loads.torque).max())
    return np.array(found)


def rows(designs: int) -> list[tuple[str, ...]]:
    chain, motion = five_bar()
    values = lengths(chain, designs)
    few = min(FEW, designs)
    alone, expected = best_of(lambda: one_by_one(chain, motion, values, few), repeats=3)
    out = []
    for threads in (1, 2):
        taken, found = best_of(
            lambda threads=threads: fb.sweep(chain, motion, parameters=values, of="peak_torque", threads=threads),
            repeats=2,
            budget=60.0,
        )
        each, one = taken / designs, alone / few
        worst = np.abs(found["peak_torque"][:few] / expected - 1.0).max()
        texts = f"{designs}", f"{threads}", f"{taken:.2f} s", f"{1e6 * each:.0f} us", f"{1e6 * one:.0f} us"
        out.append((*texts, f"{one / each:.0f}", f"{worst:.0e}"))
    return out
