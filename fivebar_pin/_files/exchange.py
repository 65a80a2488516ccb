"""Two names that trade what they name in one step, as no function of Python's does."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

__all__ = ["exchange"]

_AT_FDCWD = -100  # Linux: names are relative to the working directory
_RENAME_EXCHANGE = 2  # flag of renameat2 (Linux)
_RENAME_SWAP = 2  # flag of renamex_np (macOS)


def exchange(one: Path, other: Path) -> bool:
    """Let two names of one file system trade places; at no moment is either missing.

    Returns:
        Whether it was done; False where the system or the file system cannot.
    """
    call = _call()
    return call is not None and call(os.fsencode(one), os.fsencode(other)) == 0


@cache
def _call() -> Callable[[bytes, bytes], int] | None:
    if os.name != "posix":
        return None
    libc = ctypes.CDLL(None)
    if sys.platform == "linux" and hasattr(libc, "renameat2"):
        swap = libc.renameat2
        return lambda one, other: int(swap(_AT_FDCWD, one, _AT_FDCWD, other, ctypes.c_uint(_RENAME_EXCHANGE)))
    if sys.platform == "darwin" and hasattr(libc, "renamex_np"):
        rename = libc.renamex_np
        return lambda one, other: int(rename(one, other, ctypes.c_uint(_RENAME_SWAP)))
    return None
