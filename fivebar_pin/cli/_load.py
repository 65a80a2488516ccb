"""Loading what a user names on the command line, as the options say that every command has."""

from __future__ import annotations

import argparse

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


def add_reading(parser: argparse.ArgumentParser) -> None:
    """Add the options about a mechanism that is read from a file."""
    add_gravity(parser)
    parser.add_argument("--fixed-base", action="store_true", help="hold a floating base where it stands")
    parser.add_argument(
        "--tolerance",
        type=float,
        metavar="T",
        help="how far loops of rounded dimensions may stay open [m or rad]",
    )


def load_any(chosen: argparse.Namespace) -> ClosedChain:
    """Load a file, a linkage among them, a folder or a mechanism that ships, as it was chosen."""
    from fivebar_pin.planar.loading import load

    return load(
        chosen.path,
        gravity=chosen.gravity,
        fixed_base=chosen.fixed_base,
        closure_tolerance=0.0 if chosen.tolerance is None else chosen.tolerance,
    )
