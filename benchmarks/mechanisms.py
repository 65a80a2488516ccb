"""The generic road on every shipped mechanism: against a hand-written Pinocchio loop, and assembled at random."""

from __future__ import annotations

from collections import Counter

import numpy as np

import fivebar_pin as fb
from benchmarks.handwritten import HandLoop
from benchmarks.positions import closed_form
from benchmarks.timing import best_of

HEADINGS = (
    "mechanism",
    "coordinates",
    "rows",
    "positions by hand",
    "hand-written loop",
    "this library",
    "ratio",
    "worst difference",
)
ASSEMBLIES = ("mechanism", "tried", "closed", "out of reach", "singular", "worst residual", "left its branch")
SAMPLES = 1000


def rows() -> list[tuple[str, ...]]:
    """Measure torque and shaking wrench per sample, 1000 samples."""
    out = []
    for name in fb.io.shipped():
        chain = fb.load(fb.io.shipped_path(name))
        motion, q0 = _swing(chain)
        position = closed_form(chain, q0)
        hand = HandLoop(chain, q0, position)
        loop, by_hand = best_of(lambda: hand.run(motion))  # noqa: B023
        road, loads = best_of(lambda: fb.inverse_dynamics(chain, fb.drive(chain, motion, near=q0)))  # noqa: B023
        scale = max(float(np.abs(by_hand[0]).max()), 1e-12)
        out.append(
            (
                name,
                f"{chain.nv}",
                f"{sum(c.kind.rows for c in chain.closures)}",
                "Newton" if position is None else "closed form",
                f"{1e6 * loop / SAMPLES:.3g} us",
                f"{1e6 * road / SAMPLES:.3g} us",
                f"{loop / road:.1f} x",
                f"{float(np.abs(loads.torque - by_hand[0]).max()) / scale:.1e}",
            )
        )
    return out


def assemblies(count: int = 10000, *, seed: int = 0) -> list[tuple[str, ...]]:
    """Assemble at random actuated coordinates, each from the one before, and check residual and branch.

    The branch is checked by going back: from the new configuration to the old actuated coordinates.
    """
    rng = np.random.default_rng(seed)
    names = fb.io.shipped()
    out = []
    for name in names:
        chain = fb.load(fb.io.shipped_path(name))
        _, q = _swing(chain)
        at = chain.model.idx_qs
        index = [at[chain.model.getJointId(joint)] for joint in chain.actuated]
        tally: Counter[str] = Counter()
        worst = 0.0
        for _ in range(-(-count // len(names))):
            x, back = q[index] + rng.uniform(-1.0, 1.0, chain.na), q[index]
            try:
                new = fb.assemble(chain, x, near=q)
                home = fb.assemble(chain, back, near=new)
            except fb.FiveBarPinError as error:
                tally[type(error).__name__] += 1
                continue
            tally["closed"] += 1
            tally["flipped"] += bool(np.abs(home - q).max() > 1e-6)
            worst = max(worst, float(np.abs(fb.closure_residual(chain, new)).max()))
            q = new
        tried = sum(tally.values()) - tally["flipped"]
        lost = f"{tally['AssemblyError'] + tally['BranchError']}"
        flipped = f"{tally['flipped']}"
        out.append(
            (name, f"{tried}", f"{tally['closed']}", lost, f"{tally['SingularityError']}", f"{worst:.1e}", flipped)
        )
    return out


def _swing(chain: fb.ClosedChain) -> tuple[fb.Motion, np.ndarray]:
    """Swing every motor about the named configuration, as far as the mechanism allows."""
    q0 = next(iter(chain.references.values()))
    t = np.linspace(0.0, 1.0, SAMPLES)
    index = [chain.model.idx_qs[chain.model.getJointId(joint)] for joint in chain.actuated]
    for amplitude in (1.0, 0.5, 0.2, 0.1, 0.05):
        swing = amplitude * np.sin(2.0 * np.pi * t)[:, None] * np.ones(chain.na)
        rate = 2.0 * np.pi * amplitude * np.cos(2.0 * np.pi * t)[:, None] * np.ones(chain.na)
        motion = fb.Motion(t, q0[index] + swing, rate, -((2.0 * np.pi) ** 2) * swing)
        try:
            return motion, fb.drive(chain, motion, near=q0, limits="ignore").q[0]
        except fb.FiveBarPinError:
            continue
    raise RuntimeError(f"{chain.name} cannot be moved from its named configuration")
