"""Loading what a user names on the command line."""

from __future__ import annotations

import os

from fivebar_pin._files import as_path
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import UnknownNameError


def load_any(path: str) -> ClosedChain:
    """Load a file or folder; a bare name that is no file means a mechanism that ships with the library."""
    from fivebar_pin import io

    where = as_path(path)
    if not os.path.lexists(where) and where.name == path and not where.suffix:
        names = io.shipped()
        if path not in names:
            raise UnknownNameError("file or shipped mechanism", path, names)
        return io.load(io.shipped_path(path))
    return io.load(where)
