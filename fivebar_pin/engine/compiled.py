"""How functions of the engine are compiled.

Only what Numba documents is used. `fastmath=True` would assume that there is no nan and no infinity; the three flags
here keep both: they may only join operations, pass over signs of zero and multiply by inverses.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numba

from fivebar_pin.engine.places import Places

__all__ = ["compiled", "entry"]

F = TypeVar("F", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {
    "pipeline_class": Places,
    "error_model": "numpy",
    "nogil": True,
    "fastmath": {"contract", "nsz", "arcp"},
}
_WITHIN: dict[str, Any] = {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_HERE = Path(__file__).resolve().parent
_CONFIG: Any = numba.config  # what the environment says, NUMBA_CACHE_DIR among it


def compiled(function: F) -> F:
    """Compile a function that other compiled functions call."""
    made: F = numba.njit(**_WITHIN, **_OPTIONS)(function)
    return made


def entry(function: F) -> F:
    """Compile a function that Python calls; its machine code is kept for the next process where a place is found."""
    place = _cache(Path(function.__code__.co_filename).resolve().parent)
    if place is None:
        unkept: F = numba.njit(**_OPTIONS)(function)
        return unkept
    with _caching_in(place):
        made: F = numba.njit(cache=True, **_OPTIONS)(function)
    return made


def _cache(home_of_function: Path) -> Path | None:
    """Return a folder for machine code, of its own for each state of the sources; None where nothing can be written.

    Numba looks at the file of the function it is asked for, not at those of the functions that this one calls: they
    may stand in the folder of that file, and in this one.
    """
    sources = hashlib.sha256()
    for path in sorted({*_HERE.glob("*.py"), *home_of_function.glob("*.py")}):
        sources.update(path.read_bytes())
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    asked = _CONFIG.CACHE_DIR
    for folder in [Path(asked)] if asked else [_HERE / "__pycache__", home / "fivebar_pin"]:
        place = folder / f"engine-{sources.hexdigest()[:12]}"
        try:
            place.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=place):
                return place
        except OSError:
            continue
    return None


@contextmanager
def _caching_in(place: Path) -> Iterator[None]:
    """Let Numba keep machine code in a folder."""
    before = _CONFIG.CACHE_DIR
    _CONFIG.CACHE_DIR = str(place)
    try:
        yield
    finally:
        _CONFIG.CACHE_DIR = before
