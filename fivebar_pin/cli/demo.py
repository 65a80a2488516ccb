"""`fivebar-pin demo`: the paper's five-bar from its table to a balanced linkage moving in the browser."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fivebar_pin import motion as laws
from fivebar_pin._arrays import Array, figures, integer, number
from fivebar_pin._files import check_folder, write_set
from fivebar_pin.chain import ClosedChain
from fivebar_pin.cli import _output, _tables
from fivebar_pin.cli._load import add_gravity
from fivebar_pin.dynamics import Loads, inverse_dynamics
from fivebar_pin.kinematics import drive
from fivebar_pin.motion import Motion
from fivebar_pin.trajectory import Trajectory

if TYPE_CHECKING:
    from rich.console import Console

    from fivebar_pin.paper import AssemblyMode, FiveBar, Solution

FORCES = ("f01", "f12", "f23", "f34", "f40")


@dataclass(frozen=True, slots=True, eq=False)
class _Run:
    """One linkage taken along both roads."""

    label: str
    linkage: FiveBar
    chain: ClosedChain
    trajectory: Trajectory
    loads: Loads
    closed: Solution

    def curves(self, *, frame: bool) -> list[_output.Curve]:
        """Return torques, what acts on the frame (with `frame` what it carries, too) and the joint forces."""
        return _output.curves(self.chain, self.loads, frame=frame) + [
            _output.Curve(f"joint force {f} [N]", self.closed.joint_forces[:, k], self.loads.scale("frame_force"))
            for k, f in enumerate(FORCES)
        ]


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser(
        "demo",
        help="balance the paper's five-bar and show it before and after",
        description="Balance the paper's five-bar; print, plot, animate and write what came out.",
    )
    parser.add_argument("--case", default="I", help="parameter set of Table 1, I or II [I]")
    parser.add_argument(
        "--reading",
        choices=("printed", "corrected"),
        default="printed",
        help="balanced masses of case II: as printed, or with m2 = 0.24 and m3 = 0.31 kg for 0.024 and 0.031 [printed]",
    )
    parser.add_argument("--mode", choices=("left", "right"), default="left", help="assembly mode [left]")
    parser.add_argument("--motion", metavar="CSV", help="motion of psi and gamma (t, q_*, v_*, a_*)")
    parser.add_argument("--samples", type=int, default=201, help="samples of the default motion [201]")
    parser.add_argument("--period", type=float, default=1.0, help="period of the default motion [1.0 s]")
    add_gravity(parser)
    parser.add_argument("--out", default="results", help="folder for everything that is written [results]")
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist already")
    parser.add_argument("--speed", type=float, default=0.5, help="playing speed of the animation [0.5]")
    parser.add_argument("--view", action="store_true", help="open the live view when done (Ctrl-C ends it)")
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Do the whole job."""
    from fivebar_pin import paper, viz

    number("speed", chosen.speed, positive=True)
    integer("--samples", chosen.samples, least=2, most=_output.MOST_SAMPLES)
    mode = paper.AssemblyMode[chosen.mode.upper()]
    motion = (
        laws.from_file(chosen.motion, ("psi", "gamma"))
        if chosen.motion is not None
        else paper.default_motion(samples=chosen.samples, period=chosen.period)
    )
    unbalanced = paper.table_1(chosen.case, "unbalanced")
    optimum = paper.balance_mass_centres(paper.table_1(chosen.case, "balanced", reading=chosen.reading))
    runs = [
        _moved(label, linkage, motion, mode, chosen.gravity or (0.0, 0.0, 0.0))
        for label, linkage in (("unbalanced", unbalanced), ("balanced", optimum.linkage))
    ]
    folder = check_folder(chosen.out, overwrite=chosen.overwrite)
    files = write_set(folder, _files(folder, runs, motion, chosen), overwrite=chosen.overwrite)
    console = _tables.console()
    _print_balance(console, chosen.case, unbalanced, optimum)
    _print_comparison(console, runs)
    _print_checks(console, runs, optimum)
    console.print("Written:")
    _tables.written(console, files)
    if chosen.view:
        viz.view(_shown(runs), speed=chosen.speed, title=_title(chosen.case), announce=_tables.announce)
    return 0


def _moved(label: str, linkage: FiveBar, motion: Motion, mode: AssemblyMode, gravity: Any) -> _Run:
    from fivebar_pin import paper

    closed = paper.solve(linkage, motion, mode=mode, gravity=gravity)
    chain = linkage.chain(gravity=gravity)
    trajectory = drive(chain, motion, near=linkage.configuration(*motion.q[0], mode=mode))
    return _Run(label, linkage, chain, trajectory, inverse_dynamics(chain, trajectory), closed)


def _title(case: str) -> str:
    return f"Five-bar linkage, case {case}: unbalanced and force balanced"


def _print_balance(console: Console, case: str, unbalanced: FiveBar, optimum: Any) -> None:
    linkage = optimum.linkage
    rows = [
        (
            f"link {i + 1}",
            figures(unbalanced.masses[i]),
            figures(unbalanced.rho[i]),
            figures(linkage.masses[i]),
            f"{linkage.rho[i]:.9f}",
            f"{round(linkage.alpha[i], 9) + 0.0:.9f}",
        )
        for i in range(4)
    ]
    title = f"Case {case}: mass centres that balance the shaking force (closest to mid-link, masses kept)"
    _tables.table(console, title, ("", "before: m [kg]", "rho", "after: m [kg]", "rho", "alpha [rad]"), rows)


