"""How functions of the engine are compiled.

Only what Numba documents is used. `fastmath=True` would assume that there is no nan and no infinity; the three flags
here keep both: they may only join operations, pass over signs of zero and multiply by inverses.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba

from fivebar_pin._files.kept_code import kept_code

__all__ = ["compiled", "entry"]

F = TypeVar("F", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "fastmath": {"contract", "nsz", "arcp"}}
_WITHIN: dict[str, Any] = {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_HERE = Path(__file__).resolve().parent
_kept_code = cache(kept_code)  # it reads all sources of the folders
_CONFIG: Any = numba.config  # what the environment says, NUMBA_CACHE_DIR among it


def compiled(function: F) -> F:
    """Compile a function that other compiled functions call."""
    made: F = numba.njit(**_WITHIN, **_OPTIONS)(function)
    return made


def entry(function: F) -> F:
    """Compile a function that Python calls; its machine code is kept for the next process where a place is found."""
    place = _kept_code((_HERE, Path(function.__code__.co_filename).resolve().parent))
    if place is None:
        unkept: F = numba.njit(**_OPTIONS)(function)
        return unkept
    with _caching_in(place):
        made: F = numba.njit(cache=True, **_OPTIONS)(function)
    return made


@contextmanager
def _caching_in(place: Path) -> Iterator[None]:
    """Let Numba keep machine code in a folder."""
    before = _CONFIG.CACHE_DIR
    _CONFIG.CACHE_DIR = str(place)
    try:
        yield
    finally:
        _CONFIG.CACHE_DIR = before
