"""Compare the paper's complement u, as printed and repaired, with the complement N of Pinocchio's Jacobian.

python demos/u_against_n.py             # and show the linkage in the browser
python demos/u_against_n.py --headless  # numbers only
"""

import argparse

import fivebar_pin as fb
from fivebar_pin import paper, viz


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--headless", action="store_true", help="do not open the browser")
    headless = parser.parse_args().headless
    motion = paper.default_motion(samples=201)
    shown = []
    for case in ("I", "II"):
        linkage = paper.table_1(case, "unbalanced")
        chain = linkage.chain()
        for mode in paper.AssemblyMode:
            print(f"\nCase {case}, {paper.compare_complements(linkage, motion, mode=mode)}")
            start = linkage.configuration(*motion.q[0], mode=mode)
            shown.append(viz.Shown(chain, fb.drive(chain, motion, near=start), label=f"{case}, O3 {mode.value}"))
    print(
        "\nThe printed u carries the total ratios r_theta, r_phi in the column of psi: its twist u q' is right, its\n"
        "columns are not, so A u, u^T M u and the torque are wrong. With the partial derivatives of theta and phi in\n"
        "both columns u spans the same space as N, column by column."
    )
    if not headless:
        viz.view(shown, speed=0.5, title="Both cases, both assembly modes", announce=print)


if __name__ == "__main__":
    main()
