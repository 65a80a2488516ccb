"""SDF text to a checked tree with its closures: the one model of a file or world that moves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import FileFormatError
from fivebar_pin.io._entries import UNIVERSE, JointEntry, LinkEntry, TreeEntry
from fivebar_pin.io._find import title
from fivebar_pin.io._gazebo import controlled, detachable, others
from fivebar_pin.io._loops import BALL_WORDS, Loop, close, closing_pairs, refuse_forces, shared_point
from fivebar_pin.io._sdf_frames import WORLD, Frames, relative
from fivebar_pin.io._sdf_joints import SdfJoint, read_joint
from fivebar_pin.io._sdf_link import read_link
from fivebar_pin.io._sdf_pose import said_numbers, text_numbers
from fivebar_pin.io._sdf_tree import hang
from fivebar_pin.io._stated import Stated
from fivebar_pin.io._xml import Reader

__all__ = ["read_sdf"]

_IN_MODEL = (
    "link", "joint", "frame", "model", "pose", "static", "self_collide", "allow_auto_disable", "enable_wind", "plugin",
    "drake:ball_constraint", "drake:weld_constraint",
)  # fmt: skip
_BALL, _WELD = "drake:ball_constraint", "drake:weld_constraint"
_IN_WORLD = ("model", "gravity", "include")
"""Elements of a world that are read, or told of one by one."""


def read_sdf(path: Path, sdf: ElementTree.Element, *, named_loops: bool = False) -> Stated:
    """Return what an SDF file states.

    Args:
        path: the file.
        sdf: its root element.
        named_loops: close loops that are stated only by frames called closing_NAME_1 and closing_NAME_2.

    Raises:
        FileFormatError: anything but one model of known joints with finite numbers; names file and element.
    """
    reader = Reader(path)
    version = reader.number(reader.text(sdf, "version", "<sdf>"), "version", "<sdf>")
    model, gravity, told = _the_model(reader, sdf)
    for include in model.iter("include"):
        rule = "is not read inside a model; `gz sdf -p FILE` writes a model out with all that it includes"
        raise reader.fail(f"<include> of {include.findtext('uri', '').strip()!r}", rule)
    reader.no_misspelt(model, "<model>", tags=_IN_MODEL)
    refuse_forces(reader, model)
    frames = Frames(reader, model)
    links: dict[str, LinkEntry] = {}
    for thing in frames.of("link"):
        links[thing.name], lost = read_link(reader, frames, thing)
        told += lost
    if not links:
        raise FileFormatError(path, "has no <link>")
    joints = [read_joint(reader, frames, thing, version) for thing in frames.of("joint")]
    if UNIVERSE in (*links, *(joint.name for joint in joints)):
        raise reader.fail(f"{UNIVERSE!r}", "is the name of the fixed world in Pinocchio; rename the link or joint")
    poses = {thing.name: frames.pose(thing) for thing in frames.of("link")}
    root = _root(joints, links, poses)
    plugins = model.findall("plugin")
    stated = hang(reader, title(model.get("name"), path), root, links, poses, joints)
    tree = _with_frames(frames, stated.tree, poses)
    loops = [*detachable(reader, plugins, poses), *_constraints(reader, frames, model)]
    tree, joined = close(reader, tree, loops + (closing_pairs(tree) if named_loops else []))
    motors = [name for name in dict.fromkeys(controlled(plugins)) if name in tree.joints]
    told += ["plugin"] * others(plugins) + ["sensor"] * len(model.findall("joint/sensor"))
    told += ["initial position"] * len(model.findall("joint/axis/initial_position"))
    told += [f"{element.tag} element" for element in model if element.tag not in _IN_MODEL]
    closures = (*stated.closures, *joined)
    return Stated(tree, closures, tuple(motors), stated.springs, gravity, [*told, *stated.left_out])


def _the_model(
    reader: Reader, sdf: ElementTree.Element
) -> tuple[ElementTree.Element, tuple[float, ...] | None, list[str]]:
    """Return the model that moves, the gravity of its world, and what is beside it."""
    worlds = sdf.findall("world")
    models = [*sdf.findall("model"), *(model for world in worlds for model in world.findall("model"))]
    fixed = [model for model in models if model.findtext("static", "0").strip() in ("1", "true")]
    moving = [model for model in models if model not in fixed]
    included = [uri.text or "" for world in worlds for uri in world.findall("include/uri")]
    if len(moving) != 1:
        names = [repr(model.get("name", "")) for model in moving]
        what = f"holds {len(moving)} models that move ({', '.join(names)})" if names else "holds no model that moves"
        way_out = "put the one to load into a file of its own"
        if included and not moving:
            way_out = f"load the file of what it includes ({', '.join(uri.strip() for uri in included)}) itself"
        elif fixed and not moving:
            way_out = "its models are <static>; take that away from the one to load"
        raise FileFormatError(reader.path, f"{what}; {way_out}")
    told = [f"static model {model.get('name', '')!r}" for model in fixed]
    told += [f"include of {uri.strip()}" for uri in included]
    told += [f"{element.tag} of the world" for world in worlds for element in world if element.tag not in _IN_WORLD]
    stated = [world for world in worlds if world.find("gravity") is not None]
    if not stated:
        return moving[0], None, told
    return moving[0], tuple(text_numbers(reader, stated[0], "gravity", 3, "<world>", None)), told


def _with_frames(frames: Frames, tree: TreeEntry, poses: dict[str, Array]) -> TreeEntry:
    """Return the tree with the <frame>s of the model as links without mass, for sidecars to name."""
    links, joints = dict(tree.links), dict(tree.joints)
    for thing in frames.of("frame"):
        carrier = frames.link(thing.name, "", f"frame {thing.name!r}")
        if carrier in poses and thing.name not in joints:
            placement = relative(poses[carrier], frames.pose(thing))
            links[thing.name] = LinkEntry(thing.name)
            joints[thing.name] = JointEntry(
                thing.name, "fixed", carrier, thing.name, placement, np.array([1.0, 0.0, 0.0])
            )
    return replace(tree, links=links, joints=joints)


def _constraints(reader: Reader, frames: Frames, model: ElementTree.Element) -> list[Loop]:
    """Return the loops that constraints of Drake close: a point that two bodies share, frames that are one."""
    loops = []
    for k, ball in enumerate(_tagged(model, _BALL), start=1):
        where = f"<{_BALL}>"
        body_a, body_b, p_a, p_b = ((f"{_BALL}_{word}", _text(ball, f"{_BALL}_{word}")) for word in BALL_WORDS)
        one, two = (frames.link(name, "", where) for _, name in (body_a, body_b))
        first, second = (said_numbers(reader, text, tag, 3, where, None) for tag, text in (p_a, p_b))
        loops.append(shared_point(f"ball_constraint_{k}", (one, two), (first, second)))
    for weld in _tagged(model, _WELD):
        one, two = (frames.find(_text(weld, tag), "", f"<{_WELD}>").name for tag in ("parent", "child"))
        loops.append(Loop(f"{one}~{two}", "fixed", (one, two), (np.eye(4), np.eye(4)), np.array([1.0, 0.0, 0.0])))
    return loops


def _tagged(model: ElementTree.Element, tag: str) -> list[ElementTree.Element]:
    """Return the children with a tag that has a prefix, which paths of ElementTree do not take as part of it."""
    return [element for element in model if element.tag == tag]


def _text(element: ElementTree.Element, tag: str) -> str:
    return "".join(child.text or "" for child in _tagged(element, tag)).strip()


def _root(joints: list[SdfJoint], links: dict[str, LinkEntry], poses: dict[str, Array]) -> str:
    """Return what the tree hangs on: the world, where a joint names it; else the first parent that is no child.

    In a ring of parents and children, and where there is no joint, the first link of all.
    """
    if any(WORLD in (joint.parent, joint.child) for joint in joints) and WORLD not in links:
        links[WORLD], poses[WORLD] = LinkEntry(WORLD), np.eye(4)
        return WORLD
    first = {joint.parent for joint in joints} - {joint.child for joint in joints}
    return next((link for link in links if link in first), next(iter(links)))
