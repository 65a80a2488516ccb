"""A desk lamp that stays where it is put: a parallelogram held by a spring of zero free length.

python demos/sprung_lamp.py             # live view in the browser
python demos/sprung_lamp.py --headless  # numbers only
"""

import argparse

import numpy as np
import pinocchio as pin

import fivebar_pin as fb
from fivebar_pin import viz

ARM, POST = 0.4, 0.1  # length of the two arms and distance of their pivots, one above the other [m]
HOOK = 0.12  # of the spring above the upper pivot [m]
EYE = 0.15  # of the spring along the lower arm [m]
STIFFNESS = 500.0  # [N/m]
ROD = 0.5  # mass of each arm [kg]; the head alone is to be found
LOW, HIGH = -0.9, 0.9  # of the arms against the horizontal [rad]
PERIOD = 4.0  # [s]


def lamp():
    """The arms turn about pivots on the post; the head, on the coupler, stays upright. y is up."""
    model = pin.Model()
    model.name = "lamp"
    model.gravity.linear = np.array([0.0, -9.81, 0.0])
    rod = pin.Inertia(ROD, np.array([0.5 * ARM, 0.0, 0.0]), np.diag([0.0, 1.0, 1.0]) * ROD * ARM**2 / 12.0)

    def frame(joint, name, x, y):
        model.addFrame(pin.Frame(name, joint, 0, pin.SE3(np.eye(3), np.array([x, y, 0.0])), pin.FrameType.OP_FRAME))

    def add(parent, name, x, y, inertia):
        joint = model.addJoint(parent, pin.JointModelRZ(), pin.SE3(np.eye(3), np.array([x, y, 0.0])), name)
        model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())
        return joint

    lower, upper = add(0, "lower", 0.0, 0.0, rod), add(0, "upper", 0.0, POST, rod)
    head = add(lower, "head", ARM, 0.0, pin.Inertia(0.1, np.zeros(3), 1e-4 * np.eye(3)))
    frame(0, "hook", 0.0, POST + HOOK)
    frame(lower, "eye", EYE, 0.0)
    frame(upper, "end", ARM, 0.0)
    frame(head, "top", 0.0, POST)
    return fb.ClosedChain(
        model, [fb.Closure(("top", "end"))], ["lower"], springs=[fb.Spring("hook", "eye", STIFFNESS, 0.0)]
    )


def held(chain, near):
    """Return the largest torque at rest over the range of the arms [N m]."""
    q = np.linspace(LOW, HIGH, 61)[:, None]
    still = fb.Motion(np.linspace(0.0, 1.0, len(q)), q, 0.0 * q, 0.0 * q)
    return fb.inverse_dynamics(chain, fb.drive(chain, still, near=near)).peak("torque")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--headless", action="store_true", help="do not open the browser")
    headless = parser.parse_args().headless
    chain = lamp()
    near = fb.assemble(chain, [0.2], near=np.array([0.2, 0.2, -0.2]))
    print(f"{chain}\n{fb.balance_conditions(chain, 'static', gravity='model', near=near)}\n")
    design = fb.balance(chain, "static", gravity="model", near=near, bodies=["head"])
    by_hand = STIFFNESS * (POST + HOOK) * EYE / (9.81 * ARM) - ROD - 0.1  # both arms weigh half at their ends
    print(f"{design}\nthe head needs {design.added_mass:.4f} kg more; by hand k a b / (g l) - ... = {by_hand:.4f} kg")
    for label, one in (
        ("before", chain),
        ("after", design.chain),
        ("without the spring", design.chain.with_springs(())),
    ):
        print(f"largest torque at rest, {label}: {held(one, near):.3g} N m")
    let_go = fb.simulate(design.chain, near, np.zeros(chain.nv), t=np.linspace(0.0, 2.0, 21))
    print(f"let go, it moves {np.abs(let_go.q - near).max():.1e} rad in two seconds")
    if not headless:
        swing = fb.motion.harmonic(np.linspace(0.0, PERIOD, 241), LOW, 0.5 * (HIGH - LOW), period=PERIOD)
        path = fb.drive(design.chain, swing, near=near)
        viz.view([viz.Shown(design.chain, path)], title="A lamp that stays where it is put", announce=print)


if __name__ == "__main__":
    main()
