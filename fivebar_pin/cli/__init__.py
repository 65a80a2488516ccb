"""The command line: parses, calls the library, prints.

Exit codes: 0 done; 1 something is wrong with the input or the mechanism (one line says what); 2 the command line
itself is wrong; 130 interrupted.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from importlib.metadata import version

from fivebar_pin.errors import FiveBarPinError

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Args:
        arguments: the words after the program's name; those of the process unless given.
    """
    parser = _parser()
    chosen = parser.parse_args(arguments)
    try:
        return int(chosen.run(chosen))
    except FiveBarPinError as error:
        sys.stderr.write(f"fivebar-pin {chosen.command}: {error}\n")
        return 1
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        return 130
    except BrokenPipeError:
        sys.stderr.close()
        return 0


def _parser() -> argparse.ArgumentParser:
    from fivebar_pin.cli import balance, check, demo, loads, score, simulate, view

    parser = argparse.ArgumentParser(
        prog="fivebar-pin",
        description="Closed-chain mechanisms on Pinocchio: check them, look at them, balance them.",
        epilog="Exit codes: 0 done, 1 something is wrong with the input or the mechanism, 2 wrong command line.",
    )
    parser.add_argument("--version", action="version", version=f"fivebar-pin {version('fivebar-pin')}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for module in (demo, check, loads, simulate, balance, score, view):
        module.register(commands)
    return parser
