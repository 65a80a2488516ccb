"""Loading what a user names on the command line."""

from __future__ import annotations

from pathlib import Path

from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import UnknownNameError


def load_any(path: str) -> ClosedChain:
    """Load a file or folder; a bare name that is no file means a mechanism that ships with the library."""
    from fivebar_pin import io

    if not Path(path).exists() and Path(path).name == path and not Path(path).suffix:
        names = io.shipped()
        if path not in names:
            raise UnknownNameError("file or shipped mechanism", path, names)
        return io.load(io.shipped_path(path))
    return io.load(path)
