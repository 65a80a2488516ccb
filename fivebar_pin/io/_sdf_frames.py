"""The links, joints, frames and nested models of an SDF model by name, and where they are.

Names within a nested model are NESTED::NAME outside of it. A pose is in the axes of what its relative_to names, and
else: of a link in the model, of a joint in its child, of a frame in what it is attached to or the model.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal
from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.io._sdf_pose import read_pose
from fivebar_pin.io._xml import Reader

__all__ = ["WORLD", "Frames", "Thing", "relative"]

WORLD = "world"
_TAGS: tuple[Literal["link", "joint", "frame", "model"], ...] = ("link", "joint", "frame", "model")


@dataclass(frozen=True, slots=True, eq=False)
class Thing:
    """Something of a model that has a place.

    Attributes:
        name: with the names of the nested models it is in.
        tag: of its element.
        element: what the file states of it.
        scope: names of the nested models it is in, "outer::inner::", or "".
    """

    name: str
    tag: Literal["link", "joint", "frame", "model"]
    element: ElementTree.Element
    scope: str


class Frames:
    """Everything of one model that has a place, in the order of the file."""

    def __init__(self, reader: Reader, model: ElementTree.Element) -> None:
        self.reader = reader
        self.things: dict[str, Thing] = {}
        self.joints: dict[str, Thing] = {}
        self.poses: dict[tuple[str, str], Array] = {}
        self._under_way: set[tuple[str, str]] = set()
        self.model = Thing("", "model", model, "")
        self._collect(model, "")

    def _collect(self, model: ElementTree.Element, scope: str) -> None:
        for element in model:
            tag = next((tag for tag in _TAGS if tag == element.tag), None)
            if tag is None:
                continue
            name = scope + self.reader.text(element, "name", f"a <{tag}>")
            known = self.joints if tag == "joint" else self.things
            if name in known:
                raise self.reader.fail(f"{tag} {name!r}", f"is the name of a {known[name].tag} already")
            known[name] = Thing(name, tag, element, scope)
            if tag == "model":
                self._collect(element, f"{name}::")

    def of(self, tag: str) -> list[Thing]:
        """Return the things of one kind."""
        return [thing for thing in (*self.things.values(), *self.joints.values()) if thing.tag == tag]

    def find(self, name: str, scope: str, where: str) -> Thing:
        """Return what is called so within nested models; a joint only where nothing else is (up to 1.6 both may be)."""
        if name == "__model__":
            return self.things[scope.removesuffix("::")] if scope else self.model
        found = self.things.get(scope + name) or self.joints.get(scope + name)
        if found is None:
            known = [x.removeprefix(scope) for x in (*self.things, *self.joints) if x.startswith(scope)]
            raise self.reader.fail(where, str(UnknownNameError("link, joint, frame or model", name, known)))
        return found

    def link(self, name: str, scope: str, where: str) -> str:
        """Return the link that carries what is called so; the world is the world.

        Raises:
            FileFormatError: nothing is called so, or it is attached to itself.
        """
        seen: set[tuple[str, str]] = set()
        while name != WORLD or scope + name in self.things:
            thing = self.find(name, scope, where)
            if (thing.tag, thing.name) in seen:
                raise self.reader.fail(where, f"{thing.name!r} is attached to itself in a circle")
            seen.add((thing.tag, thing.name))
            if thing.tag == "link":
                return thing.name
            name, scope = self._carrier(thing, where)
        return WORLD

    def _carrier(self, thing: Thing, where: str) -> tuple[str, str]:
        """Return the name, and the scope it is a name in, of what carries a joint, a frame or a nested model."""
        if thing.tag == "joint":
            return thing.element.findtext("child", "").strip(), thing.scope
        attached = thing.element.get("attached_to", "")
        if thing.tag == "frame":
            return attached or "__model__", thing.scope
        inside = f"{thing.name}::" if thing.name else ""
        first = next((t.name for t in self.of("link") if t.name.startswith(inside)), None)
        if first is None:
            raise self.reader.fail(where, f"model {thing.name!r} has no <link>")
        return thing.element.get("canonical_link") or first.removeprefix(inside), inside

    def pose(self, thing: Thing) -> Array:
        """Return where a thing is in the world, all joints at zero, homogeneous (4, 4)."""
        key = (thing.tag, thing.name)
        if key not in self.poses:
            where = f"{thing.tag} {thing.name!r}"
            if key in self._under_way:
                raise self.reader.fail(where, "is placed relative to itself in a circle")
            self._under_way.add(key)
            base = self._base(thing, where)
            own = read_pose(self.reader, thing.element, where)
            self.poses[key] = own if np.array_equal(base, np.eye(4)) else base @ own
        return self.poses[key]

    def _base(self, thing: Thing, where: str) -> Array:
        if thing is self.model:
            return np.eye(4)
        stated = stated_frame(thing.element)
        if thing.tag == "joint":
            stated = stated or self._carrier(thing, where)[0]
        elif thing.tag == "frame":
            stated = stated or thing.element.get("attached_to", "")
        return self.named_pose(stated or "__model__", thing.scope, where)

    def named_pose(self, name: str, scope: str, where: str) -> Array:
        """Return where the thing of this name is in the world, (4, 4)."""
        if name == WORLD and scope + name not in self.things:
            return np.eye(4)
        return self.pose(self.find(name, scope, where))


def stated_frame(element: ElementTree.Element) -> str:
    """Return what the <pose> of an element is relative to, "" where it does not say; `frame` is its name up to 1.6."""
    pose = element.find("pose")
    return "" if pose is None else pose.get("relative_to") or pose.get("frame") or ""


def relative(base: Array, M: Array) -> Array:
    """Return a pose in the axes of another, base^-1 M; exactly the identity where they are one."""
    if np.array_equal(base, M):
        return np.eye(4)
    result = np.eye(4)
    result[:3, :3] = base[:3, :3].T @ M[:3, :3]
    result[:3, 3] = base[:3, :3].T @ (M[:3, 3] - base[:3, 3])
    return result
