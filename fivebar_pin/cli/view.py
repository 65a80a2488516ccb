"""`fivebar-pin view`: a mechanism in the browser."""

from __future__ import annotations

import argparse
import os
from typing import TYPE_CHECKING

from fivebar_pin._arrays import integer, number
from fivebar_pin._files import as_path, check_folder, check_new
from fivebar_pin.cli import _tables
from fivebar_pin.cli._load import add_reading, load_any
from fivebar_pin.cli._moving import motion_along
from fivebar_pin.dynamics import inverse_dynamics
from fivebar_pin.errors import AssemblyError, InvalidInputError, SingularityError

if TYPE_CHECKING:
    from fivebar_pin.chain import ClosedChain
    from fivebar_pin.viz import Shown


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser("view", help="show a mechanism in the browser, or write it as one HTML file")
    parser.add_argument(
        "path", help="URDF or SDF with sidecar, MJCF, linkage file, folder, or a shipped mechanism's name"
    )
    parser.add_argument("--motion", metavar="CSV", help="motion of the actuated joints (t, q_*, v_*, a_*)")
    parser.add_argument("--html", metavar="FILE", help="write this HTML file instead of opening the browser")
    parser.add_argument("--speed", type=float, default=1.0, help="playing speed over real time [1]")
    parser.add_argument("--port", type=int, help="port of the live view (loopback only); a free one unless given")
    parser.add_argument("--overwrite", action="store_true", help="replace an existing file")
    add_reading(parser)
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Load, move and show the mechanism."""
    from fivebar_pin import viz

    number("--speed", chosen.speed, positive=True)
    if chosen.port is not None:
        integer("--port", chosen.port, least=0, most=65535)
    if chosen.html is not None:
        file = as_path(chosen.html)
        check_folder(file.parent, overwrite=True)
        if os.path.lexists(file):
            check_new(file, overwrite=chosen.overwrite)
    chain = load_any(chosen)
    unstated = chain.closures and not chain.na and chosen.motion is None
    shown = [_undriven(chain) if unstated else _moved(chain, chosen.motion, stand=True)]
    if chosen.html is not None:
        page = viz.html(chosen.html, shown, speed=chosen.speed, overwrite=chosen.overwrite)
        _tables.written(_tables.console(), (page,))
        return 0
    viz.view(shown, port=chosen.port, speed=chosen.speed, announce=_tables.announce)
    return 0


def _moved(chain: ClosedChain, motion: str | None, *, stand: bool) -> Shown:
    from fivebar_pin.viz import Shown

    trajectory = motion_along(chain, motion, stand=stand)
    return Shown(chain, trajectory, inverse_dynamics(chain, trajectory) if len(trajectory) > 1 else None)


def _undriven(chain: ClosedChain) -> Shown:
    """Let joints sway that could drive a mechanism whose file names no motor; where none can, let it stand."""
    from fivebar_pin.diagnosis import propose_motors

    driven = chain.with_actuated(motor.joint for motor in propose_motors(chain))
    try:
        return _moved(driven, None, stand=False)
    except (AssemblyError, InvalidInputError, SingularityError):
        return _moved(chain, None, stand=True)
