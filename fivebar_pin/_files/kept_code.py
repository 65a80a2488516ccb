"""Where machine code is kept from one process to the next."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterable
from pathlib import Path

__all__ = ["kept_code"]


def kept_code(folders: Iterable[Path]) -> Path | None:
    """Return a folder for the machine code of sources in some folders, None where nothing can be written.

    It is another one for each state of the sources: Numba looks at the file of the function it is asked for, not at
    those of the functions that this one calls. It lies where NUMBA_CACHE_DIR says, beside the sources, or in the
    user's cache.
    """
    first, *others = (Path(folder).resolve() for folder in folders)
    sources = hashlib.sha256()
    for path in sorted({path for folder in (first, *others) for path in folder.glob("*.py")}):
        sources.update(path.read_bytes())
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    asked = os.environ.get("NUMBA_CACHE_DIR")
    for folder in [Path(asked)] if asked else [first / "__pycache__", home / "fivebar_pin"]:
        place = folder / f"engine-{sources.hexdigest()[:12]}"
        try:
            place.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=place):
                return place
        except OSError:
            continue
    return None
