"""URDF text to a checked tree; nothing reaches Pinocchio that was not understood here."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.closures import Coupling
from fivebar_pin.errors import FileFormatError, UnknownNameError
from fivebar_pin.io._build import stated_inertia
from fivebar_pin.io._entries import UNIVERSE, UNLIMITED, JointEntry, LinkEntry, TreeEntry
from fivebar_pin.io._find import title
from fivebar_pin.io._loops import close, closing_pairs
from fivebar_pin.io._stated import Stated
from fivebar_pin.io._urdf_besides import IN_JOINT, IN_LINK, read_loops, read_motors, read_springs, unread
from fivebar_pin.io._urdf_pose import pose
from fivebar_pin.io._urdf_visual import Colours, read_colours, read_visual
from fivebar_pin.io._xml import UNIT, Reader, direction

__all__ = ["read_urdf"]

_KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
_IN_ROBOT = ("link", "joint", "material", "gazebo", "transmission", "ros2_control", "loop_joint", "constraint")
_TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def read_urdf(path: Path, robot: ElementTree.Element, *, named_loops: bool = False) -> Stated:
    """Return what a URDF file states.

    Args:
        path: the file.
        robot: its root element.
        named_loops: close loops that are stated only by frames called closing_NAME_1 and closing_NAME_2.

    Raises:
        FileFormatError: anything that is not a tree of known joints with finite numbers; names file and element.
    """
    reader = Reader(path)
    reader.no_misspelt(robot, "<robot>", tags=_IN_ROBOT)
    colours = read_colours(reader, robot)
    links: dict[str, LinkEntry] = {}
    for element in robot.findall("link"):
        link = _link(reader, element, colours)
        if link.name in links:
            raise reader.fail(f"link {link.name!r}", "is defined twice")
        links[link.name] = link
    joints: dict[str, JointEntry] = {}
    for element in robot.findall("joint"):
        joint = _joint(reader, element)
        if joint.name in joints:
            raise reader.fail(f"joint {joint.name!r}", "is defined twice")
        joints[joint.name] = joint
    if not links:
        raise FileFormatError(path, "has no <link>")
    for name in (*links, *joints):
        if name == UNIVERSE:
            raise reader.fail(f"{name!r}", "is the name of the fixed world in Pinocchio; rename the link or joint")
    root = _root(reader, links, joints)
    tree = TreeEntry(title(robot.get("name"), path), root, links, joints)
    loops = read_loops(reader, robot, tree)
    found, closures = close(reader, tree, loops + (closing_pairs(tree) if named_loops else []))
    springs = read_springs(reader, robot, tree)
    return Stated(found, closures, read_motors(robot, tree), springs, left_out=unread(robot))


def _root(reader: Reader, links: dict[str, LinkEntry], joints: dict[str, JointEntry]) -> str:
    parent_joint: dict[str, str] = {}
    for joint in joints.values():
        for end in (joint.parent, joint.child):
            if end not in links:
                raise reader.fail(f"joint {joint.name!r}", str(UnknownNameError("link", end, links)))
        if joint.child in parent_joint:
            raise reader.fail(
                f"link {joint.child!r}",
                f"hangs on two joints ({parent_joint[joint.child]!r} and {joint.name!r}); a URDF is a tree: cut the "
                "loop there and name the two frames under closed_loop in the sidecar",
            )
        parent_joint[joint.child] = joint.name
    roots = [link for link in links if link not in parent_joint]
    if not roots:
        raise FileFormatError(reader.path, "has no root link: its joints go round in a circle; cut the loop")
    if len(roots) > 1:
        raise FileFormatError(reader.path, f"has {len(roots)} root links ({', '.join(roots[:5])}); a tree has one")
    reached, front = {roots[0]}, [roots[0]]
    children: dict[str, list[str]] = {}
    for joint in joints.values():
        children.setdefault(joint.parent, []).append(joint.child)
    while front:
        new = children.get(front.pop(), [])
        reached.update(new)
        front.extend(new)
    lost = [link for link in links if link not in reached]
    if lost:
        raise FileFormatError(reader.path, f"links {', '.join(lost[:5])} go round in a circle apart from the tree")
    return roots[0]


def _link(reader: Reader, element: ElementTree.Element, colours: Colours) -> LinkEntry:
    name = reader.text(element, "name", "a <link>")
    where = f"link {name!r}"
    reader.no_misspelt(element, where, tags=IN_LINK)
    inertial = reader.only(element, "inertial", where)
    visuals = tuple(read_visual(reader, visual, name, colours) for visual in element.findall("visual"))
    return LinkEntry(name, None if inertial is None else _inertia(reader, inertial, where), visuals)


def _inertia(reader: Reader, inertial: ElementTree.Element, where: str) -> pin.Inertia | None:
    reader.no_misspelt(inertial, where, tags=("origin", "mass", "inertia"))
    M = pose(reader, inertial, where)
    com, R = M[:3, 3], M[:3, :3]
    mass_element, tensor = reader.only(inertial, "mass", where), reader.only(inertial, "inertia", where)
    if mass_element is None or tensor is None:
        raise reader.fail(where, "<inertial> needs <mass> and <inertia>; leave <inertial> out for a massless link")
    (mass,) = reader.numbers(mass_element, "value", 1, where, None)
    if mass < 0.0:
        raise reader.fail(where, f"mass = {mass!r} must not be negative [kg]")
    reader.known(mass_element, ("value",), where)
    reader.known(tensor, _TENSOR, where)
    xx, xy, xz, yy, yz, zz = (reader.numbers(tensor, word, 1, where, None)[0] for word in _TENSOR)
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if not np.array_equal(R, np.eye(3)):
        inertia = R @ inertia @ R.T
        inertia = 0.5 * (inertia + inertia.T)
    return stated_inertia(mass, com, inertia)


def _joint(reader: Reader, element: ElementTree.Element) -> JointEntry:
    name = reader.text(element, "name", "a <joint>")
    where = f"joint {name!r}"
    kind = reader.text(element, "type", where)
    if kind not in _KINDS:
        raise reader.fail(where, str(UnknownNameError("joint type", kind, _KINDS)))
    reader.no_misspelt(element, where, tags=IN_JOINT)
    ends = []
    for tag in ("parent", "child"):
        end = reader.only(element, tag, where)
        if end is None:
            raise reader.fail(where, f"needs <{tag} link=...>")
        ends.append(reader.text(end, "link", where))
    if ends[0] == ends[1]:
        raise reader.fail(where, f"joins link {ends[0]!r} to itself")
    placement = pose(reader, element, where)
    axis = _axis(reader, element, kind, where)
    data = _joint_data(reader, element, kind, where)
    return JointEntry(name, kind, ends[0], ends[1], placement, axis, data, _mimic(reader, element, name, where))


def _mimic(reader: Reader, element: ElementTree.Element, name: str, where: str) -> Coupling | None:
    """Return q - multiplier q_other = offset, as <mimic> states it."""
    mimic = reader.only(element, "mimic", where)
    if mimic is None:
        return None
    reader.known(mimic, ("joint", "multiplier", "offset"), where)
    other = reader.text(mimic, "joint", where)
    if other == name:
        raise reader.fail(where, "mimics itself")
    (multiplier,) = reader.numbers(mimic, "multiplier", 1, where, [1.0])
    (offset,) = reader.numbers(mimic, "offset", 1, where, [0.0])
    tied = {other: -multiplier} if multiplier else {}
    return Coupling({name: 1.0, **tied}, offset, name=f"{name} mimic")


def _axis(reader: Reader, element: ElementTree.Element, kind: str, where: str) -> Array:
    stated = reader.only(element, "axis", where)
    reader.known(stated, ("xyz", "rpy"), where)  # rpy turns no axis, and is written by some all the same
    axis = np.array(reader.numbers(stated, "xyz", 3, where, [1.0, 0.0, 0.0]))
    if kind in ("fixed", "floating"):
        return axis
    try:
        unit = direction(axis)
    except ValueError:
        raise reader.fail(where, f"axis {axis.tolist()} has no direction") from None
    if kind == "planar" and not np.allclose(unit, [0.0, 0.0, 1.0], rtol=0.0, atol=UNIT):
        raise reader.fail(where, "a planar joint must have the axis 0 0 1; turn its <origin> instead")
    return unit


def _joint_data(reader: Reader, element: ElementTree.Element, kind: str, where: str) -> dict[str, list[float]]:
    """Return limits and losses; without <limit>, or with one of neither lower nor upper, nothing bounds the joint.

    With one of the two the other is zero.
    """
    if kind not in ("revolute", "continuous", "prismatic"):
        return {}
    limit, dynamics = reader.only(element, "limit", where), reader.only(element, "dynamics", where)
    reader.no_misspelt(limit, where, words=("lower", "upper", "effort", "velocity"))
    reader.no_misspelt(dynamics, where, words=("damping", "friction"))
    data = {
        "damping": reader.numbers(dynamics, "damping", 1, where, [0.0]),
        "friction": reader.numbers(dynamics, "friction", 1, where, [0.0]),
    }
    for word, (value,) in data.items():
        if value < 0.0:
            raise reader.fail(where, f"{word} = {value!r} must not be negative")
    for word in ("effort", "velocity"):
        data[word] = reader.numbers(limit, word, 1, where, [UNLIMITED], bound=UNLIMITED)
        if data[word][0] < 0.0:
            raise reader.fail(where, f"{word} limit = {data[word][0]!r} must not be negative")
    if limit is not None and kind != "continuous" and ("lower" in limit.attrib or "upper" in limit.attrib):
        data["lower"] = reader.numbers(limit, "lower", 1, where, [0.0], bound=UNLIMITED)
        data["upper"] = reader.numbers(limit, "upper", 1, where, [0.0], bound=UNLIMITED)
        if data["lower"][0] > data["upper"][0]:
            raise reader.fail(where, f"lower limit {data['lower'][0]!r} is above upper {data['upper'][0]!r}")
    return data
