"""`fivebar-pin check`: the consistency test of a closed chain."""

from __future__ import annotations

import argparse
import sys


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the parser."""
    parser = commands.add_parser(
        "check",
        help="check a mechanism's loops, mobility, actuation and inertias",
        description="Print a diagnosis; exit code 1 when something is wrong with the mechanism.",
    )
    parser.add_argument("path", help="URDF with sidecar, MJCF, linkage file, folder, or a shipped mechanism's name")
    parser.set_defaults(run=run)


def run(chosen: argparse.Namespace) -> int:
    """Diagnose and print."""
    from fivebar_pin.cli._load import load_any
    from fivebar_pin.diagnosis import diagnose

    diagnosis = diagnose(load_any(chosen.path))
    sys.stdout.write(f"{diagnosis}\n")
    return 0 if diagnosis.ok else 1
