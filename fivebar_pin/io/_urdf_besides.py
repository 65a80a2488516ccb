"""What URDF files state beside the tree: loops in the dialects of several simulators, motors, springs, and the rest.

<gazebo><joint name type><parent>LINK</parent><child>LINK</child><pose>in the child, at zero</pose><axis/></joint>
<loop_joint name type><link1 link xyz rpy/><link2 link xyz rpy/><axis xyz/></loop_joint>
<loop_joint|constraint name type><parent link/><parent_origin xyz rpy/><child link/><child_origin/><axis/>
<drake:ball_constraint> with the bodies A and B, and a point of each
frames (links) called closing_NAME_1 and closing_NAME_2, which meet at a point
"""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.io._entries import TreeEntry
from fivebar_pin.io._gazebo import controlled, detachable, others
from fivebar_pin.io._loops import BALL_WORDS, Loop, refuse_forces, shared_point, world_poses
from fivebar_pin.io._sdf_frames import relative
from fivebar_pin.io._sdf_pose import read_pose, text_numbers
from fivebar_pin.io._urdf_pose import stated_pose
from fivebar_pin.io._xml import Reader, direction
from fivebar_pin.springs import JointSpring

__all__ = ["IN_JOINT", "IN_LINK", "read_loops", "read_motors", "read_springs", "unread"]

_DIALECTS = ("loop_joint", "loop", "constraint")
_BALL = "drake:ball_constraint"
_READ = ("link", "joint", "material", "transmission", "ros2_control", "gazebo", *_DIALECTS, _BALL)
IN_LINK = ("inertial", "visual", "collision", "collision_checking", "self_collision_checking", "contact")
IN_JOINT = ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic", "calibration", "safety_controller")
_READ_OF_GAZEBO = ("joint", "plugin", "springStiffness", "springReference")
_X = [1.0, 0.0, 0.0]


def local(element: ElementTree.Element) -> str:
    """Return the tag of an element without its prefix."""
    return str(element.tag).rpartition(":")[2]


def read_loops(reader: Reader, robot: ElementTree.Element, tree: TreeEntry) -> list[Loop]:
    """Return the loops that elements of the file close.

    Raises:
        FileFormatError: an element that is malformed, names no link, or acts in a way that is not read.
    """
    refuse_forces(reader, robot)
    loops: list[Loop] = []
    for element in robot:
        if element.tag in _DIALECTS:
            loops.append(_stated_loop(reader, element))
        elif element.tag == _BALL:
            loops.append(_ball(reader, element, len(loops)))
    poses = world_poses(tree)
    loops += [_gazebo_loop(reader, element, poses) for element in robot.findall("gazebo/joint")]
    return loops + detachable(reader, robot.findall("gazebo/plugin"), poses)


def _gazebo_loop(reader: Reader, element: ElementTree.Element, poses: dict[str, Array]) -> Loop:
    """Return a joint of SDF between two links, which sits where it is in the child with all joints at zero."""
    name = reader.text(element, "name", "a <joint> in <gazebo>")
    where = f"joint {name!r} in <gazebo>"
    ends = [element.findtext(tag, "").strip() for tag in ("parent", "child")]
    for end in ends:
        if end not in poses:
            raise reader.fail(where, str(UnknownNameError("link", end, poses)))
    parent, child = ends
    in_child = read_pose(reader, element, where)
    joint = poses[child] @ in_child
    in_parent = relative(poses[parent], joint)
    axis = np.array(text_numbers(reader, element, "axis/xyz", 3, where, _X))
    if element.findtext("axis/use_parent_model_frame", "0").strip() in ("1", "true"):
        axis = joint[:3, :3].T @ axis
    kind = reader.text(element, "type", where)
    return Loop(name, kind, (parent, child), (in_parent, in_child), _unit(reader, axis, where))


