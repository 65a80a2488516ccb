"""`fivebar-pin simulate`: let a mechanism move by itself."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from fivebar_pin._arrays import figures, integer
from fivebar_pin._files import check_folder, write_set
from fivebar_pin.chain import ClosedChain
from fivebar_pin.cli import _output, _tables
from fivebar_pin.cli._load import add_reading, load_any
from fivebar_pin.dynamics import energy_balance
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.simulation import simulate

_LONGEST = 1e9  # time to simulate [s]; a progress bar cannot even show more


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser("simulate", help="integrate the motion of a mechanism under gravity and given torques")
    parser.add_argument("path", help="URDF with sidecar, MJCF, linkage file, folder, or a shipped mechanism's name")
    parser.add_argument("--time", type=float, default=2.0, help="time to simulate [2 s]")
    parser.add_argument("--samples", type=int, default=201, help="output samples [201]")
    parser.add_argument("--torque", type=float, nargs="+", help="constant torque of each actuated joint [0]")
    add_reading(parser)
    parser.add_argument("--out", metavar="FOLDER", help="write the motion and an animation there")
    parser.add_argument("--overwrite", action="store_true", help="replace files that exist already")
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Start at rest in the named (or any assembled) configuration and integrate."""
    from rich.progress import Progress

    from fivebar_pin import viz
    from fivebar_pin.cli._moving import standing

    if not 0.0 < chosen.time <= _LONGEST:
        raise InvalidInputError("--time", chosen.time, f"must be positive and finite, {_LONGEST:g} at most [s]")
    integer("--samples", chosen.samples, least=2, most=_output.MOST_SAMPLES)
    folder = check_folder(chosen.out, overwrite=chosen.overwrite) if chosen.out is not None else None
    chain = load_any(chosen)
    q0, t = standing(chain), np.linspace(0.0, chosen.time, chosen.samples)
    torque = _torque(chain, chosen.torque)
    console = _tables.console()
    with Progress(console=_tables.progress(), transient=True) as bar:
        task = bar.add_task("integrating", total=1.0)
        trajectory = simulate(
            chain, q0, np.zeros(chain.nv), torque, t, progress=lambda x: bar.update(task, completed=x)
        )
    balance = energy_balance(chain, trajectory, torque=torque)
    files: tuple[Path, ...] = ()
    if folder is not None:
        motion = _output.columns_text(_output.motion_columns(chain, trajectory))
        page = viz.page([viz.Shown(chain, trajectory)])
        files = write_set(folder, {"motion.csv": motion, "animation.html": page}, overwrite=chosen.overwrite)
    rows = [
        ["closure residual [m or rad]", figures(trajectory.worst_closure)],
        ["fastest joint [rad/s or m/s]", figures(float(np.abs(trajectory.v).max()))],
        ["change of total energy, relative", figures(balance.drift())],
        ["supplied power against rate of energy, relative", figures(balance.residual())],
    ]
    _tables.table(console, f"{chain.name}: {chosen.time:g} s from rest", ("", ""), rows)
    if not np.any(trajectory.v):
        console.print(f"  It does not move: {_why(chain, torque)}", markup=False)
    _tables.written(console, files)
    return 0


def _torque(chain: ClosedChain, given: list[float] | None) -> list[float] | None:
    """Return one torque for each motor.

    Raises:
        InvalidInputError: another number of them.
    """
    if given is not None and len(given) != chain.na:
        motors = ", ".join(chain.actuated) or "none"
        raise InvalidInputError("--torque", given, f"must be {chain.na} number(s), one for each motor ({motors})")
    return given


def _why(chain: ClosedChain, torque: list[float] | None) -> str:
    """Say what a mechanism that stays at rest lacks."""
    if chain.springs:
        names = ", ".join(spring.name for spring in chain.springs)
        return f"weight, torque, friction and springs ({names}) hold each other. Pass --torque, or another --gravity."
    if not np.any(chain.model.gravity.linear) and not np.any(torque or 0.0):
        return "it starts at rest, and there is no gravity and no torque. Pass --gravity X Y Z or --torque."
    if np.any(chain.model.upperDryFrictionLimit):
        return "dry friction holds it, or its weight is balanced. Pass a larger --torque, or another --gravity."
    return "its weight is balanced where it starts, or carried by the frame. Pass --torque, or another --gravity."
