"""The exception family: every error carries its evidence and says what to do about it."""

from __future__ import annotations

import pickle
from collections.abc import Iterable
from itertools import islice
from typing import Any

__all__ = [
    "AssemblyError",
    "FileFormatError",
    "FiveBarPinError",
    "InfeasibleError",
    "InvalidInputError",
    "LeftOutWarning",
    "OutputError",
    "SingularityError",
    "SolverError",
    "UnknownNameError",
]


_MOST_CHARACTERS = 2000
"""Length of a message above which its middle is left out: it has to be read on a terminal."""
_MOST_OF_A_VALUE = 400
"""Characters of a value that a message repeats; the error itself holds the whole value."""
_MOST_NAMES = 40
"""Names that a message lists."""


class FiveBarPinError(Exception):
    """Base of all errors raised on purpose by this library. No message is longer than a terminal can show.

    Every error of the family travels between processes whole: message and evidence. Python would call the class
    again with the message alone, which most of them do not take, and a pool whose worker raised one would hang.
    """

    def __init__(self, *args: object) -> None:
        super().__init__(*(_cut(x, _MOST_CHARACTERS) if isinstance(x, str) else x for x in args))

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (type(self), self.args, {name: _portable(value) for name, value in vars(self).items()})


def _again(kind: type[FiveBarPinError], args: tuple[object, ...], evidence: dict[str, Any]) -> FiveBarPinError:
    """Make an error of another process again, without asking its class how it is made."""
    error = kind.__new__(kind, *args)
    error.args = args
    vars(error).update(evidence)
    return error


def _portable(value: object) -> object:
    """Return the value, or how it is written when it cannot travel itself (a lock, an open file, a generator)."""
    try:
        pickle.loads(pickle.dumps(value))
    except Exception:  # whatever a stranger's object raises there, the error that carries it must arrive
        return repr(value)
    return value


class InvalidInputError(FiveBarPinError, ValueError):
    """A value that cannot be used.

    Attributes:
        name: what the value is called.
        value: the offending value.
        bound: the rule it breaks, in words.
    """

    def __init__(self, name: str, value: object, bound: str, hint: str = "") -> None:
        self.name, self.value, self.bound = name, value, bound
        super().__init__(f"{name} = {_written(value)} but {bound}." + (f" {hint}" if hint else ""))


class UnknownNameError(FiveBarPinError, LookupError):
    """A name that is not known. Lists the known ones.

    Attributes:
        kind: the kind of thing looked for (joint, frame, case, ...).
        name: the name asked for.
        known: the names that exist.
    """

    def __init__(self, kind: str, name: object, known: Iterable[str]) -> None:
        import difflib

        self.kind, self.name, self.known = kind, name, tuple(known)
        close = difflib.get_close_matches(str(name), self.known, n=1)
        meant = f" Did you mean {close[0]!r}?" if close else ""
        super().__init__(f"Unknown {kind} {_written(name)}; known: {_listed(self.known)}.{meant}")


class AssemblyError(FiveBarPinError):
    """The loops cannot be closed.

    Attributes:
        closure: name of the closure that stays open the most.
        residual: how far it stays open [m or rad].
        sample: index of the motion sample, or None.
        time: its time [s], or None.
    """

    def __init__(
        self,
        message: str,
        *,
        closure: str,
        residual: float,
        sample: int | None = None,
        time: float | None = None,
    ) -> None:
        self.closure, self.residual, self.sample, self.time = closure, residual, sample, time
        super().__init__(message)


class SingularityError(FiveBarPinError):
    """The passive coordinates are not determined by the actuated ones (type 2 singularity).

    Attributes:
        sigma: smallest singular value of the scaled passive closure Jacobian [-].
        sample: index of the motion sample, or None.
        time: its time [s], or None.
    """

    def __init__(self, message: str, *, sigma: float, sample: int | None = None, time: float | None = None) -> None:
        self.sigma, self.sample, self.time = sigma, sample, time
        super().__init__(message)


class InfeasibleError(FiveBarPinError):
    """No design fulfils the conditions within the bounds."""


class SolverError(FiveBarPinError):
    """A solver did not reach its tolerance.

    Attributes:
        residual: the residual it stopped at.
        tolerance: the one it had to reach.
    """

    def __init__(self, message: str, *, residual: float = float("nan"), tolerance: float = float("nan")) -> None:
        self.residual, self.tolerance = residual, tolerance
        super().__init__(message)


class FileFormatError(FiveBarPinError):
    """A file that cannot be read as what it should be.

    Attributes:
        path: the file.
    """

    def __init__(self, path: object, problem: str) -> None:
        self.path = str(path)
        super().__init__(f"{path}: {problem}")


class OutputError(FiveBarPinError):
    """An output that cannot be written, or would overwrite something.

    Attributes:
        path: the file or folder.
    """

    def __init__(self, path: object, problem: str) -> None:
        self.path = str(path)
        super().__init__(f"{path}: {problem}")


class LeftOutWarning(UserWarning):
    """A file states things that do not move the mechanism (sensors, cameras), and the chain goes without them."""


def _written(value: object) -> str:
    """Return how a value is written, on one line and no longer than somebody would read."""
    try:
        text = repr(value)
    except Exception:  # an integer of too many digits, a stranger's object: the error that carries it must be told
        text = f"({type(value).__name__} that cannot be written)"
    return _cut(" ".join(text.split()) if "\n" in text else text, _MOST_OF_A_VALUE)


def _listed(names: tuple[str, ...]) -> str:
    shown = ", ".join(_cut(str(name), _MOST_OF_A_VALUE) for name in islice(names, _MOST_NAMES))
    more = f" ... and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
    return (shown or "(none)") + more


def _cut(text: str, most: int) -> str:
    """Return a text with its middle left out where it is too long; what to do stands at the end."""
    if len(text) <= most:
        return text
    return f"{text[: most // 2]} ... ({len(text) - most} more characters) ... {text[len(text) - most // 2 :]}"
