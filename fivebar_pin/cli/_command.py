"""The command line: parses, calls the library, prints.

Exit codes: 0 done; 1 something is wrong with the input or the mechanism (one line says what); 2 the command line
itself is wrong; 130 interrupted. A reader of the output that leaves early (`| head`) ends the command quietly with 0.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import warnings
from collections.abc import Sequence
from importlib.metadata import version
from typing import NoReturn

from fivebar_pin.errors import FiveBarPinError

__all__ = ["main"]

_WITHOUT_ENGINE = ("new",)
_MOST_ON_A_LINE = 2000
"""Characters of an error message that are printed [-]."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Args:
        arguments: the words after the program's name; those of the process unless given.
    """
    _open_streams()
    program = "fivebar-pin"
    try:
        try:
            chosen = _parser().parse_args(arguments)
            program = f"fivebar-pin {chosen.command}"
            return _run(chosen)
        finally:
            sys.stdout.flush()
    except FiveBarPinError as error:
        return _refuse(program, str(error))
    except KeyboardInterrupt:
        _say("interrupted")
        return 130
    except BrokenPipeError:
        _drop_output()
        return 0
    except MemoryError as error:
        return _refuse(program, f"there is not enough memory for this ({error}); ask for fewer samples or designs")
    except OverflowError as error:  # Python's own numbers raise where arrays become infinite
        return _refuse(program, f"the numbers given are beyond what can be computed ({error})")
    except OSError as error:  # those of files are told as errors of the family: what is left is the output stream
        _drop_output()
        return _refuse(program, f"the output cannot be written ({error.strerror or error})")


class _Parser(argparse.ArgumentParser):
    """A parser that says on one line of bounded length what is wrong, below the usage."""

    def error(self, message: str) -> NoReturn:
        self.print_usage(sys.stderr)
        _say(f"{self.prog}: error: {message}")
        self.exit(2)


def _parser() -> argparse.ArgumentParser:
    from fivebar_pin.cli import balance, check, close, conditions, demo, loads, new, pareto, score, simulate, view

    parser = _Parser(
        prog="fivebar-pin",
        description="Closed-chain mechanisms on Pinocchio: check them, look at them, balance them.",
        epilog="Exit codes: 0 done, 1 something is wrong with the input or the mechanism, 2 wrong command line, "
        "130 interrupted (Ctrl-C). Files are written all or none.",
    )
    parser.add_argument("--version", action="version", version=f"fivebar-pin {version('fivebar-pin')}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for module in (demo, new, check, close, loads, simulate, conditions, balance, pareto, score, view):
        module.register(commands)
    return parser


def _run(chosen: argparse.Namespace) -> int:
    import numpy as np

    from fivebar_pin.cli._first_use import compile_once

    if chosen.command not in _WITHOUT_ENGINE:
        compile_once()
    # the library refuses results that are not finite; numpy's warnings only add lines
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.showwarning = lambda message, *_: _say(f"fivebar-pin {chosen.command}: note: {message}")
        return int(chosen.run(chosen))


def _refuse(program: str, message: str) -> int:
    _say(f"{program}: {message}")
    return 1


def _say(message: str) -> None:
    """Write one line to the error stream, whatever line breaks, control signs and half characters it holds."""
    line = "".join(c if c.isprintable() else repr(c)[1:-1] for c in " ".join(message.split()))
    if len(line) > _MOST_ON_A_LINE:
        half = _MOST_ON_A_LINE // 2
        line = f"{line[:half]} ... ({len(line) - 2 * half} more characters) ... {line[-half:]}"
    with contextlib.suppress(OSError, ValueError):
        sys.stderr.write(f"{line}\n")


def _open_streams() -> None:
    """Give a process that was started with closed streams some, so that no file of ours takes their numbers."""
    if sys.stdout is None or sys.stderr is None:
        while os.open(os.devnull, os.O_RDWR) <= 2:
            pass
        sys.stdout = sys.stdout or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
        sys.stderr = sys.stderr or open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a sign that the terminal cannot show must not end the work
            stream.reconfigure(errors="backslashreplace")


def _drop_output() -> None:
    """Let what is still buffered for a reader that has gone vanish: at the end Python would try again."""
    with contextlib.suppress(OSError, ValueError, AttributeError):  # no file stands behind the output
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
