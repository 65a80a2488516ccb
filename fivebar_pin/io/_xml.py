"""XML from strangers: no document types, no entities, bounded depth and size, numbers that are numbers."""

from __future__ import annotations

import difflib
import re
import sys
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin._files import MAX_BYTES, read_bounded
from fivebar_pin.errors import FileFormatError, UnknownNameError

__all__ = ["HUGE", "UNIT", "UNLIMITED", "Reader", "direction", "parse_text", "parse_xml"]

MAX_DEPTH = 200
MAX_ELEMENTS = 200_000

UNIT = 4e-16  # deviation from length one of a vector that is left as it is [-]
_SHORTEST, _LONGEST = 1e-9, 1e9  # lengths of a vector that has a direction [-]
HUGE = 1e30
"""Beyond any length, mass or inertia; products of numbers below it do not overflow."""
UNLIMITED = sys.float_info.max
"""What Pinocchio writes for a limit that is none."""

_DECLARATION = re.compile(rb"<\?xml\s[^>]*\?>")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


class _Builder(ElementTree.TreeBuilder):
    """A tree builder that refuses what a mechanism file never needs."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path, self._depth, self._count = path, 0, 0

    def start(self, tag: str, attrs: dict[str, str]) -> ElementTree.Element:
        self._depth, self._count = self._depth + 1, self._count + 1
        if self._depth > MAX_DEPTH:
            raise FileFormatError(self._path, f"elements are nested deeper than {MAX_DEPTH}")
        if self._count > MAX_ELEMENTS:
            raise FileFormatError(self._path, f"has more than {MAX_ELEMENTS} elements")
        return super().start(tag, attrs)

    def end(self, tag: str) -> ElementTree.Element:
        self._depth -= 1
        return super().end(tag)

    def doctype(self, *_: object) -> None:
        """Refuse the declaration that entity bombs live in."""
        raise FileFormatError(self._path, "has a DOCTYPE or entities, which are not read; remove the declaration")


def parse_xml(path: Path, *, root: str | None, max_bytes: int = MAX_BYTES) -> ElementTree.Element:
    """Return the root element of a file whose root tag must be `root`; None takes any.

    Raises:
        FileFormatError: not readable, not well formed, hostile, or another kind of file.
    """
    return parse_text(path, read_bounded(path, max_bytes), roots=() if root is None else (root,))


def parse_text(path: Path, text: bytes, *, roots: tuple[str, ...]) -> ElementTree.Element:
    """Return the root element of a text that came from a file; its tag must be one of `roots`, if there are any.

    Names are as they are written, with their prefixes, declared or not. An XML declaration that does not stand first,
    as after a licence in a comment, is passed over. Simulators do both.

    Raises:
        FileFormatError: not well formed, hostile, or another kind of file.
    """
    parser, builder = expat.ParserCreate(), _Builder(path)
    parser.StartElementHandler, parser.EndElementHandler = builder.start, builder.end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = builder.data, builder.doctype
    try:
        parser.Parse(text[:1] + _DECLARATION.sub(b"", text[1:]), True)
        element = builder.close()
    except FileFormatError:
        raise
    except (expat.ExpatError, LookupError, ValueError, RecursionError) as error:
        raise FileFormatError(path, f"is not well-formed XML ({error})") from error
    if roots and element.tag not in roots:
        expected = " or ".join(f"<{root}>" for root in roots)
        raise FileFormatError(path, f"has the root element <{element.tag}>; expected {expected}")
    return element


class Reader:
    """Reads attributes of elements of one file; every refusal names the file and the element."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def fail(self, where: str, problem: str) -> FileFormatError:
        """Return the error for an element."""
        return FileFormatError(self.path, f"{where}: {problem}")

    def text(self, element: ElementTree.Element, attribute: str, where: str) -> str:
        """Return a required attribute that is not empty."""
        value = element.get(attribute)
        if value is None or not value.strip():
            raise self.fail(where, f"<{element.tag}> needs the attribute {attribute!r}")
        return value

    def numbers(
        self,
        element: ElementTree.Element | None,
        attribute: str,
        count: int,
        where: str,
        default: list[float] | None,
        *,
        bound: float = HUGE,
    ) -> list[float]:
        """Return `count` numbers, at most `bound` in size; `default` (None: required) is for an absent attribute."""
        text = None if element is None else element.get(attribute)
        if text is None:
            if default is None:
                raise self.fail(where, f"needs the attribute {attribute!r}")
            return list(default)
        words = text.split()
        if len(words) != count:
            raise self.fail(where, f"{attribute} = {text!r} must be {count} number(s)")
        return [self.number(word, attribute, where, bound=bound) for word in words]

    def number(self, word: str, attribute: str, where: str, *, bound: float = HUGE) -> float:
        """Return one finite number, at most `bound` in size."""
        if not _NUMBER.fullmatch(word):
            raise self.fail(where, f"{attribute} holds {word[:40]!r}, which is not a finite number")
        value = float(word)
        if not abs(value) <= bound:
            raise self.fail(where, f"{attribute} holds {word[:40]!r}, which is out of range")
        return value

    def known(self, element: ElementTree.Element | None, attributes: tuple[str, ...], where: str) -> None:
        """Refuse attributes outside the given ones, so that no misspelt value is silently a default."""
        if element is None:
            return
        for attribute in element.attrib:
            if attribute not in attributes:
                raise self.fail(where, str(UnknownNameError(f"attribute of <{element.tag}>", attribute, attributes)))

    def no_misspelt(
        self,
        element: ElementTree.Element | None,
        where: str,
        *,
        tags: tuple[str, ...] = (),
        words: tuple[str, ...] = (),
    ) -> None:
        """Refuse children or attributes that are nearly a known one; others are extensions and are passed over."""
        if element is None:
            return
        children = [str(child.tag) for child in element] if tags else []
        groups = (("element", children, tags, 0.75), ("attribute", [*element.attrib], words, 0.8))
        for kind, found, known, cutoff in groups:
            for name in found:
                near = difflib.get_close_matches(name.lower(), known, n=1, cutoff=cutoff) if name not in known else []
                if near:
                    raise self.fail(where, f"has an unknown {kind} {name!r}; did you mean {near[0]!r}?")

    def only(self, element: ElementTree.Element, tag: str, where: str) -> ElementTree.Element | None:
        """Return the only child with this tag, or None; two are an error."""
        found = element.findall(tag)
        if len(found) > 1:
            raise self.fail(where, f"has {len(found)} <{tag}> elements; expected at most one")
        return found[0] if found else None


def direction(values: Array) -> Array:
    """Return a vector scaled to length one; left as it is when it has that length already.

    Raises:
        ValueError: it has no direction.
    """
    length = float(np.linalg.norm(values))
    if not _SHORTEST < length < _LONGEST:
        raise ValueError("no direction")
    return values if abs(length - 1.0) < UNIT else values / length
