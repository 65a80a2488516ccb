"""From the graph of an SDF model's joints to a tree and the closures of its loops.

The tree is grown breadth first from the root, in the order of the file, along joints from parent to child; a joint
whose child hangs already closes a loop. A joint that no closure can replace, or that has a spring, comes before others
that lead to the same link, and is turned round where only its child is reached; others where nothing else is left.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.closures import Closure, Coupling
from fivebar_pin.io._entries import UNLIMITED, JointEntry, LinkEntry, TreeEntry
from fivebar_pin.io._loops import CLOSING, Loop, close
from fivebar_pin.io._sdf_frames import relative
from fivebar_pin.io._sdf_joints import GEARBOX, Axis, SdfJoint
from fivebar_pin.io._stated import Stated
from fivebar_pin.io._xml import Reader
from fivebar_pin.springs import JointSpring

__all__ = ["hang"]

_ALONG = 1e-3  # sine of the angle between the axes of a gearbox and of its hinges up to which they are one [-]
_NO_AXIS = np.array([1.0, 0.0, 0.0])
_TWO_HINGES = ("universal", "revolute2")


def hang(
    reader: Reader,
    name: str,
    root: str,
    links: dict[str, LinkEntry],
    poses: dict[str, Array],
    joints: list[SdfJoint],
) -> Stated:
    """Return the tree, its closures, couplings and springs.

    Args:
        reader: of the file, for its errors.
        name: of the model.
        root: link that the tree hangs on.
        links: all of them, the world among them where it is the root.
        poses: of the links in the world, homogeneous (4, 4).
        joints: all of them.

    Raises:
        FileFormatError: links that hang on nothing, a loop of joints that no closure can replace, a gearbox without
            the two hinges that it ties.
    """
    spanning, closing = _span(reader, root, links, [joint for joint in joints if joint.kind != GEARBOX])
    all_links, entries, springs = dict(links), dict[str, JointEntry](), list[JointSpring]()
    couplings: list[Closure] = []
    for joint, turned in spanning:
        made = _entries(joint, turned, poses)
        for entry in made:
            if entry.name in entries or (entry.child not in links and entry.child in all_links):
                raise reader.fail(f"joint {joint.name!r}", f"needs the name {entry.name!r}, which is taken")
            entries[entry.name] = entry
            all_links.setdefault(entry.child, LinkEntry(entry.child))
        springs += [JointSpring(e.name, a.stiffness, a.rest) for e, a in _sprung(joint, made)]
        if joint.kind == "screw":
            couplings.append(Coupling({f"{joint.name}_slide": 1.0, joint.name: -joint.pitch}, name=joint.name))
    tree = TreeEntry(name, root, all_links, entries, poses[root])
    tree, closures = close(reader, tree, [_loop(joint, poses) for joint in closing])
    couplings += [_gears(reader, joint, joints, entries) for joint in joints if joint.kind == GEARBOX]
    return Stated(tree, (*closures, *couplings), springs=tuple(springs), left_out=_lost(reader, closing))


def _span(
    reader: Reader, root: str, links: dict[str, LinkEntry], joints: list[SdfJoint]
) -> tuple[list[tuple[SdfJoint, bool]], list[SdfJoint]]:
    """Return the joints of the tree, each with whether it is turned round, and those that close loops."""
    rigid = {joint.child for joint in joints if not _can_close(joint)}
    below: dict[str, list[SdfJoint]] = {link: [] for link in links}
    above: dict[str, list[SdfJoint]] = {link: [] for link in links}
    for joint in joints:
        below[joint.parent].append(joint)
        above[joint.child].append(joint)
    reached, tree = {root: None}, list[tuple[SdfJoint, bool]]()

    def next_one() -> tuple[SdfJoint, bool] | None:
        down = [joint for link in reached for joint in below[link] if joint.child not in reached]
        up = [joint for link in reached for joint in above[link] if joint.parent not in reached]
        choices = (
            ([joint for joint in up if not _can_close(joint)], True),
            ([joint for joint in down if not _can_close(joint) or joint.child not in rigid], False),
            (down, False),
            (up, True),
        )
        return next(((some[0], turned) for some, turned in choices if some), None)

    while (found := next_one()) is not None:
        joint, turned = found
        reached[joint.parent if turned else joint.child] = None
        tree.append(found)
    lost = [link for link in links if link not in reached]
    if lost:
        names = ", ".join(lost[:5])
        rule = f"no joint leads from it to link {names}; join it, or make it a model of its own"
        raise reader.fail(f"link {root!r}", rule)
    used = {joint.name for joint, _ in tree}
    return tree, [joint for joint in joints if joint.name not in used]


def _can_close(joint: SdfJoint) -> bool:
    return joint.kind in CLOSING and not any(axis.stiffness for axis in joint.axes)


def _entries(joint: SdfJoint, turned: bool, poses: dict[str, Array]) -> list[JointEntry]:
    """Return what the joint is made of, from the link that carries to the one that hangs, with crosses between."""
    carries, hangs = (joint.child, joint.parent) if turned else (joint.parent, joint.child)
    parts = [
        (name, kind, -axis.direction if turned else axis.direction, axis.data) for name, kind, axis in _parts(joint)
    ]
    parts = parts[::-1] if turned else parts
    crosses = [f"{joint.name}_cross"] * (len(parts) - 1)
    entries = [
        JointEntry(name, kind, above, below, np.eye(4), direction, data)
        for (name, kind, direction, data), above, below in zip(
            parts, [carries, *crosses], [*crosses, hangs], strict=True
        )
    ]
    entries[0] = replace(entries[0], placement=relative(poses[carries], joint.pose), mimic=joint.mimic)
    entries[-1] = replace(entries[-1], offset=relative(joint.pose, poses[hangs]))
    return entries


def _parts(joint: SdfJoint) -> list[tuple[str, str, Axis]]:
    """Return name, kind and axis of the joints of one axis, or the ball, that a joint is made of."""
    if joint.kind == "ball":
        return [(joint.name, "SPHERICAL", Axis(_NO_AXIS, {"damping": [joint.damping] * 3}))]
    if joint.kind == "fixed":
        return [(joint.name, "fixed", Axis(_NO_AXIS))]
    if joint.kind in _TWO_HINGES:
        return [(f"{joint.name}_{k}", "revolute", axis) for k, axis in enumerate(joint.axes, start=1)]
    (axis,) = joint.axes
    if joint.kind == "screw":
        free = {"lower": [-UNLIMITED], "upper": [UNLIMITED]}
        return [(joint.name, "revolute", axis), (f"{joint.name}_slide", "prismatic", Axis(axis.direction, free))]
    if joint.kind == "continuous":
        data = {word: x for word, x in axis.data.items() if word not in ("lower", "upper")}
        return [(joint.name, "continuous", replace(axis, data=data))]
    return [(joint.name, joint.kind, axis)]


def _sprung(joint: SdfJoint, made: list[JointEntry]) -> list[tuple[JointEntry, Axis]]:
    by_name = {entry.name: entry for entry in made}
    return [(by_name[name], axis) for name, _, axis in _parts(joint) if axis.stiffness]


def _loop(joint: SdfJoint, poses: dict[str, Array]) -> Loop:
    ends = (joint.parent, joint.child)
    one, two = (relative(poses[link], joint.pose) for link in ends)
    axis = joint.axes[0].direction if joint.axes else _NO_AXIS
    return Loop(joint.name, joint.kind, ends, (one, two), axis)


def _lost(reader: Reader, closing: list[SdfJoint]) -> list[str]:
    """Return, in words, what a closure cannot have of the joint that it stands for.

    Raises:
        FileFormatError: a spring.
    """
    told = []
    for joint in closing:
        if any(axis.stiffness for axis in joint.axes):
            rule = "closes a loop and has a spring, which no closure has; cut the loop at a joint without one"
            raise reader.fail(f"joint {joint.name!r}", rule)
        data = joint.axes[0].data if joint.axes else {"damping": [joint.damping]}
        words = {"damping": 0.0, "friction": 0.0, "lower": -UNLIMITED, "upper": UNLIMITED}
        lost = [word for word, usual in words.items() if data.get(word, [usual]) != [usual]]
        lost += ["mimic"] if joint.mimic is not None else []
        told += [f"{' and '.join(lost)} of joint {joint.name!r} (it closes a loop)"] if lost else []
    return told


def _gears(reader: Reader, gearbox: SdfJoint, joints: list[SdfJoint], entries: dict[str, JointEntry]) -> Coupling:
    """Return theta_child + ratio theta_parent = 0, angles to the reference link about the axes of the gearbox."""
    where = f"joint {gearbox.name!r}"
    factors = {}
    for link, axis, factor in (
        (gearbox.child, gearbox.axes[1], 1.0),
        (gearbox.parent, gearbox.axes[0], gearbox.ratio),
    ):
        hinge = next(
            (j for j in joints if j.kind == "revolute" and {j.parent, j.child} == {link, gearbox.reference}), None
        )
        if hinge is None or hinge.name not in entries:
            rule = f"is a gearbox, and no hinge of the tree joins {link!r} to its reference body {gearbox.reference!r}"
            raise reader.fail(where, rule)
        n = gearbox.pose[:3, :3] @ axis.direction
        along = float(n @ hinge.pose[:3, :3] @ hinge.axes[0].direction)
        if abs(along) < np.sqrt(1.0 - _ALONG**2):
            raise reader.fail(where, f"is a gearbox about another axis than its hinge {hinge.name!r}")
        factors[hinge.name] = factor * np.sign(along) * (1.0 if hinge.child == link else -1.0)
    return Coupling(factors, name=gearbox.name)
