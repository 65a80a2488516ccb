"""Saving a mechanism: URDF with its sidecar, and MJCF."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from fivebar_pin._files import as_path, write_set
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.io._sidecar import dump_sidecar
from fivebar_pin.io._urdf_text import urdf_and_sidecar

__all__ = ["save", "texts"]

FORMATS = ("urdf", "mjcf")


def save(
    chain: ClosedChain,
    path: object,
    *,
    name: str | None = None,
    formats: Iterable[str] = FORMATS,
    overwrite: bool = False,
) -> tuple[Path, ...]:
    """Write a chain as ``name.urdf`` with its sidecar ``name.yaml``, and as ``name.xml`` (MJCF).

    Read back with `load`, either is the same mechanism: the same order of coordinates, every number of the tree
    within round-off, the same closures and driven joints. Named parameters stand in the sidecar; MJCF has no word
    for them: that file is the mechanism at their present values.

    Args:
        chain: what to write.
        path: the folder; or a file ending in .urdf (writes it and its sidecar) or .xml (writes MJCF only).
        name: file name without ending; the chain's name unless given.
        formats: "urdf" (with sidecar), "mjcf", or both; ignored when `path` is a file.
        overwrite: replace files that exist.

    Returns:
        The files written; all of them or, after an error, none.

    Raises:
        OutputError: a file exists already, or the folder cannot be written.
        InvalidInputError: something that the format cannot state (it says what, and what to do).
    """
    target = as_path(path)
    if target.suffix.lower() in (".urdf", ".xml") and not target.is_dir():
        if name is not None:
            raise InvalidInputError("name", name, f"the path {str(target)!r} names the file already")
        formats = ("urdf",) if target.suffix.lower() == ".urdf" else ("mjcf",)
        target, stem = target.parent, target.stem
    else:
        stem = _stem(chain, name)
    return write_set(target, texts(chain, target, name=stem, formats=formats), overwrite=overwrite)


def texts(
    chain: ClosedChain, folder: Path, *, name: str | None = None, formats: Iterable[str] = FORMATS
) -> dict[str, str]:
    """Return the text of each file that `save` writes into a folder, by file name, for a set with other files."""
    stem = _stem(chain, name)
    wanted = (formats,) if isinstance(formats, str) else tuple(formats)
    for word in wanted:
        if word not in FORMATS:
            raise UnknownNameError("format", word, FORMATS)
    files: dict[str, str] = {}
    if "urdf" in wanted:
        text, sidecar = urdf_and_sidecar(chain, folder)
        files |= {f"{stem}.urdf": text, f"{stem}.yaml": dump_sidecar(sidecar)}
    if "mjcf" in wanted:
        from fivebar_pin.io._mjcf_text import mjcf_text

        files[f"{stem}.xml"] = mjcf_text(chain, folder)
    return files


def _stem(chain: ClosedChain, name: str | None) -> str:
    if name is None:
        return re.sub(r"[^\w.+-]+", "_", chain.name).strip("._") or "mechanism"
    if not isinstance(name, str) or not re.fullmatch(r"[^/\\\0]+", name) or name.strip(". ") == "":
        raise InvalidInputError("name", name, "must be a plain file name, without folders or ending")
    return name
