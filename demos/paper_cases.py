"""Balance both cases of the paper's Table 1 and show them before and after, side by side.

python demos/paper_cases.py             # live view in the browser
python demos/paper_cases.py --headless  # numbers only
"""

import argparse

import numpy as np

import fivebar_pin as fb
from fivebar_pin import paper, viz

SPEED = 0.5  # playing speed over real time [-]


def moved(linkage, motion, label):
    """Take one linkage along the motion; return what the viewer shows."""
    chain = linkage.chain()
    start = linkage.configuration(*motion.q[0], mode=paper.AssemblyMode.LEFT)
    trajectory = fb.drive(chain, motion, near=start)
    return viz.Shown(chain, trajectory, fb.inverse_dynamics(chain, trajectory), label)


def report(shown):
    force, moment, travel = (shown.loads.peak(x) for x in ("shaking_force", "shaking_moment", "travel"))
    torque = np.abs(shown.loads.torque).max(axis=0)
    print(
        f"{shown.label:24s} shaking force {force:8.4g} N   moment {moment:.4f} N m   "
        f"torques {torque[0]:.4f}, {torque[1]:.4f} N m   COM travel {1e3 * travel:.4g} mm"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--headless", action="store_true", help="do not open the browser")
    headless = parser.parse_args().headless
    motion = paper.default_motion(samples=201)
    everything = []
    for case, reading in (("I", "printed"), ("II", "printed"), ("II", "corrected")):
        printed = paper.table_1(case, "balanced", reading=reading)
        optimum = paper.balance_mass_centres(printed)
        rho, residual = np.round(optimum.linkage.rho, 6), optimum.kkt_residual
        print(f"case {case}, masses {reading}: rho = {rho}, optimality residual {residual:.1e}")
        for label, linkage in (
            (f"{case} unbalanced", paper.table_1(case, "unbalanced")),
            (f"{case} table, {reading}", printed),
            (f"{case} balanced, {reading}", optimum.linkage),
        ):
            everything.append(moved(linkage, motion, label))
            report(everything[-1])
    if not headless:
        viz.view(everything, speed=SPEED, title="The paper's two cases", announce=print)


if __name__ == "__main__":
    main()
