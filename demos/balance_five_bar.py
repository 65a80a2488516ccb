"""Balance the paper's five-bar in several ways and see what each costs.

python demos/balance_five_bar.py             # live view in the browser
python demos/balance_five_bar.py --headless  # numbers only
"""

import argparse

import fivebar_pin as fb
from fivebar_pin import balancing, paper, viz

REACH = 0.1  # material lies within this distance of each joint [m]
SPEED = 0.5  # playing speed over real time [-]


def moved(chain, motion, start, label):
    trajectory = fb.drive(chain, motion, near=start)
    shown = viz.Shown(chain, trajectory, fb.inverse_dynamics(chain, trajectory), label)
    force, moment, torque = (shown.loads.peak(x) for x in ("shaking_force", "shaking_moment", "torque"))
    print(
        f"{label:28s} mass {chain.mass:.4f} kg   shaking force {force:8.4g} N   "
        f"moment {moment:.4f} N m   largest torque {torque:.4f} N m"
    )
    return shown


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--headless", action="store_true", help="do not open the browser")
    headless = parser.parse_args().headless
    linkage, motion = paper.table_1("I", "unbalanced"), paper.default_motion(samples=201)
    chain, region = linkage.chain(), balancing.Ball(REACH)
    start = linkage.configuration(*motion.q[0], mode=paper.AssemblyMode.LEFT)
    print(fb.balance_conditions(chain, "force"), end="\n\n")
    options = {"region": region, "motions": [motion]}
    lightest = fb.balance(chain, "force", **options)
    easiest = fb.balance(chain, "force", minimise="rms_torque", **options)
    designs = {
        "unbalanced": chain,
        "paper's optimum": paper.balance_mass_centres(paper.table_1("I", "balanced")).linkage.chain(),
        "least added mass, lead discs": balancing.realise(lightest, material="lead").chain,
        "least RMS torque": easiest.chain,
    }
    shown = [moved(c, motion, start, label) for label, c in designs.items()]
    print(f"\nleast added mass {lightest.added_mass:.6f} kg, no design is below {lightest.dual_bound:.6f} kg")
    front = fb.pareto(chain, "force", "added_mass", "rms_torque", 5, **options)
    for mass, torque in front.values:
        print(f"    {mass:.4f} kg added: RMS torque {torque:.4f} N m")
    whole = fb.balance(chain, "dynamic", region=region)
    proof = len(whole.certificate.conflict)
    print(f"\nwith the moment as well: {whole.status}; the proof combines {proof} conditions and bounds")
    if not headless:
        viz.view(shown, speed=SPEED, title="Case I: what balance costs", announce=print)


if __name__ == "__main__":
    main()
