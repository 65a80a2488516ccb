"""Cassie from the SDF of example-robot-data: close its legs, swing its hips, and see what of that balances.

python demos/cassie.py             # live view in the browser
python demos/cassie.py --headless  # numbers only
"""

import argparse
from pathlib import Path

import numpy as np
import pinocchio as pin

import fivebar_pin as fb
from fivebar_pin import balancing, viz

INSIDE = "share/example-robot-data/robots/cassie_description/robots/cassie_wo_gearbox_spring.sdf"
MOTORS = ("roll-op", "yaw-op", "pitch-op", "knee-op", "foot-op")
HELD = "knee-shin-joint"  # leaf spring of the shin: its deflection is given, what it carries follows
STANCE = {"pitch-op": 0.2, "knee-op": -0.1, "foot-op": -1.7}  # [rad]; at zero the feet are singular
FEET = {"foot-op": -1.7, "tarsus-crank-joint": -1.7, "crank-rod-joint": 1.7}  # one of two ways to assemble them [rad]
SWING, PERIOD = 0.15, 1.0  # of the hips [rad], [s]
THIGHS = ("left-pitch-op", "right-pitch-op")
REACH, MOST = 0.3, 5.0  # of what is added to a thigh, about its hip [m], [kg]


def load():
    """Return the robot, hung by its pelvis on a slide that is held, driven by its ten motors."""
    file = next(folder / INSIDE for folder in Path(pin.__file__).resolve().parents if (folder / INSIDE).is_file())
    legs = [f"{side}-{joint}" for side in ("left", "right") for joint in (*MOTORS, HELD)]
    return fb.load(file, actuated=["static", *legs])


def stated(names, values):
    """Return an angle for each name, which ends in one of those stated for both legs [rad]."""
    return np.array([next((x for joint, x in values.items() if name.endswith(joint)), 0.0) for name in names])


def standing(chain):
    """Assemble the feet and bend the knees from there; a search near the stance itself would not find it."""
    start, first = pin.neutral(chain.model), stated(chain.actuated, FEET)
    for joint in chain.joints:
        if joint.endswith(tuple(FEET)):
            start[chain.columns(joint)[0]] = stated([joint], FEET)
    t = np.linspace(0.0, 1.0, 101)
    steps = [fb.motion.cycloidal(t, a, b) for a, b in zip(first, stated(chain.actuated, STANCE), strict=True)]
    return fb.drive(chain, fb.motion.combine(*steps), near=fb.assemble(chain, first, near=start)).q[-1]


def swung(chain, q0):
    """Swing both hips together, the rest held."""
    t = np.linspace(0.0, PERIOD, 101)
    amplitudes = stated(chain.actuated, {"pitch-op": SWING})
    about = zip(stated(chain.actuated, STANCE), amplitudes, strict=True)
    return fb.drive(chain, fb.motion.combine(*[fb.motion.harmonic(t, x, a, period=PERIOD) for x, a in about]), near=q0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--headless", action="store_true", help="do not open the browser")
    headless = parser.parse_args().headless
    chain = load()
    q0 = standing(chain)
    diagnosis = fb.diagnose(chain, q0)
    print(f"{chain.name}: {chain.mass:.2f} kg, mobility {diagnosis.mobility}, loops open by {diagnosis.gap:.1e} m")
    conditions = fb.balance_conditions(chain, "force", near=q0)
    print(f"  {conditions.rank} conditions for a mass centre at rest, whichever way its motors move it")
    trajectory = swung(chain, q0)
    loads = fb.inverse_dynamics(chain, trajectory)
    within = {"bodies": THIGHS, "region": balancing.Ball(REACH), "masses": (0.0, MOST)}
    exact = fb.balance(chain, "force", near=q0, conditions=conditions, **within)
    print(f"  with material on its thighs: {exact.status}")
    best = fb.balance(chain, None, minimise="rms_shaking_force", motions=trajectory, **within)
    after = fb.inverse_dynamics(best.chain, trajectory)
    added = best.chain.mass - chain.mass
    print(f"hips swung by {SWING:g} rad, and the best of {added:.1f} kg added within {REACH:g} m of them:")
    for word, unit in (("shaking_force", "N"), ("shaking_moment", "N m"), ("frame_force", "N")):
        print(f"  peak {word.replace('_', ' '):14s} {loads.peak(word):8.3g} -> {after.peak(word):8.3g} {unit}")
    if not headless:
        shown = [viz.Shown(chain, trajectory, loads, "as it is"), viz.Shown(best.chain, trajectory, after, "balanced")]
        viz.view(shown, speed=0.5, title="Cassie: hips before and after", announce=print)


if __name__ == "__main__":
    main()
