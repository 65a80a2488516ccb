"""`fivebar-pin loads`: torques, what shakes the frame and what it carries, of any mechanism along a motion."""

from __future__ import annotations

import argparse
from pathlib import Path

from fivebar_pin import motion as laws
from fivebar_pin._arrays import figures
from fivebar_pin._files import check_folder, write_set
from fivebar_pin.chain import ClosedChain
from fivebar_pin.cli import _output, _tables
from fivebar_pin.cli._load import add_reading, load_any
from fivebar_pin.cli._moving import motion_along
from fivebar_pin.dynamics import Loads, inverse_dynamics
from fivebar_pin.trajectory import Trajectory


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser("loads", help="torques, what shakes the frame and what it carries, along a motion")
    parser.add_argument("path", help="URDF with sidecar, MJCF, linkage file, folder, or a shipped mechanism's name")
    parser.add_argument(
        "--motion", metavar="CSV", help="motion of the actuated joints (t, q_*, v_*, a_*); unless given, they sway"
    )
    parser.add_argument("--about", type=float, nargs=3, default=(0.0, 0.0, 0.0), metavar=("X", "Y", "Z"))
    add_reading(parser)
    parser.add_argument("--out", metavar="FOLDER", help="write the curves, plots and an animation there")
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist already")
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Move the mechanism and print what it takes."""

    folder = check_folder(chosen.out, overwrite=chosen.overwrite) if chosen.out is not None else None
    chain = load_any(chosen)
    trajectory = motion_along(chain, chosen.motion)
    loads = inverse_dynamics(chain, trajectory, about=chosen.about)
    files: tuple[Path, ...] = ()
    if folder is not None:
        motion = laws.from_file(chosen.motion, chain.actuated) if chosen.motion is not None else None
        files = write_set(folder, _files(chain, trajectory, loads, motion), overwrite=chosen.overwrite)
    console = _tables.console()
    _print(console, chain, trajectory, loads)
    _tables.written(console, files)
    return 0


def _print(console: object, chain: ClosedChain, trajectory: Trajectory, loads: Loads) -> None:
    t = trajectory.t
    rows = [[curve.name, *curve.cells] for curve in _output.curves(chain, loads, frame=loads.loaded)]
    _tables.table(console, f"{chain.name}: {len(t)} samples, {t[-1] - t[0]:g} s", ("", "peak", "RMS"), rows)  # type: ignore[arg-type]
    rows = [
        ["closure residual [m or rad]", figures(trajectory.worst_closure)],
        ["motor power against rate of energy", figures(loads.power_residual())],
        ["shaking and frame wrench against sums over bodies", figures(loads.momentum_residual())],
        ["travel of the mass centre [m]", figures(loads.peak("travel"))],
    ]
    _tables.table(console, "Checks", ("", ""), rows)  # type: ignore[arg-type]


def _files(
    chain: ClosedChain, trajectory: Trajectory, loads: Loads, motion: laws.Motion | None
) -> dict[str, str | bytes]:
    from fivebar_pin import viz

    columns = _output.motion_columns(chain, trajectory) + _output.load_columns(chain, loads)
    return {
        "loads.csv": _output.columns_text(columns),
        **viz.plots.png(_output.all_figures(chain, trajectory, loads, motion)),
        "animation.html": viz.page([viz.Shown(chain, trajectory, loads)], title=chain.name),
    }
