"""Four bars that neither push nor twist their frame, without any counter-rotation.

python demos/reactionless_four_bar.py             # live view in the browser
python demos/reactionless_four_bar.py --headless  # numbers only
"""

import argparse

import numpy as np

import fivebar_pin as fb
from fivebar_pin import balancing, viz
from fivebar_pin.shipped import mechanisms

RATE, ACCELERATION = 5.0, -20.0  # of the crank [rad/s], [rad/s2]
PERIOD = 2.0  # [s]
MIDDLE, SWING = 0.5 * np.pi, 1.2  # of the crank [rad]; at 0 and pi the bars lie in line, where branches meet
REACH = 10.0  # material of the generic four-bar may lie this far from each joint [m]
MASSES = (0.01, 100.0)  # of each of its bars [kg]


def at_once(chain):
    """Return shaking force and moment at the given rate and acceleration, all round the crank's turn."""
    q0 = chain.references["home"]
    force, moment = [], []
    for angle in np.linspace(0.3, np.pi - 0.3, 7):
        state = fb.Motion(np.zeros(1), np.array([[angle]]), np.array([[RATE]]), np.array([[ACCELERATION]]))
        loads = fb.inverse_dynamics(chain, fb.drive(chain, state, near=q0))
        force.append(loads.peak("shaking_force"))
        moment.append(loads.peak("shaking_moment"))
    return max(force), max(moment)


def tell(label, chain):
    force, moment = at_once(chain)
    print(f"{label:34s} mass {chain.mass:.4f} kg   shaking force {force:.4g} N   moment {moment:.4g} N m")


def swung(label, chain):
    """Swing the crank for the view."""
    q0 = chain.references["home"]
    t = np.linspace(0.0, PERIOD, 241)
    trajectory = fb.drive(chain, fb.motion.harmonic(t, MIDDLE, SWING, period=PERIOD), near=q0)
    return viz.Shown(chain, trajectory, fb.inverse_dynamics(chain, trajectory), label)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--headless", action="store_true", help="do not open the browser")
    headless = parser.parse_args().headless
    known = mechanisms.four_bar_reactionless()
    rods = mechanisms.four_bar_antiparallelogram()
    tell("antiparallelogram of the literature", known)
    tell("antiparallelogram of plain bars", rods)
    added = fb.balance(rods, "dynamic")
    tell("the same, material added", added.chain)
    redesigned = fb.balance(rods, "dynamic", mode="redesign")
    tell("the same, redesigned", redesigned.chain)
    print(f"\n{added}\n  one branch only: the parallelogram that the same bars make has no such design\n")
    generic = mechanisms.four_bar_crank_rocker()
    print(f"{generic.name}: {fb.balance_conditions(generic, 'dynamic')}")
    proof = fb.balance(generic, "dynamic", mode="redesign", region=balancing.Ball(REACH), masses=MASSES)
    print(f"whatever its bars of {MASSES[0]:g} to {MASSES[1]:g} kg within {REACH:g} m: {proof.status}")
    print(f"  {proof.certificate}")
    shown = [swung("plain bars", rods), swung("material added", added.chain), swung("redesigned", redesigned.chain)]
    for one in shown:
        print(f"{one.label:15s} mass centre travels {one.loads.peak('travel'):.4g} m in the view")
    if not headless:
        viz.view(shown, speed=0.5, title="Reactionless four-bar: before and after", announce=print)


if __name__ == "__main__":
    main()
