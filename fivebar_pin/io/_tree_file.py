"""Reading a file of a tree, whatever its format: URDF, SDF, or a xacro that makes one of them."""

from __future__ import annotations

from pathlib import Path

from fivebar_pin._files import MAX_BYTES, read_bounded
from fivebar_pin.errors import FileFormatError
from fivebar_pin.io._sdf import read_sdf
from fivebar_pin.io._stated import Stated
from fivebar_pin.io._urdf import read_urdf
from fivebar_pin.io._xacro import expanded
from fivebar_pin.io._xml import parse_text

__all__ = ["read_tree"]


def read_tree(path: Path, *, named_loops: bool = False, max_bytes: int = MAX_BYTES) -> Stated:
    """Return what a file states; whether it is URDF or SDF its root element tells.

    Args:
        path: the file.
        named_loops: close the loops that are stated by the names of frames only, closing_NAME_1 and closing_NAME_2.
        max_bytes: size above which it is not read.

    Raises:
        FileFormatError: anything that is not a tree of known joints with finite numbers; names file and element.
    """
    is_xacro = path.suffix.lower() == ".xacro"
    text = expanded(path, max_bytes) if is_xacro else read_bounded(path, max_bytes)
    root = parse_text(path, text, roots=("robot", "sdf"))
    for element in root.iter():
        if element.tag.startswith("xacro:"):
            raise FileFormatError(path, f"holds <{element.tag}>, which xacro expands: give the file the ending .xacro")
    read = read_sdf if root.tag == "sdf" else read_urdf
    return read(path, root, named_loops=named_loops)
