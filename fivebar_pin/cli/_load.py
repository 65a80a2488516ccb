"""Loading what a user names on the command line, under the gravity that is asked for."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from fivebar_pin.chain import ClosedChain


def add_gravity(parser: argparse.ArgumentParser) -> None:
    """Add the option, which means the same in every command that has it."""
    parser.add_argument(
        "--gravity",
        type=float,
        nargs=3,
        metavar=("X", "Y", "Z"),
        help="gravity the mechanism is under, instead of the file's [m/s2]",
    )


def load_any(path: str, gravity: Sequence[float] | None = None) -> ClosedChain:
    """Load a file, a linkage among them, a folder or a mechanism that ships."""
    from fivebar_pin.planar.loading import load

    return load(path, gravity=gravity)
