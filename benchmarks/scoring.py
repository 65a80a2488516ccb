"""Scoring and redesigning the five-bar: many mass distributions at once, and solves after the first."""

from __future__ import annotations

import numpy as np

import fivebar_pin as fb
from benchmarks.timing import best_of
from fivebar_pin import balancing, paper

HEADINGS = ("designs", "one by one, measured on", "per design", "scored together", "ratio", "worst difference")
SOLVES = ("objectives", "variables, rows", "first solve, prepared", "new weights", "gap")
TERMS = ("rms_shaking_force", "rms_shaking_moment", "rms_torque")
ONE_BY_ONE = 200
REACH = 0.1  # material lies within this distance of each joint [m]


def rows(designs: int = 1_000_000, *, samples: int = 201) -> list[tuple[str, ...]]:
    """Measure RMS of shaking force, moment and torque, kinematics included, against inverse dynamics design by design.

    One by one, a design is a chain of its own on the Pinocchio road, along a trajectory that is driven once.
    """
    chain, trajectory = _five_bar(samples)
    X = balancing.variations(chain, designs, spread=0.3)
    few = X[:ONE_BY_ONE]
    together, scores = best_of(lambda: fb.score(chain, trajectory, X, terms=TERMS), repeats=3, budget=10.0)
    alone, by_one = best_of(lambda: np.array([_measured(chain, trajectory, x) for x in few]), repeats=3)
    each = alone / len(few)
    expected = np.column_stack([scores[term][: len(few)] for term in TERMS])
    difference = float((np.abs(by_one - expected) / expected).max())
    ratio = each * designs / together
    return [
        (
            f"{designs}",
            f"{len(few)}",
            f"{1e6 * each:.3g} us",
            f"{together:.3g} s",
            f"{ratio:.0f} x",
            f"{difference:.1e}",
        )
    ]


def solves() -> list[tuple[str, ...]]:
    """Measure a solve of the force balance with new weights, the problem being prepared."""
    chain, trajectory = _five_bar(201)
    out = []
    for objectives in (
        ("added_mass", "rms_torque"),
        ("added_mass", "inertia", "rms_torque", "rms_shaking_moment"),
        tuple(f"mean_square_{m}" for m in ("bearing_force", "torque", "shaking_moment", "angular_momentum")),
        ("added_mass", "peak_torque"),
    ):
        problem = balancing.balance_problem(
            chain, "force", region=balancing.Ball(REACH), motions=trajectory, objectives=objectives
        )
        first, _ = best_of(lambda: problem.solve(dict.fromkeys(objectives, 1.0)), repeats=1)  # noqa: B023
        again, design = best_of(lambda: problem.solve({o: 1.0 + k for k, o in enumerate(objectives)}))  # noqa: B023
        size = f"{problem.form.program.n}, {problem.form.program.g.size}"
        milli = (f"{1e3 * first:.3g} ms", f"{1e3 * again:.3g} ms")
        out.append((", ".join(objectives), size, *milli, f"{design.gap:.1e}"))
    return out


def _five_bar(samples: int) -> tuple[fb.ClosedChain, fb.Trajectory]:
    linkage, motion = paper.table_1("I", "unbalanced"), paper.default_motion(samples=samples)
    chain = linkage.chain()
    return chain, fb.drive(chain, motion, near=linkage.configuration(*motion.q[0], mode=paper.AssemblyMode.LEFT))


def _measured(chain: fb.ClosedChain, trajectory: fb.Trajectory, parameters: np.ndarray) -> list[float]:
    loads = fb.inverse_dynamics(chain.with_inertial_parameters(parameters), trajectory)
    values = (loads.shaking_force, loads.shaking_moment, loads.torque)
    return [float(np.sqrt((x * x).sum(axis=1).mean())) for x in values]
