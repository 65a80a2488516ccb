"""Let the double four-bar of the IFToMM benchmark swing by itself and compare with the published positions.

Five uniform rods of 1 m and 1 kg: three uprights on the ground, two couplers; it passes configurations in which it
could gain two degrees of freedom.

    python demos/free_motion.py             # live view in the browser
    python demos/free_motion.py --headless  # numbers only
"""

import argparse

import numpy as np
import pinocchio as pin
from rich.progress import Progress

import fivebar_pin as fb
from fivebar_pin import viz
from fivebar_pin.dynamics import energy_balance

ROD = pin.Inertia(1.0, np.array([0.5, 0.0, 0.0]), np.diag([0.0, 1.0 / 12.0, 1.0 / 12.0]))  # 1 kg, 1 m
FAR = np.full(1, 1e4)  # joint limits [rad]
PUBLISHED = {1.0: (-0.19502030194944, -0.98079920566217), 10.0: (0.32845811154082, 0.94451853817860)}  # tip B0 [m]


def double_four_bar():
    """Uprights u0, u1, u2 and couplers c1 (u0 to u1), c2 (u1 to u2), in the x-y plane."""
    model = pin.Model()
    model.name = "double_four_bar"
    model.gravity.linear = np.array([0.0, -9.81, 0.0])

    def add(parent, name, x):
        placement = pin.SE3(np.eye(3), np.array([x, 0.0, 0.0]))
        joint = model.addJoint(parent, pin.JointModelRZ(), placement, name, FAR, FAR, -FAR, FAR)
        model.appendBodyToJoint(joint, ROD, pin.SE3.Identity())
        tip = pin.SE3(np.eye(3), np.array([1.0, 0.0, 0.0]))
        model.addFrame(pin.Frame(f"{name}_tip", joint, 0, tip, pin.FrameType.OP_FRAME))
        return joint

    u0, u1, _ = (add(0, f"u{k}", float(k)) for k in range(3))
    add(u0, "c1", 1.0)
    add(u1, "c2", 1.0)
    closures = (fb.Closure(("c1_tip", "u1_tip")), fb.Closure(("c2_tip", "u2_tip")))
    return fb.ClosedChain(model, closures, ("u0",))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--headless", action="store_true", help="do not open the browser")
    headless = parser.parse_args().headless
    chain = double_four_bar()
    up = 0.5 * np.pi
    q0 = fb.assemble(chain, [up], near=np.array([up, up, up, -up, -up]))
    v0 = np.array([-1.0, -1.0, -1.0, 1.0, 1.0])  # the tips move at 1 m/s along x
    t = np.linspace(0.0, 10.0, 1001)
    with Progress(transient=True) as bar:
        task = bar.add_task("integrating", total=1.0)
        trajectory = fb.simulate(chain, q0, v0, None, t, progress=lambda x: bar.update(task, completed=x))
    for instant, published in PUBLISHED.items():
        angle = trajectory.q[np.searchsorted(t, instant), 0]
        tip = np.array([np.cos(angle), np.sin(angle)])
        print(f"t = {instant:4.1f} s: tip {tip}, {np.abs(tip - published).max():.1e} m from the published position")
    print(f"closure {trajectory.worst_closure:.1e} m, energy drift {energy_balance(chain, trajectory).drift():.1e}")
    if not headless:
        viz.view([viz.Shown(chain, trajectory)], title="Double four-bar, free motion", announce=print)


if __name__ == "__main__":
    main()
