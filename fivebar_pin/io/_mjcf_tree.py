"""MJCF bodies to the same tree of links and joints that a URDF gives."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import Visual
from fivebar_pin.errors import FiveBarPinError, UnknownNameError
from fivebar_pin.io._entries import UNIVERSE, UNLIMITED, JointEntry, LinkEntry, TreeEntry
from fivebar_pin.io._mjcf_assets import Assets
from fivebar_pin.io._mjcf_mass import geom_inertia, stated_inertia
from fivebar_pin.io._mjcf_reader import MjcfReader, homogeneous, turn
from fivebar_pin.io._mjcf_visuals import geom_visual
from fivebar_pin.springs import JointSpring

__all__ = ["WORLD", "BodyTree"]

WORLD = "world"
_KINDS = {"hinge": "revolute", "slide": "prismatic", "ball": "SPHERICAL", "free": "floating"}
_READ = ("body", "frame", "freejoint", "geom", "inertial", "joint", "site")
_LEFT_OUT = ("camera", "light")


class BodyTree:
    """The bodies of one file, walked in the file's order.

    Attributes:
        links, joints, order: what a `TreeEntry` needs, and the moving joints in MuJoCo's order.
        refs: coordinate of hinges and slides as the file places them, where that is not zero [rad or m].
        poses: pose of each link in the world as the file places it.
        bodies: link of each body.
        places: pose of each body's link in its parent, as the file places it.
        compensated: number of bodies with gravcomp.
        sites: link that stands for each named site.
        data: armature and losses per joint.
        springs: on joints, in the order of the joints.
        rests: where the springs of hinges and slides are relaxed, whether there is one or not [rad or m].
    """

    def __init__(self, reader: MjcfReader, assets: Assets) -> None:
        self.reader, self.assets = reader, assets
        self.links: dict[str, LinkEntry] = {WORLD: LinkEntry(WORLD)}
        self.joints: dict[str, JointEntry] = {}
        self.order: list[str] = []
        self.poses: dict[str, Array] = {WORLD: np.eye(4)}
        self.bodies: dict[str, str] = {WORLD: WORLD}
        self.places: dict[str, Array] = {}
        self.compensated = 0
        self.sites: dict[str, str] = {}
        self.data: dict[str, dict[str, list[float]]] = {}
        self.springs: list[JointSpring] = []
        self.rests: dict[str, float] = {}
        self.refs: dict[str, float] = {}

    def tree(self, name: str) -> TreeEntry:
        """Return the tree that was walked."""
        return TreeEntry(name, WORLD, self.links, self.joints)

    def world(self, worldbody: ElementTree.Element) -> None:
        """Walk <worldbody>; recursion is bounded by the depth that the XML reader admits."""
        self.reader.without_frames(worldbody)
        if worldbody.attrib.get("name", WORLD) != WORLD:
            raise self.reader.fail("<worldbody>", "is always called world")
        self.contents(worldbody, WORLD, WORLD, worldbody.get("childclass"))

    def contents(self, body: ElementTree.Element, link: str, where: str, childclass: str | None) -> None:
        visuals: list[Visual] = []
        for child in body:
            if child.tag == "body":
                self.body(child, link, childclass)
            elif child.tag == "site":
                self.site(self.reader.with_defaults(child, childclass), link, where)
            elif child.tag == "geom":
                full = self.reader.with_defaults(child, childclass)
                visuals += geom_visual(self.reader, self.assets, full, link, f"geom of {where}")
            elif child.tag in ("joint", "freejoint", "inertial") and body.tag == "worldbody":
                raise self.reader.fail(where, f"<{child.tag}> is not for the world")
            elif child.tag in _LEFT_OUT:
                self.reader.left_out.append(child.tag)
            elif child.tag not in _READ:
                problem = str(UnknownNameError("element of a body", child.tag, (*_READ, *_LEFT_OUT)))
                raise self.reader.fail(where, problem + " Elements that generate others must be written out.")
        old = self.links[link]
        self.links[link] = LinkEntry(link, old.inertia, tuple(visuals))

    def body(self, body: ElementTree.Element, parent: str, above: str | None) -> None:
        reader = self.reader
        name = body.get("name") or f"body_{len(self.bodies)}"
        where = f"body {name!r}"
        if name in self.bodies:
            raise reader.fail(where, "is defined twice")
        reader.check_known(body, where)
        if any(_plain(reader, body, "gravcomp", where)):
            self.compensated += 1
        if body.get("mocap", "false") == "true":
            reader.left_out.append(f"mocap of {where}, which stays where it is")
        childclass = body.get("childclass", above)
        pose = reader.pose(body, where)
        joints = [reader.with_defaults(j, childclass) for j in body if j.tag == "joint"]
        joints += [ElementTree.Element("freejoint", j.attrib) for j in body if j.tag == "freejoint"]
        inertia = self.inertia(body, childclass, where)
        if joints and inertia is not None and inertia.mass == 0.0:
            raise reader.fail(where, "has mass = 0 and moves; give it a mass, or leave <inertial> out if it has none")
        self.bodies[name] = link = self.new_link(name)
        self.places[link] = pose
        self.chain_of_joints(joints, parent, link, pose, where)
        self.links[link] = LinkEntry(link, inertia)
        self.contents(body, link, where, childclass)

    def chain_of_joints(
        self, joints: list[ElementTree.Element], parent: str, link: str, pose: Array, where: str
    ) -> None:
        """Hang a body on its parent by its joints one after the other, massless links between them."""
        offset = np.zeros(3)
        self.poses[link] = self.poses[parent] @ pose
        for k, element in enumerate(joints):
            name = element.get("name") or f"{where.split(chr(39))[1]}_joint{k + 1 if len(joints) > 1 else ''}"
            position, kind, axis = self.joint(element, name, len(joints))
            M = np.eye(4) if k else np.array(pose)
            M[:3, 3] = M[:3, :3] @ (position - offset) + M[:3, 3]
            offset = position
            last = k == len(joints) - 1 and not np.any(offset)
            child = link if last else self.new_link(f"{name}_link")
            if child != link:
                self.links[child] = LinkEntry(child)
                self.poses[child] = self.poses[parent] @ M
            limits = self.limits(element, kind, name)
            self.joints[name] = JointEntry(name, kind, parent, child, self.at_zero(name, kind, M, axis), axis, limits)
            self.order.append(name)
            parent = child
        if not joints or np.any(offset):
            M = np.eye(4) if joints else np.array(pose)
            M[:3, 3] -= offset
            bracket = self.free_joint_name(f"{link}_fixed")
            self.joints[bracket] = JointEntry(bracket, "fixed", parent, link, M, np.eye(3)[0])

    def joint(self, element: ElementTree.Element, name: str, count: int) -> tuple[Array, str, Array]:
        reader, where = self.reader, f"joint {name!r}"
        if name in self.joints:
            raise reader.fail(where, "is defined twice")
        if element.tag == "freejoint":
            reader.check_known(element, where)
        word = "free" if element.tag == "freejoint" else element.get("type", "hinge")
        if word not in _KINDS:
            raise reader.fail(where, str(UnknownNameError("joint type", word, _KINDS)))
        if word == "free" and count > 1:
            raise reader.fail(where, "a free joint must be the only one of its body")
        for attribute in ("springdamper", "springyield"):
            if any(_plain(reader, element, attribute, where)):
                raise reader.fail(where, f"{attribute} is not supported; remove it, and state stiffness and damping")
        self.spring(element, name, word, where)
        if word == "free":
            if "true" in (element.get("align"), reader.compiler.get("alignfree")):
                raise reader.fail(where, "a frame moved to the mass centre is not supported; remove align or alignfree")
            return np.zeros(3), _KINDS[word], np.array([0.0, 0.0, 1.0])
        if word != "ball":
            (ref,) = reader.numbers(element, "ref", 1, where, [0.0])
            self.refs[name] = reader.angle(ref) if word == "hinge" else ref
        M = reader.frame(element)
        position = np.array(reader.numbers(element, "pos", 3, where, [0.0, 0.0, 0.0]))
        axis = reader.unit(np.array(reader.numbers(element, "axis", 3, where, [0.0, 0.0, 1.0])), "axis", where)
        return M[:3, :3] @ position + M[:3, 3], _KINDS[word], M[:3, :3] @ axis

    def at_zero(self, name: str, kind: str, M: Array, axis: Array) -> Array:
        """Return the placement at which the coordinate counts from zero, as the file places the joint at `ref`."""
        ref = self.refs.get(name, 0.0)
        if not ref:
            return M
        if kind == "prismatic":
            return M @ homogeneous(-ref * axis, np.eye(3))
        return M @ homogeneous(np.zeros(3), turn(axis, -ref))

    def spring(self, element: ElementTree.Element, name: str, word: str, where: str) -> None:
        """Keep the spring of a joint."""
        (stiffness,) = self.reader.numbers(element, "stiffness", 1, where, [0.0])
        if word not in ("hinge", "slide"):
            if stiffness:
                raise self.reader.fail(where, f"stiffness of a {word} joint is not supported; remove it")
            return
        (rest,) = self.reader.numbers(element, "springref", 1, where, [0.0])
        self.rests[name] = self.reader.angle(rest) if word == "hinge" else rest
        try:
            if stiffness:
                self.springs.append(JointSpring(name, stiffness, self.rests[name]))
        except FiveBarPinError as error:
            raise self.reader.fail(where, str(error)) from error

    def limits(self, element: ElementTree.Element, kind: str, name: str) -> dict[str, list[float]]:
        reader, where = self.reader, f"joint {name!r}"
        count = {"SPHERICAL": 3, "floating": 6}.get(kind, 1)
        losses = {"armature": "armature", "damping": "damping", "friction": "frictionloss"}
        for word, attribute in losses.items():
            (value,) = reader.numbers(element, attribute, 1, where, [0.0])
            if value < 0.0:
                raise reader.fail(where, f"{attribute} = {value!r} must not be negative")
            if value:
                self.data.setdefault(name, {})[word] = [value] * count
        if count > 1:
            return {}
        data = {"effort": [UNLIMITED], "velocity": [UNLIMITED], "lower": [-UNLIMITED], "upper": [UNLIMITED]}
        if self.limited(element, "limited", "range", where):
            scale = reader.angle(1.0) if kind == "revolute" else 1.0
            low, high = reader.numbers(element, "range", 2, where, None, bound=UNLIMITED)
            if low > high:
                raise reader.fail(where, f"range {low!r} {high!r} is upside down")
            data["lower"], data["upper"] = [low * scale], [high * scale]
        if self.limited(element, "actuatorfrclimited", "actuatorfrcrange", where):
            low, high = reader.numbers(element, "actuatorfrcrange", 2, where, None, bound=UNLIMITED)
            data["effort"], data["effort_lower"] = [high], [low]
        return data

    def limited(self, element: ElementTree.Element, attribute: str, bounds: str, where: str) -> bool:
        stated = self.reader.flag(element, attribute, where, "auto")
        if stated != "auto":
            return stated == "true"
        if bounds in element.attrib and self.reader.compiler.get("autolimits", "true") == "false":
            raise self.reader.fail(
                where, f"states {bounds} without {attribute} while autolimits is off; state {attribute}"
            )
        return bounds in element.attrib

    def inertia(self, body: ElementTree.Element, childclass: str | None, where: str) -> pin.Inertia | None:
        reader = self.reader
        stated = reader.only(body, "inertial", where)
        rule = reader.compiler.get("inertiafromgeom", "auto")
        if stated is not None and rule != "true":
            return stated_inertia(reader, stated, where)
        compiler = ElementTree.Element("compiler", reader.compiler)
        low, high = reader.numbers(compiler, "inertiagrouprange", 2, "<compiler>", [0.0, 5.0])
        total: pin.Inertia | None = None
        if rule != "false":
            for geom in body.findall("geom"):
                full = reader.with_defaults(geom, childclass)
                if not low <= reader.numbers(full, "group", 1, where, [0.0])[0] <= high:
                    continue
                part = geom_inertia(reader, self.assets, full, f"geom of {where}")
                total = part if total is None else total if part is None else total + part
        return stated_inertia(reader, stated, where) if total is None and stated is not None else total

    def site(self, site: ElementTree.Element, link: str, where: str) -> None:
        name = site.get("name")
        if not name:
            return
        if name in self.sites:
            raise self.reader.fail(f"site {name!r}", "is defined twice")
        M = self.reader.pose(site, f"site {name!r} of {where}")
        self.sites[name] = self.frame(name, link, M)

    def frame(self, name: str, link: str, M: Array) -> str:
        """Add a massless link fixed to another; return its name.

        A link's own frame, and the world's, are there already and are not added again.
        """
        if np.array_equal(M, np.eye(4)) and (name == link or (name, link) == (UNIVERSE, WORLD)):
            return name
        new = self.new_link(name)
        joint = self.free_joint_name(f"{new}_joint")
        self.links[new] = LinkEntry(new)
        self.joints[joint] = JointEntry(joint, "fixed", link, new, M, np.eye(3)[0])
        self.poses[new] = self.poses[link] @ M
        return new

    def new_link(self, name: str) -> str:
        k, free = 1, name
        while free in self.links or free == UNIVERSE:
            k, free = k + 1, f"{name}_{k}"
        self.links[free] = LinkEntry(free)
        return free

    def free_joint_name(self, name: str) -> str:
        k, free = 1, name
        while free in self.joints:
            k, free = k + 1, f"{name}_{k}"
        return free


def _plain(reader: MjcfReader, element: ElementTree.Element, attribute: str, where: str) -> list[float]:
    return [reader.number(word, attribute, where) for word in element.get(attribute, "").split()]