def _stated_loop(reader: Reader, element: ElementTree.Element) -> Loop:
    """Return a loop whose element places the joint in both links; the axis is in the axes of the joint in the first."""
    name = reader.text(element, "name", f"a <{element.tag}>")
    where = f"{element.tag} {name!r}"
    kind = reader.text(element, "type", where)
    ends = [*element.findall("link1"), *element.findall("link2")]
    places: list[ElementTree.Element | None] = [*ends]
    if not ends:
        ends = [*element.findall("parent"), *element.findall("child")]
        places = [reader.only(element, f"{tag}_origin", where) for tag in ("parent", "child")]
    if len(ends) != 2:
        rule = "needs its two links: <link1 link= xyz= rpy=/> and <link2 .../>, or <parent link=/>, <parent_origin/>"
        raise reader.fail(where, rule + ", <child link=/> and <child_origin/>")
    one, two = (reader.text(end, "link", where) for end in ends)
    first, second = (stated_pose(reader, place, where) for place in places)
    stated = reader.only(element, "axis", where)
    axis = np.array(reader.numbers(stated, "xyz", 3, where, _X))
    if stated is not None and stated.get("frame") == "parent":
        axis = first[:3, :3].T @ axis
    return Loop(name, kind, (one, two), (first, second), _unit(reader, axis, where))


def _ball(reader: Reader, element: ElementTree.Element, number: int) -> Loop:
    """Return the point that two bodies share."""
    where = f"<{_BALL}>"
    stated = {str(child.tag).removeprefix(f"{_BALL}_"): child for child in element}
    for word in BALL_WORDS:
        if word not in stated:
            raise reader.fail(where, f"needs <{_BALL}_{word}>")
    one, two = (reader.text(stated[word], "name", where) for word in BALL_WORDS[:2])
    first, second = (reader.numbers(stated[word], "value", 3, where, None) for word in BALL_WORDS[2:])
    return shared_point(f"ball_constraint_{number + 1}", (one, two), (first, second))


def _unit(reader: Reader, axis: Array, where: str) -> Array:
    try:
        return direction(axis)
    except ValueError:
        raise reader.fail(where, f"axis {axis.tolist()} has no direction") from None


def read_motors(robot: ElementTree.Element, tree: TreeEntry) -> tuple[str, ...]:
    """Return the joints of transmissions, of ros2_control and of controllers that take commands and can be driven."""
    stated = [joint.get("name") for joint in robot.findall("transmission/joint")]
    stated += [j.get("name") for j in robot.findall("ros2_control/joint") if j.find("command_interface") is not None]
    stated += controlled(robot.findall("gazebo/plugin"))
    driven = ("revolute", "continuous", "prismatic")
    free = {name for name, joint in tree.joints.items() if joint.kind in driven and joint.mimic is None}
    return tuple(dict.fromkeys(name for name in stated if name is not None and name in free))


def read_springs(reader: Reader, robot: ElementTree.Element, tree: TreeEntry) -> tuple[JointSpring, ...]:
    """Return the springs that <gazebo reference=JOINT> gives to hinges and slides."""
    springs = []
    for element in robot.findall("gazebo"):
        joint = element.get("reference", "")
        where = f"<gazebo> of joint {joint!r}"
        stiffness, rest = (
            text_numbers(reader, element, tag, 1, where, [0.0])[0] for tag in ("springStiffness", "springReference")
        )
        if stiffness:
            if joint not in tree.joints:
                raise reader.fail(where, str(UnknownNameError("joint", joint, tree.joints)))
            springs.append(JointSpring(joint, stiffness, rest))
    return tuple(springs)


def unread(robot: ElementTree.Element) -> list[str]:
    """Return, in words, what elements of the file have no part in the motion of rigid bodies."""
    settings = [child for child in robot.findall("gazebo/*") if child.tag not in _READ_OF_GAZEBO]
    of_gazebo = [f"gazebo {'sensor' if child.tag == 'sensor' else 'setting'}" for child in settings]
    of_gazebo += ["gazebo plugin"] * others(robot.findall("gazebo/plugin"))
    other = [element for element in robot if element.tag not in _READ]
    for path, known in (("link/*", IN_LINK), ("joint/*", IN_JOINT)):
        other += [element for element in robot.findall(path) if local(element) not in known]
    turned = ["axis rpy" for axis in robot.findall("joint/axis") if "rpy" in axis.attrib]
    return [*of_gazebo, *(f"{local(element)} element" for element in other), *turned]
