"""`fivebar-pin check`: the consistency test of a closed chain."""

from __future__ import annotations

import argparse
import sys

from fivebar_pin.chain import ClosedChain
from fivebar_pin.cli._load import add_reading, load_any


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser(
        "check",
        help="check a mechanism's loops, mobility, actuation and inertias",
        description="Print a diagnosis; exit code 1 when something is wrong with the mechanism.",
    )
    parser.add_argument("path", help="URDF with sidecar, MJCF, linkage file, folder, or a shipped mechanism's name")
    parser.add_argument(
        "--motion", metavar="CSV", help="compare the two roads of inverse dynamics along it (t, q_*, ...)"
    )
    add_reading(parser)
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Diagnose and print."""
    from fivebar_pin.diagnosis import diagnose

    chain = load_any(chosen)
    diagnosis = diagnose(chain)
    sys.stdout.write(f"{diagnosis}\n")
    if chosen.motion is not None:
        sys.stdout.write(_along(chain, chosen.motion))
    return 0 if diagnosis.ok else 1


def _along(chain: ClosedChain, file: str) -> str:
    """Say how far the two roads of inverse dynamics lie apart along a motion."""
    from fivebar_pin.cli._moving import motion_along
    from fivebar_pin.diagnosis.report import apart_in_words
    from fivebar_pin.dynamics.inverse import roads_apart

    trajectory = motion_along(chain, file)
    return f"along the motion, {len(trajectory)} samples: torques {apart_in_words(roads_apart(chain, trajectory))}\n"
