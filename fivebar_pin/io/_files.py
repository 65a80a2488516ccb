"""Reading files within bounds, and writing them whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from fivebar_pin.errors import FileFormatError, InvalidInputError, OutputError

__all__ = ["MAX_BYTES", "as_path", "output_folder", "read_bounded", "write_all"]

MAX_BYTES = 32 * 1024 * 1024
"""Size above which a mechanism file is not read [bytes]."""


def as_path(path: object) -> Path:
    """Return a path, or say that this is none."""
    if not isinstance(path, (str, os.PathLike)) or not str(path) or "\0" in str(path):
        raise InvalidInputError("path", path, "must be the name of a file or folder")
    return Path(os.fsdecode(path))


def read_bounded(path: Path, max_bytes: int = MAX_BYTES) -> bytes:
    """Return the content of a regular file of at most `max_bytes` bytes.

    Raises:
        FileFormatError: missing, a folder or device, larger than the bound, or unreadable.
    """
    try:
        if not path.exists():
            raise FileFormatError(path, "there is no such file")
        if not path.is_file():
            raise FileFormatError(path, "is a folder or a device, not a file")
        with path.open("rb") as stream:
            content = stream.read(max_bytes + 1)
    except OSError as error:
        raise FileFormatError(path, f"cannot be read ({error.strerror or error})") from error
    if len(content) > max_bytes:
        raise FileFormatError(path, f"is larger than {max_bytes} bytes; pass a larger max_bytes if this is intended")
    if not content.strip():
        raise FileFormatError(path, "is empty")
    return content


def output_folder(folder: object) -> Path:
    """Return a folder that exists, made if need be.

    Raises:
        OutputError: it is a file, or cannot be made.
    """
    target = as_path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise OutputError(target, "is a file; name a folder to write into") from error
    except OSError as error:
        raise OutputError(target, f"cannot be made ({error.strerror or error})") from error
    return target


def write_all(files: dict[Path, str], *, overwrite: bool) -> tuple[Path, ...]:
    """Write several text files: first each to a temporary file beside it, then all renamed.

    Raises:
        OutputError: a file exists and `overwrite` is off, or the folder cannot be written.
    """
    for path in files:
        if path.exists() and not overwrite:
            raise OutputError(path, "exists already; pass overwrite=True to replace it, or choose another name")
        if path.is_dir():
            raise OutputError(path, "is a folder; a file cannot take its place")
    staged: dict[Path, str] = {}
    try:
        for path, text in files.items():
            handle, staged[path] = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
            with os.fdopen(handle, "w", encoding="utf-8", newline="\n") as stream:
                stream.write(text)
            os.chmod(staged[path], 0o644)
        for path in files:
            os.replace(staged[path], path)
    except OSError as error:
        raise OutputError(error.filename or path, f"cannot be written ({error.strerror or error})") from error
    finally:
        for temporary in staged.values():
            if os.path.exists(temporary):
                os.unlink(temporary)
    return tuple(files)