def _print_comparison(console: Console, runs: list[_Run]) -> None:
    frame = any(r.loads.loaded for r in runs)
    columns = [r.curves(frame=frame) for r in runs]
    rows = [[same[0].name, *(cell for curve in same for cell in curve.cells)] for same in zip(*columns, strict=True)]
    headings = ("", "before: peak", "RMS", "after: peak", "RMS")
    _tables.table(console, "Before and after", headings, rows)
    rows = [
        ["travel of the mass centre [m]", *(figures(r.loads.peak("travel")) for r in runs)],
        ["largest residual of (60)-(69) [-]", *(figures(_condition_residual(r.linkage)) for r in runs)],
    ]
    _tables.table(console, "Balance", ("", *(r.label for r in runs)), rows)


def _condition_residual(linkage: FiveBar) -> float:
    from fivebar_pin import paper

    return paper.conditions(linkage).worst


def _print_checks(console: Console, runs: list[_Run], optimum: Any) -> None:
    rows = [
        ["closure residual [m]", *(figures(r.trajectory.worst_closure) for r in runs)],
        ["closed form against Pinocchio, torque", *(_relative(r.closed.torque, r.loads.torque) for r in runs)],
        [
            "closed form against Pinocchio, moment",
            *(_relative(r.closed.shaking_moment, r.loads.shaking_moment) for r in runs),
        ],
        ["motor power against rate of energy", *(figures(r.loads.power_residual()) for r in runs)],
        ["shaking and frame wrench against sums over bodies", *(figures(r.loads.momentum_residual()) for r in runs)],
        ["optimality (KKT) residual", "", figures(optimum.kkt_residual)],
    ]
    _tables.table(console, "Checks (relative unless a unit is given)", ("", *(r.label for r in runs)), rows)


def _relative(x: Array, reference: Array) -> str:
    return figures(float(np.abs(x - reference).max() / np.abs(reference).max()))


def _shown(runs: list[_Run]) -> list[Any]:
    from fivebar_pin.viz import Shown

    return [Shown(r.chain, r.trajectory, r.loads, r.label) for r in runs]


def _files(folder: Path, runs: list[_Run], motion: Motion, chosen: argparse.Namespace) -> dict[str, str | bytes]:
    from fivebar_pin import viz
    from fivebar_pin.io._save import texts

    files: dict[str, str | bytes] = {}
    for r in runs:
        files.update(texts(r.chain, folder, name=f"five_bar_{r.label}", formats=("urdf",)))
    files["results.csv"] = _table(runs, motion)
    files.update(viz.plots.png(_figures(runs, motion)))
    files["animation.html"] = viz.page(_shown(runs), speed=chosen.speed, title=_title(chosen.case))
    return files


def _figures(runs: list[_Run], motion: Motion) -> dict[str, Any]:
    """Plots that stand for figures 5 and 6 (motion), 7, 8, 10, 11 (torques), 9 and 12 (shaking force) of the paper."""
    from fivebar_pin.viz import plots

    loads, t = {r.label: r.loads for r in runs}, motion.t
    return {
        "motion": plots.motion(motion, ("psi", "gamma"), title="Motion of the motors"),
        "joint_forces": plots.forces({r.label: r.closed.joint_forces for r in runs}, FORCES, t=t),
        **_output.load_figures(loads, t),
    }


def _table(runs: list[_Run], motion: Motion) -> str:
    """Return every curve in one table with named columns and units."""
    columns: list[tuple[str, Array]] = [("t [s]", motion.t)]
    for k, name in enumerate(("psi", "gamma")):
        columns += [(f"{name} [rad]", motion.q[:, k]), (f"d{name} [rad/s]", motion.v[:, k])]
        columns.append((f"dd{name} [rad/s2]", motion.a[:, k]))
    for r in runs:
        vectors = {"F {} [N]": r.loads.shaking_force[:, :2], "frame F {} [N]": r.loads.frame_force[:, :2]}
        vectors |= {"com {} [m]": r.loads.com[:, :2]}
        vectors |= {f"{f} {{}} [N]": r.closed.joint_forces[:, k] for k, f in enumerate(FORCES)}
        columns += [
            (f"{r.label} {x} [rad]", r.closed.angles[:, k]) for k, x in enumerate(("psi", "theta", "phi", "gamma"))
        ]
        columns += [(f"{r.label} tau_{x} [N m]", r.loads.torque[:, k]) for k, x in enumerate(("psi", "gamma"))]
        columns.append((f"{r.label} M_O1 [N m]", r.loads.shaking_moment[:, 2]))
        columns.append((f"{r.label} frame M_O1 [N m]", r.loads.frame_moment[:, 2]))
        for name, values in vectors.items():
            columns += [(f"{r.label} {name.format(axis)}", values[:, k]) for k, axis in enumerate("xy")]
    return _output.columns_text(columns)
