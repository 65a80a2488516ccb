"""Diagnose, move and show every mechanism that ships.

python demos/gallery.py             # live view in the browser, one after the other (Ctrl-C for the next)
python demos/gallery.py --headless  # numbers only
"""

import argparse

import numpy as np

import fivebar_pin as fb
from fivebar_pin import viz

PERIOD = 2.0  # [s]


def sway(chain):
    """Swing every motor about the named configuration, as far as the mechanism allows."""
    q0 = chain.references["home"]
    t = np.linspace(0.0, PERIOD, 241)
    at = [q0[chain.model.idx_qs[chain.model.getJointId(joint)]] for joint in chain.actuated]
    for amplitude in (0.8, 0.4, 0.2, 0.1):
        swings = [fb.motion.harmonic(t, x, amplitude, period=PERIOD, phase=-0.5 * np.pi) for x in at]
        try:
            return fb.drive(chain, fb.motion.combine(*swings), near=q0)
        except fb.FiveBarPinError as error:
            print(f"    amplitude {amplitude}: {error}")
    raise SystemExit(f"{chain.name} does not move")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--headless", action="store_true", help="do not open the browser")
    headless = parser.parse_args().headless
    for name in fb.io.shipped():
        chain = fb.load(fb.io.shipped_path(name))
        diagnosis = fb.diagnose(chain)
        print(f"{name}: mobility {diagnosis.mobility}, rank {diagnosis.rank} of {diagnosis.rows} closure rows")
        trajectory = sway(chain)
        loads = fb.inverse_dynamics(chain, trajectory)
        print(f"    {loads}; open by {trajectory.worst_closure:.1e}, power residual {loads.power_residual():.1e}")
        if not headless:
            viz.view([viz.Shown(chain, trajectory, loads)], title=name, announce=print)


if __name__ == "__main__":
    main()
