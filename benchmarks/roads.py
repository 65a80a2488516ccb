"""The closed-form road and the Pinocchio road of the five-bar against a hand-written Pinocchio loop.

The loop has its positions in closed form too.
"""

from __future__ import annotations

import numpy as np

import fivebar_pin as fb
from benchmarks.handwritten import HandLoop
from benchmarks.positions import closed_form
from benchmarks.timing import best_of
from fivebar_pin import paper

HEADINGS = (
    "samples",
    "hand-written loop",
    "with joint forces",
    "Pinocchio road",
    "with joint forces",
    "closed form, all outputs",
    "loop / Pinocchio road",
    "loop / closed form",
    "worst difference",
)


def rows(samples: tuple[int, ...]) -> list[tuple[str, ...]]:
    """Measure torque and shaking wrench from the motion of the motors, microseconds per sample."""
    linkage = paper.table_1("I", "unbalanced")
    chain = linkage.chain()
    home = linkage.configuration(0.5, 1.5, mode=paper.AssemblyMode.LEFT)
    hand = HandLoop(chain, home, closed_form(chain, home))
    out = []
    for n in samples:
        motion = paper.default_motion(samples=max(n, 2))
        if n == 1:
            motion = fb.Motion(motion.t[:1], motion.q[:1], motion.v[:1], motion.a[:1])
        q0 = linkage.configuration(*motion.q[0], mode=paper.AssemblyMode.LEFT)

        def pinocchio_road(motion=motion, q0=q0):
            return fb.inverse_dynamics(chain, fb.drive(chain, motion, near=q0))

        loop, by_hand = best_of(lambda: hand.run(motion))  # noqa: B023
        loop_all, _ = best_of(lambda: hand.run(motion, joint_forces=True))  # noqa: B023
        road, loads = best_of(pinocchio_road)
        road_all, _ = best_of(lambda: pinocchio_road().joint_reactions)
        closed, solution = best_of(lambda: paper.solve(linkage, motion, mode=paper.AssemblyMode.LEFT))  # noqa: B023
        torque = by_hand[0]
        difference = max(
            float(np.abs(x - torque).max()) / max(float(np.abs(torque).max()), 1e-300)
            for x in (loads.torque, solution.torque)
        )
        micro = [f"{1e6 * t / n:.3g} us" for t in (loop, loop_all, road, road_all, closed)]
        out.append((f"{n}", *micro, f"{loop / road:.2g} x", f"{loop / closed:.2g} x", f"{difference:.1e}"))
    return out
