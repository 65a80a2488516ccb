"""The lengths of a linkage by name, and where its points lie on its links.

A link's own axes start at its first point, x towards the second; those of the ground are the world's, those of a
sliding link lie along its line. Its joint is where the tree enters it, so that everything on it is placed by

    stem: from the joint to the link's own axes     then     from there to the point or line

both of them products of moves along or about named numbers. Rotations are about z, translations along x and y.
"""

from __future__ import annotations

import cmath
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.planar._parts import GROUND, Link

__all__ = ["ALONG_X", "ALONG_Y", "LinkShape", "Moves", "back", "link_poses"]

Moves = tuple[tuple[str, Array], ...]
"""Parameter and twist (6,) of each move, in order."""

ALONG_X, ALONG_Y, ABOUT_Z = np.eye(6)[0], np.eye(6)[1], np.eye(6)[5]


def back(moves: Moves) -> Moves:
    """Return the moves that undo others."""
    return tuple((name, -twist) for name, twist in reversed(moves))


@dataclass(frozen=True, slots=True)
class LinkPose:
    """Where a link's axes lie in the sketch: origin [m] and angle [rad]."""

    origin: complex
    angle: float

    def local(self, point: complex) -> complex:
        """Return a point of the sketch in the link's axes."""
        return (point - self.origin) * cmath.exp(-1j * self.angle)


def link_poses(links: Mapping[str, Link], sketch: Mapping[str, complex]) -> dict[str, LinkPose]:
    """Return where every link lies in the sketch.

    Raises:
        InvalidInputError: the first two points of a bar lie on each other in the sketch.
    """
    poses = {}
    for link in links.values():
        if link.name == GROUND:
            poses[GROUND] = LinkPose(0j, 0.0)
            continue
        origin, angle = sketch[link.points[0]], 0.0
        if link.guide is not None:
            angle = link.guide.angle
        elif len(link.points) > 1:
            ray = sketch[link.points[1]] - origin
            if ray == 0:
                raise InvalidInputError(
                    f"points of bar {link.name}", link.points[:2], "lie on each other in the sketch", "Move one a bit."
                )
            angle = cmath.phase(ray)
        poses[link.name] = LinkPose(origin, angle)
    return poses


class LinkShape:
    """Names and values of the parameters of a linkage, and the moves that place its points and lines.

    Attributes:
        values: parameter values, from the sketch where nothing else was said [m or rad].
        lengths: names of those that must stay positive.
    """

    def __init__(self, links: Mapping[str, Link], sketch: Mapping[str, complex]) -> None:
        self.values: dict[str, float] = {}
        self.lengths: list[str] = []
        self._points: dict[tuple[str, str], Moves] = {}
        self._lines: dict[str, Moves] = {}
        poses = link_poses(links, sketch)
        for link in links.values():
            self._place_points(link, poses[link.name], sketch)
            if link.guide is not None:
                through = sketch[link.points[0]] if link.guide.through is None else link.guide.through
                carrier = poses[link.guide.on]
                turn = self._name(f"{link.name}_angle", link.guide.angle - carrier.angle)
                local = (through - carrier.origin) * cmath.exp(-1j * link.guide.angle)
                offset = self._name(f"{link.name}_offset", local.imag)
                self._lines[link.name] = ((turn, ABOUT_Z), (offset, ALONG_Y))

    def point(self, link: str, point: str) -> Moves:
        """Return the moves from a link's own axes to one of its points."""
        return self._points[link, point]

    def line(self, link: str) -> Moves:
        """Return the moves from the carrier's own axes to the line that a link slides on; x runs along it."""
        return self._lines[link]

    def _place_points(self, link: Link, pose: LinkPose, sketch: Mapping[str, complex]) -> None:
        for k, point in enumerate(link.points):
            if k == 0 and link.name != GROUND:
                moves: Moves = ()
            elif k == 1 and link.guide is None and link.name != GROUND:
                stated = link.length
                length = abs(pose.local(sketch[point])) if stated is None else stated
                moves = ((self._name(link.name, length), ALONG_X),)
                self.lengths.append(link.name)
            else:
                z = link.places.get(point, pose.local(sketch[point]))
                stem = point if link.name == GROUND else f"{link.name}_{point}"
                moves = tuple(
                    (self._name(f"{stem}_{letter}", value), axis)
                    for letter, value, axis in (("x", z.real, ALONG_X), ("y", z.imag, ALONG_Y))
                )
            self._points[link.name, point] = moves

    def _name(self, name: str, value: float) -> str:
        if name in self.values:
            raise InvalidInputError("names of bars and points", name, "would name two lengths", "Rename one of them.")
        self.values[name] = float(value)
        return name
