"""What the names of frames say of loops: the two sides of one, or one point of a drawing on two bodies."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator

from fivebar_pin.diagnosis._ends import End, Evidence, Pair

__all__ = ["named_pairs", "point_pairs"]


_LOOP = re.compile(r"clos(?:ed?|ing|ure)[ _-]*loop|closing|closure|loop", re.IGNORECASE)
_LETTER = re.compile(r"(?<![A-Za-z])([AaBb])(?![A-Za-z])")
_DIGIT = re.compile(r"(?<!\d)([12])(?!\d)")
_WORD = re.compile(r"(first|second|parent|child|start|end)(?![A-Za-z])", re.IGNORECASE)
_POINT = re.compile(r"([A-KM-QS-Z]\d*|(?:pin|pivot|point|hinge)_?\d+)[_-].+")  # L and R are sides
_SIDE = re.compile(r"left|right|(?<![A-Za-z])[fhr]?[lr](?![A-Za-z])", re.IGNORECASE)


def named_pairs(ends: Iterable[End]) -> Iterator[Pair]:
    """Yield the frames whose names say that they close a loop: the same but for A and B, 1 and 2, first and second."""
    left = sorted((end for end in ends if _LOOP.search(end.name)), key=lambda end: _natural(end.name))
    for pattern in (_LETTER, _WORD, _DIGIT):
        sides: dict[str, dict[str, End]] = {}
        for end in left:
            found = list(pattern.finditer(end.name))
            if found:
                a, b = found[-1].span(1)
                sides.setdefault(f"{end.name[:a]}*{end.name[b:]}".lower(), {}).setdefault(
                    found[-1].group(1).lower(), end
                )
        for both in sides.values():
            if len(both) == 2:
                one, other = (both[side] for side in sorted(both, key=_side))
                left = [end for end in left if end not in (one, other)]
                if one.joint != other.joint:
                    yield Pair((one, other), Evidence.NAMED)


def _natural(name: str) -> list[tuple[int, str]]:
    """Return a key that sorts names with their numbers as numbers."""
    return [(int(word), "") if word.isdecimal() else (-1, word) for word in re.split(r"(\d+)", name)]


def _side(word: str) -> int:
    """Return 0 for the side that is named first, 1 for the other."""
    return int(word in ("b", "2", "second", "child", "end"))


def point_pairs(ends: Iterable[End], meet: Callable[[End, End], bool]) -> Iterator[Pair]:
    """Yield the markers that name one point of a drawing on two bodies, like B_coupler and B_rocker.

    On more bodies the point may be a pin of several bars, or one point of several like legs; on a left and a right
    body it may be one of either leg: where they meet decides.
    """
    points: dict[str, list[End]] = {}
    for end in ends:
        said = _POINT.fullmatch(end.name)
        if end.is_marker and said:
            points.setdefault(said.group(1), []).append(end)
    for label, there in points.items():
        first, *others = there
        for k, other in enumerate(others):
            clear = len(others) == 1 and _SIDE.sub("", first.name) != _SIDE.sub("", other.name)
            if other.joint != first.joint and (clear or meet(first, other)):
                yield Pair((first, other), Evidence.POINT, label if k == 0 else f"{label}_{k + 1}")
