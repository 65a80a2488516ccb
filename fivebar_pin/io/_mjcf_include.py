"""One MJCF tree out of a file and those that it includes.

MuJoCo puts the children of an included file's root, whatever that is called, where <include> stands; a name is looked
up in the folder of the first file, then in that of the including one; and no file may come twice. An attribute
without a value is none.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from xml.etree import ElementTree

from fivebar_pin._files import MAX_BYTES, read_bounded
from fivebar_pin.errors import FileFormatError
from fivebar_pin.io._xml import MAX_DEPTH, MAX_ELEMENTS, parse_xml

__all__ = ["element_key", "including", "mechanism_files"]

_INCLUDE = re.compile(rb"<include\b[^>]*\bfile\s*=\s*[\"']([^\"']+)[\"']")
_ACTS = re.compile(rb"<(actuator|equality)[\s>/]")
_MJCF = re.compile(rb"<mujoco[\s>]")


def including(path: Path, *, max_bytes: int = MAX_BYTES) -> tuple[ElementTree.Element, dict[str, Path]]:
    """Return the root element with all files included, and the file of each named element that is not in the first.

    Raises:
        FileFormatError: a file is missing, comes twice or includes itself, or all together are too large.
    """
    merging = _Merging(path, max_bytes)
    return merging.root, merging.sources


def element_key(element: ElementTree.Element) -> str:
    """Return how messages call an element: its tag and its name, that of its file where it has none."""
    return f"{element.tag} {element.get('name') or Path(element.get('file', '')).stem!r}"


def mechanism_files(files: list[Path]) -> list[Path]:
    """Return those of a folder's files that are mechanisms: no scene around one, no part of one, no other XML.

    A scene includes one of the files and states no actuator and no equality; a part is included by a mechanism or has
    no <worldbody> and includes nothing. All files are returned where that leaves none.
    """
    text = {file: read_bounded(file, may_be_empty=True) for file in files}
    mjcf = [file for file in files if _MJCF.search(text[file])]
    parts = {file: {file.parent / str(x, "utf-8", "replace") for x in _INCLUDE.findall(text[file])} for file in mjcf}
    world = {file for file in mjcf if b"<worldbody" in text[file]}
    whole = [file for file in mjcf if (_ACTS.search(text[file]) if parts[file] else file in world)]
    within = {part for file in whole for part in parts[file]}
    return [file for file in whole if file not in within] or mjcf or files


class _Merging:
    """Puts the files together, counting what they come to."""

    def __init__(self, path: Path, max_bytes: int) -> None:
        self.path, self.max_bytes = path, max_bytes
        self.bytes_left, self.elements_left = max_bytes, MAX_ELEMENTS
        self.sources: dict[str, Path] = {}
        self.seen: set[Path] = {path.resolve()}
        self.root = parse_xml(path, root="mujoco", max_bytes=max_bytes)
        self.count(path, self.root)
        self.expand(self.root, (path,), 0)

    def count(self, file: Path, root: ElementTree.Element) -> None:
        self.bytes_left -= file.stat().st_size
        self.elements_left -= sum(1 for _ in root.iter())
        if self.bytes_left < 0 or self.elements_left < 0:
            bound = f"{self.max_bytes} bytes or {MAX_ELEMENTS} elements"
            raise FileFormatError(self.path, f"comes with its included files to more than {bound}")

    def expand(self, element: ElementTree.Element, chain: tuple[Path, ...], depth: int) -> None:
        """Replace the <include> elements below one, in place; `chain` are the files that led here."""
        if depth > MAX_DEPTH:
            raise FileFormatError(self.path, f"elements and included files are nested deeper than {MAX_DEPTH}")
        children = []
        for child in element:
            if child.tag == "include":
                children += self.included(child, chain, depth)
                continue
            self.expand(child, chain, depth + 1)
            for attribute in [word for word, text in child.attrib.items() if not text.strip()]:
                del child.attrib[attribute]
            if len(chain) > 1:
                self.sources.setdefault(element_key(child), chain[-1])
            children.append(child)
        element[:] = children

    def included(self, include: ElementTree.Element, chain: tuple[Path, ...], depth: int) -> list[ElementTree.Element]:
        name, where = include.get("file", ""), chain[-1]
        if not name.strip() or len(include):
            raise FileFormatError(where, "<include> needs the attribute 'file' and has no content")
        file = self.path.parent / name
        if not os.path.isfile(file):
            file = where.parent / name
        if not os.path.isfile(file):
            raise FileFormatError(where, f"<include>: there is no file {name!r} in {self.path.parent} or beside it")
        if file.resolve() in {each.resolve() for each in chain}:
            way = " -> ".join(each.name for each in (*chain, file))
            raise FileFormatError(where, f"<include>: {name!r} includes itself ({way}); break the circle")
        if file.resolve() in self.seen:
            raise FileFormatError(where, f"<include>: {name!r} is included already; a file comes once")
        self.seen.add(file.resolve())
        root = parse_xml(file, root=None, max_bytes=self.max_bytes)
        if not len(root):
            raise FileFormatError(file, f"is included by {where.name} and has nothing in it; remove the <include>")
        self.count(file, root)
        self.expand(root, (*chain, file), depth + 1)
        return list(root)
