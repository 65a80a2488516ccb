"""Loading a mechanism from any file: a linkage in its own words, or whatever `fivebar_pin.io.load` reads."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy.typing as npt

from fivebar_pin import io
from fivebar_pin._files import MAX_BYTES, as_path
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Closure
from fivebar_pin.errors import FileFormatError, FiveBarPinError, InvalidInputError
from fivebar_pin.io._find import TREES, is_linkage_file
from fivebar_pin.planar._reading import load as load_linkage

__all__ = ["load"]


def load(
    path: object,
    *,
    free_flyer: bool = False,
    closures: Iterable[Closure] | None = None,
    actuated: Iterable[str] | None = None,
    gravity: npt.ArrayLike | None = None,
    fixed_base: bool = False,
    closure_tolerance: float = 0.0,
    max_bytes: int = MAX_BYTES,
) -> ClosedChain:
    """Load a closed chain: a linkage file (YAML with the key `linkage`), or what `fivebar_pin.io.load` reads.

    Args:
        path: a linkage file (see `fivebar_pin.planar.load`); a folder with one URDF (and its sidecar), one file of
            another format, or one linkage file and no other mechanism; a .urdf, .sdf, .world or .xacro file, whose
            sidecar lies beside it where it needs one; an MJCF .xml file; or the name of a mechanism that ships
            (`fivebar_pin.io.shipped`), where no file or folder is called so.
        free_flyer: put the root of a URDF or SDF on a free-flying base.
        closures: use these instead of the file's closures; with `actuated`, no sidecar is needed. Not for linkages.
        actuated: drive these joints instead of the file's.
        gravity: use this (3,) [m/s2] instead of the file's.
        fixed_base: hold what floats where it stands, see `ClosedChain.with_fixed_base`.
        closure_tolerance: how far loops of rounded dimensions may stay open, see `ClosedChain` [m or rad].
        max_bytes: size above which a file is not read.

    Returns:
        The chain; meshes are named in its visuals but not read.

    Warns:
        LeftOutWarning: what a file states and the mechanism goes without, in one line.

    Raises:
        FileFormatError: a file is missing, malformed or states something impossible; names file, element, way out.
        InvalidInputError, UnknownNameError: an argument of this call is wrong, or no file and no mechanism that ships
            has this name.
    """
    file = _linkage_of(as_path(path))
    if not is_linkage_file(file):
        chain = io.load(
            path, free_flyer=free_flyer, closures=closures, actuated=actuated, gravity=gravity, max_bytes=max_bytes
        )
        chain = chain.with_fixed_base() if fixed_base else chain
        return chain.with_tolerance(closure_tolerance) if closure_tolerance else chain
    for word, given in (("free_flyer", free_flyer), ("fixed_base", fixed_base), ("closures", closures is not None)):
        if given:
            raise InvalidInputError(word, given, "is for trees (URDF, SDF, MJCF); this is a linkage")
    linkage = load_linkage(file)
    try:
        chain = linkage.chain()
    except FiveBarPinError as error:
        raise FileFormatError(file, str(error)) from error
    chain = chain if actuated is None else chain.with_actuated(actuated)
    chain = chain.with_tolerance(closure_tolerance) if closure_tolerance else chain
    return chain if gravity is None else chain.with_gravity(gravity)


def _linkage_of(path: Path) -> Path:
    """Return the linkage file of a folder that holds one and no other mechanism; else the path."""
    try:
        files = sorted(path.iterdir()) if path.is_dir() else []
    except OSError:
        return path  # whoever reads it says why it cannot be read
    linkages = [file for file in files if is_linkage_file(file)]
    others = [file for file in files if file.suffix.lower() in (*TREES, ".xml")]
    return linkages[0] if len(linkages) == 1 and not others else path
