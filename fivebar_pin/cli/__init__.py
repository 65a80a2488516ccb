"""The command line: parses, calls the library, prints.

Exit codes: 0 done; 1 something is wrong with the input or the mechanism (one line says what); 2 the command line
itself is wrong; 130 interrupted. A reader of the output that leaves early (`| head`) ends the command quietly with 0.

Nothing is imported here but what Python has at hand: whatever takes time has to be inside `script`, which answers
interrupts.
"""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import NoReturn

__all__ = ["main", "script"]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Args:
        arguments: the words after the program's name; those of the process unless given.
    """
    from fivebar_pin.cli import _command

    return _command.main(arguments)


def script() -> NoReturn:
    """Be the process of the command line: `main`, and one line at an interrupt, at whatever moment it comes."""
    try:
        code = main()
    except KeyboardInterrupt:  # while the command was being imported, or the first interrupt told
        sys.stderr.write("interrupted\n")
        code = 130
    if code == 130:  # at once: what is left to do could be interrupted again, and Python might answer by a signal
        sys.stderr.flush()
        os._exit(code)
    sys.exit(code)
