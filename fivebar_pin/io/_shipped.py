"""Where the files of the mechanisms that ship are."""

from __future__ import annotations

from pathlib import Path

from fivebar_pin.errors import FileFormatError, UnknownNameError

__all__ = ["shipped", "shipped_path"]


def _folder() -> Path:
    """Return the urdf folder: inside an installed package, beside the package in a source checkout."""
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "urdf", package.parent / "urdf"):
        if folder.is_dir() and any(folder.glob("*.urdf")):
            return folder
    raise FileFormatError(package / "urdf", "the mechanisms that ship are missing; install the package again")


def shipped() -> tuple[str, ...]:
    """Return the names of the mechanisms that ship, for `shipped_path`."""
    return tuple(sorted(path.stem for path in _folder().glob("*.urdf")))


def shipped_path(name: str) -> Path:
    """Return the URDF file of a mechanism that ships; its sidecar lies beside it.

    Raises:
        UnknownNameError: no mechanism of this name ships; lists those that do.
    """
    names = shipped()
    if name not in names:
        raise UnknownNameError("shipped mechanism", name, names)
    return _folder() / f"{name}.urdf"
