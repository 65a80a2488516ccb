"""Join the feet of the Solo robot: its left legs are a five-bar with real inertias, both sides are two of them.

python demos/solo_legs.py             # live view in the browser
python demos/solo_legs.py --headless  # numbers only
"""

import argparse

import numpy as np

import fivebar_pin as fb
from fivebar_pin import viz
from fivebar_pin.shipped import mechanisms

PERIOD = 1.0  # [s]
SWING = 0.15  # amplitude of the hips [rad]


def swung(chain):
    """Swing every hip about the standing pose, all together."""
    q0 = chain.references["home"]
    t = np.linspace(0.0, PERIOD, 201)
    hips = [q0[chain.model.idx_qs[chain.model.getJointId(joint)]] for joint in chain.actuated]
    swings = [fb.motion.harmonic(t, hip, SWING, period=PERIOD, phase=-0.5 * np.pi) for hip in hips]
    trajectory = fb.drive(chain, fb.motion.combine(*swings), near=q0)
    return trajectory, fb.inverse_dynamics(chain, trajectory)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--headless", action="store_true", help="do not open the browser")
    headless = parser.parse_args().headless
    shown = []
    for sides in (("left",), ("left", "right")):
        chain = mechanisms.solo_legs(sides)
        diagnosis = fb.diagnose(chain)
        trajectory, loads = swung(chain)
        peaks = ", ".join(
            f"{name} {peak:.3f}" for name, peak in zip(chain.actuated, np.abs(loads.torque).max(axis=0), strict=True)
        )
        print(f"{chain.name}: mobility {diagnosis.mobility}, closures open by {trajectory.worst_closure:.1e} m")
        print(f"  peak torque [N m]: {peaks}")
        shaking, frame = (loads.peak(x) for x in ("shaking_force", "frame_force"))
        print(f"  peak force: shaking {shaking:.3f} N, on the frame {frame:.3f} N")
        print(f"  power residual {loads.power_residual():.1e}")
        shown.append(viz.Shown(chain, trajectory, loads))
    if not headless:
        viz.view(shown, speed=0.5, title="Solo, feet joined", announce=print)


if __name__ == "__main__":
    main()
