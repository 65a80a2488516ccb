"""Loops that a file closes itself: a joint between two links of the tree becomes a closure between two frames."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.closures import Closure, Cylindrical, Point, Revolute, Weld
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.io._entries import JointEntry, LinkEntry, TreeEntry
from fivebar_pin.io._xml import Reader

__all__ = ["BALL_WORDS", "CLOSING", "Loop", "close", "closing_pairs", "refuse_forces", "shared_point", "world_poses"]

BALL_WORDS = ("body_A", "body_B", "p_AP", "p_BQ")
"""What Drake's ball constraint states, after its own name."""
_ACTING = ("drake:joint", "drake:linear_bushing_rpy", "drake:linear_spring_damper", "drake:tendon_constraint")
_NAMED = re.compile(r"(closing_.+)_([12])")

CLOSING: dict[str, type[Closure]] = {
    "revolute": Revolute,
    "continuous": Revolute,
    "ball": Point,
    "spherical": Point,
    "spherical_joint": Point,
    "fixed": Weld,
    "weld": Weld,
    "cylindrical": Cylindrical,
}
"""Kinds of joints that can close a loop, and what they become."""


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """A joint that closes a loop.

    Attributes:
        name: of the joint.
        kind: one of `CLOSING`.
        links: names of the two links it joins.
        placements: pose of the joint in each of them, homogeneous (4, 4).
        axis: in the axes of the joint (3,), unit; kinds without an axis pass over it.
    """

    name: str
    kind: str
    links: tuple[str, str]
    placements: tuple[Array, Array]
    axis: Array


def close(reader: Reader, tree: TreeEntry, loops: list[Loop]) -> tuple[TreeEntry, tuple[Closure, ...]]:
    """Return the tree with the frames that the loops are closed at, and the closures.

    A frame is the link itself where the joint sits at its origin, else a link without mass, NAME_1 or NAME_2.

    Raises:
        FileFormatError: a joint that cannot close a loop, a link that is not there, or a name that is taken.
    """
    links, joints, closures = dict(tree.links), dict(tree.joints), []
    for loop in loops:
        where = f"joint {loop.name!r}"
        if loop.kind not in CLOSING:
            rule = f"closes a loop, and no closure does what a {loop.kind} joint does; cut the loop at a hinge or ball"
            raise reader.fail(where, rule)
        frames = []
        for k, (link, placement) in enumerate(zip(loop.links, loop.placements, strict=True), start=1):
            if link not in tree.links:
                raise reader.fail(where, str(UnknownNameError("link", link, tree.links)))
            frame = link if np.array_equal(placement, np.eye(4)) else f"{loop.name}_{k}"
            if frame != link:
                if frame in links or frame in joints:
                    raise reader.fail(where, f"closes a loop and needs the name {frame!r} for a frame; it is taken")
                links[frame] = LinkEntry(frame)
                joints[frame] = JointEntry(frame, "fixed", link, frame, placement, np.array([1.0, 0.0, 0.0]))
            frames.append(frame)
        closures.append(Closure(frames, CLOSING[loop.kind].kind, axis=loop.axis, name=loop.name))
    return replace(tree, links=links, joints=joints), tuple(closures)


def world_poses(tree: TreeEntry) -> dict[str, Array]:
    """Return the pose of every link of a URDF in its root, all joints at zero, homogeneous (4, 4)."""
    children: dict[str, list[JointEntry]] = {}
    for joint in tree.joints.values():
        children.setdefault(joint.parent, []).append(joint)
    poses, front = {tree.root: np.eye(4)}, [tree.root]
    while front:
        link = front.pop()
        for joint in children.get(link, []):
            poses[joint.child] = poses[link] @ joint.placement
            front.append(joint.child)
    return poses


def shared_point(name: str, links: tuple[str, str], points: tuple[list[float], list[float]]) -> Loop:
    """Return the loop that closes where a point of one link is a point of the other."""
    one, two = np.eye(4), np.eye(4)
    one[:3, 3], two[:3, 3] = points
    return Loop(name, "ball", links, (one, two), np.array([1.0, 0.0, 0.0]))


def refuse_forces(reader: Reader, model: ElementTree.Element) -> None:
    """Refuse elements of Drake that act on the mechanism and are not read.

    Raises:
        FileFormatError: there is one.
    """
    for element in model:
        if element.tag in _ACTING:
            rule = "acts on the mechanism and is not read; state a joint, or a spring in the sidecar, and remove it"
            raise reader.fail(f"<{element.tag}>", rule)


def closing_pairs(tree: TreeEntry) -> list[Loop]:
    """Return the loops that only the names of two links state: a point."""
    found: dict[str, dict[str, str]] = {}
    for link in tree.links:
        said = _NAMED.fullmatch(link)
        if said:
            found.setdefault(said[1], {})[said[2]] = link
    placed = (np.eye(4), np.eye(4))
    pairs = {name: (ends["1"], ends["2"]) for name, ends in found.items() if len(ends) == 2}
    return [Loop(name, "ball", ends, placed, np.array([1.0, 0.0, 0.0])) for name, ends in pairs.items()]
