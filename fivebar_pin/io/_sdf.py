"""SDF text to a checked tree with its closures: the one model of a file or world that moves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import FileFormatError
from fivebar_pin.io._entries import UNIVERSE, JointEntry, LinkEntry, TreeEntry
from fivebar_pin.io._gazebo import controlled, detachable, others
from fivebar_pin.io._loops import close, closing_pairs
from fivebar_pin.io._sdf_frames import WORLD, Frames, relative
from fivebar_pin.io._sdf_joints import SdfJoint, read_joint
from fivebar_pin.io._sdf_link import read_link
from fivebar_pin.io._sdf_pose import text_numbers
from fivebar_pin.io._sdf_tree import hang
from fivebar_pin.io._stated import Stated
from fivebar_pin.io._xml import Reader

__all__ = ["read_sdf"]

_IN_MODEL = (
    "link", "joint", "frame", "model", "pose", "static", "self_collide", "allow_auto_disable", "enable_wind", "plugin",
)  # fmt: skip
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
    stated = hang(reader, model.get("name") or path.stem, root, links, poses, joints)
    tree = _with_frames(frames, stated.tree, poses)
    tree, joined = close(
        reader, tree, detachable(reader, plugins, poses) + (closing_pairs(tree) if named_loops else [])
    )
    motors = [name for name in dict.fromkeys(controlled(plugins)) if name in tree.joints]
    told += ["plugin"] * others(plugins) + ["sensor" for _ in model.findall("joint/sensor")]
    told += [str(element.tag) for element in model if element.tag not in _IN_MODEL]
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


def _root(joints: list[SdfJoint], links: dict[str, LinkEntry], poses: dict[str, Array]) -> str:
    """Return what the tree hangs on: the world, where a joint names it; else the first parent that is no child.

    In a ring of parents and children, and where there is no joint, the first link of all.
    """
    if any(WORLD in (joint.parent, joint.child) for joint in joints) and WORLD not in links:
        links[WORLD], poses[WORLD] = LinkEntry(WORLD), np.eye(4)
        return WORLD
    first = {joint.parent for joint in joints} - {joint.child for joint in joints}
    return next((link for link in links if link in first), next(iter(links)))
