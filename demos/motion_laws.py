"""Drive the five-bar with each motion law and see what the law alone does to torque and shaking force.

python demos/motion_laws.py             # live view in the browser
python demos/motion_laws.py --headless  # numbers only
"""

import argparse

import numpy as np

import fivebar_pin as fb
from fivebar_pin import motion, paper, viz

DURATION = 1.0  # [s]
TURN = 2.0 * np.pi  # turn of the first motor [rad]
REST = np.pi / 3.0  # angle at which the second motor stands [rad]


def laws(t):
    """The same turn of psi, done four ways."""
    knots = np.linspace(0.0, DURATION, 9)
    eased = TURN * (knots / DURATION - np.sin(2.0 * np.pi * knots / DURATION) / (2.0 * np.pi))
    return {
        "cycloidal": motion.cycloidal(t, 0.0, TURN),
        "polynomial 3-4-5": motion.polynomial(t, 0.0, TURN, degree=5),
        "polynomial 4-5-6-7": motion.polynomial(t, 0.0, TURN, degree=7),
        "spline through 9 points": motion.spline(t, knots, eased),
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--headless", action="store_true", help="do not open the browser")
    headless = parser.parse_args().headless
    linkage = paper.table_1("I", "unbalanced")
    chain = linkage.chain()
    t = np.linspace(0.0, DURATION, 401)
    shown = []
    for name, psi in laws(t).items():
        both = motion.combine(psi, motion.constant(t, REST))
        start = linkage.configuration(*both.q[0], mode=paper.AssemblyMode.LEFT)
        trajectory = fb.drive(chain, both, near=start)
        loads = fb.inverse_dynamics(chain, trajectory)
        force = np.linalg.norm(loads.shaking_force, axis=1).max()
        print(
            f"{name:24s} peak acceleration {np.abs(psi.a).max():6.2f} rad/s2   "
            f"peak torque {np.abs(loads.torque[:, 0]).max():.5f} N m   peak shaking force {force:.4f} N"
        )
        shown.append(viz.Shown(chain, trajectory, loads, name))
    if not headless:
        viz.view(shown, speed=0.5, title="One turn, four motion laws", announce=print)


if __name__ == "__main__":
    main()
