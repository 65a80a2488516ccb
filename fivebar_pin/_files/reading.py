"""Reading files within bounds."""

from __future__ import annotations

import os
from pathlib import Path

from fivebar_pin.errors import FileFormatError, InvalidInputError

__all__ = ["MAX_BYTES", "as_path", "read_bounded"]

MAX_BYTES = 32 * 1024 * 1024
"""Size above which a file is not read [bytes]."""


def as_path(path: object) -> Path:
    """Return a path, or say that this is none."""
    if not isinstance(path, (str, os.PathLike)) or not str(path) or "\0" in str(path):
        raise InvalidInputError("path", path, "must be the name of a file or folder")
    try:
        return Path(os.fsdecode(os.fsencode(path)))
    except UnicodeEncodeError as error:
        raise InvalidInputError("path", path, "holds half a character (a lone surrogate), which no name has") from error


def read_bounded(path: Path, max_bytes: int = MAX_BYTES, *, may_be_empty: bool = False) -> bytes:
    """Return the content of a regular file of at most `max_bytes` bytes.

    Raises:
        FileFormatError: missing, a folder or device, larger than the bound, or unreadable.
    """
    try:
        if not path.exists():
            raise FileFormatError(path, "cannot be read: there is no such file")
        if not path.is_file():  # a pipe would wait for a writer, a device might never end
            raise FileFormatError(path, "cannot be read: is a folder, a pipe or a device, not a file")
        with open(path, "rb", opener=_without_waiting) as stream:
            content = stream.read(max_bytes + 1) or b""
    except OSError as error:
        raise FileFormatError(path, f"cannot be read ({error.strerror or error})") from error
    if len(content) > max_bytes:
        raise FileFormatError(path, f"is larger than {max_bytes} bytes; pass a larger max_bytes if this is intended")
    if not content.strip() and not may_be_empty:
        raise FileFormatError(path, "is empty")
    return content


def _without_waiting(path: str, flags: int) -> int:
    """Open so that no read waits for what never comes, as those of some files of the system do."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
