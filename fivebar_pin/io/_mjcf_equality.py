"""The equality section of an MJCF file as closures.

    connect               3d; two connects that our writer marked as a hinge give one revolute closure
    weld                  6d
    joint                 coupling of one or two joints, q_1 = a_0 + a_1 q_2
    tendon, of fixed ones coupling of any number of joints, sum of coef q = a_0 (+ a_1 times the other tendon)
    tendon, of a spatial  distance, where the tendon joins two sites and nothing else

MuJoCo counts joints and tendons from the configuration of the file, in which a joint is at its `ref`.
Equalities that are not active are told and left out.
"""

from __future__ import annotations

from collections.abc import Callable
from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.closures import Closure, Coupling, Distance, Point, Revolute, Weld
from fivebar_pin.errors import FileFormatError, FiveBarPinError, UnknownNameError
from fivebar_pin.io._mjcf_reader import MjcfReader, homogeneous, quaternion_matrix
from fivebar_pin.io._mjcf_sections import disabled
from fivebar_pin.io._mjcf_tree import WORLD, BodyTree

__all__ = ["FACTOR", "HINGE", "Equality", "fixed_ratios"]

HINGE, FACTOR = "revolute closure ", "coupling factor "
"""Names of <custom><numeric> entries that our writer makes.

The axis of a hinge made of two connects; what the row of a joint equality, whose first ratio is one, is multiplied by.
"""


class Equality:
    """Turns the equality section into closures, adding the frames that it implies."""

    def __init__(self, reader: MjcfReader, root: ElementTree.Element, bodies: BodyTree) -> None:
        self.reader, self.bodies = reader, bodies
        self.off = "equality" in disabled(reader, root)
        self.elements = root.findall("equality/*")
        self.tendons = {x.get("name", ""): x for x in root.findall("tendon/*")}
        self.hinges = self.marked(root, HINGE, 3)
        self.factors = self.marked(root, FACTOR, 1)

    def marked(self, root: ElementTree.Element, prefix: str, count: int) -> dict[str, list[float]]:
        """Return the numbers that our writer noted, by the name of the closure."""
        found = {}
        for numeric in root.findall("custom/numeric"):
            name = numeric.get("name", "")
            if name.startswith(prefix):
                found[name[len(prefix) :]] = self.reader.numbers(numeric, "data", count, f"custom {name!r}", None)
        return found

    def closures(self) -> tuple[Closure, ...]:
        """Return one closure per equality; two connects marked as a hinge give one revolute closure."""
        kinds: dict[str, Callable[[ElementTree.Element, str, str], Closure]] = {
            "connect": self.connect,
            "joint": self.joint,
            "tendon": self.tendon,
            "weld": self.glue,
        }
        closures: list[Closure] = []
        for k, element in enumerate(self.elements):
            name = element.get("name") or f"{element.tag}_{k}"
            where = f"{element.tag} {name!r}"
            if element.tag not in kinds:
                raise self.reader.fail(where, str(UnknownNameError("equality", element.tag, kinds)) + " Remove it.")
            full = self.reader.with_defaults(_apart(element), None)
            if self.off or self.reader.flag(full, "active", where, "true") != "true":
                self.reader.left_out.append(f"{where}, which is not active")
                continue
            if name.endswith(" axis") and name[: -len(" axis")] in self.hinges:
                continue
            try:
                closures.append(kinds[element.tag](full, name, where))
            except FileFormatError:
                raise
            except FiveBarPinError as error:
                raise self.reader.fail(where, str(error)) from error
        return tuple(closures)

    def connect(self, element: ElementTree.Element, name: str, where: str) -> Closure:
        frames, axis = self.frames(element, name, where), self.hinges.get(name)
        if axis is None:
            return Point(frames, name=name)
        if not any(e.get("name") == f"{name} axis" for e in self.elements):
            raise self.reader.fail(where, f"is marked as a hinge but lacks its second connect {name + ' axis'!r}")
        return Revolute(frames, axis, name=name)

    def glue(self, element: ElementTree.Element, name: str, where: str) -> Closure:
        """A weld whose turns are weighed by nothing holds its point alone; any other weight holds them too."""
        (turns,) = self.reader.numbers(element, "torquescale", 1, where, [1.0])
        frames = self.frames(element, name, where)
        return Weld(frames, name=name) if turns else Point(frames, name=name)

    def joint(self, element: ElementTree.Element, name: str, where: str) -> Coupling:
        """q_1 = a_0 + a_1 q_2, times the factor that our writer noted."""
        joints = [element.get(word) for word in ("joint1", "joint2")]
        for joint in joints if joints[1] else joints[:1]:
            if joint not in self.bodies.order:
                raise self.reader.fail(where, str(UnknownNameError("joint", joint, self.bodies.order)))
        a0, a1 = self.linear(element, where)
        (factor,) = self.factors.get(name, [1.0])
        other = {str(joints[1]): -a1 * factor} if joints[1] and a1 else {}
        return self.coupling({str(joints[0]): factor, **other}, a0 * factor, name)

    def coupling(self, ratios: dict[str, float], offset: float, name: str) -> Coupling:
        """Return the coupling that MuJoCo counts from where the file places the joints."""
        at_rest = sum(ratio * self.bodies.refs.get(joint, 0.0) for joint, ratio in ratios.items())
        return Coupling(ratios, offset + at_rest, name=name)

    def tendon(self, element: ElementTree.Element, name: str, where: str) -> Closure:
        a0, a1 = self.linear(element, where)
        first, second = element.get("tendon1"), element.get("tendon2")
        for tendon in (first, second):
            if tendon is not None and tendon not in self.tendons:
                raise self.reader.fail(where, str(UnknownNameError("tendon", tendon, self.tendons)))
        one = self.tendons.get(str(first))
        if one is None:
            raise self.reader.fail(where, "needs the attribute 'tendon1'")
        if one.tag == "spatial":
            return self.rod(one, name, where, a0, second)
        ratios = fixed_ratios(self.reader, self.bodies, one, where)
        other = fixed_ratios(self.reader, self.bodies, self.tendons[second], where) if second else {}
        for joint, c in other.items():
            ratios[joint] = ratios.get(joint, 0.0) - a1 * c
        return self.coupling({joint: c for joint, c in ratios.items() if c}, a0, name)

    def rod(self, tendon: ElementTree.Element, name: str, where: str, longer: float, second: str | None) -> Distance:
        """Return the distance that a straight tendon between two sites is held at: its length at zero, and a_0."""
        sites = [child.get("site", "") for child in tendon if child.tag == "site"]
        if second is not None or len(sites) != 2 or len(tendon) != 2:
            raise self.reader.fail(where, "only a spatial tendon between two sites, by itself, is a distance")
        for site in sites:
            if site not in self.bodies.sites:
                raise self.reader.fail(where, str(UnknownNameError("site", site, self.bodies.sites)))
        links = self.bodies.sites[sites[0]], self.bodies.sites[sites[1]]
        one, two = (self.bodies.poses[link][:3, 3] for link in links)
        return Distance(links, float(np.linalg.norm(two - one)) + longer, name=name)

    def linear(self, element: ElementTree.Element, where: str) -> tuple[float, float]:
        """Return a_0 and a_1 of an equality; terms of higher degree are no coupling."""
        words = element.get("polycoef", "").split()
        given = [self.reader.number(word, "polycoef", where) for word in words]
        a = [*given, *[0.0, 1.0, 0.0, 0.0, 0.0][len(given) :]]
        if any(a[2:]):
            raise self.reader.fail(where, f"polycoef {a} is not linear; only a0 + a1 x is supported")
        return a[0], a[1]

    def frames(self, element: ElementTree.Element, name: str, where: str) -> tuple[str, str]:
        sites = [element.get("site1"), element.get("site2")]
        if any(sites):
            for site in sites:
                if site not in self.bodies.sites:
                    raise self.reader.fail(where, str(UnknownNameError("site", site, self.bodies.sites)))
            return self.bodies.sites[str(sites[0])], self.bodies.sites[str(sites[1])]
        links = []
        for word in ("body1", "body2"):
            body = element.get(word, WORLD if word == "body2" else "")
            if body not in self.bodies.bodies:
                raise self.reader.fail(where, str(UnknownNameError("body", body, self.bodies.bodies)))
            links.append(self.bodies.bodies[body])
        if links[0] == links[1]:
            raise self.reader.fail(where, f"joins body {links[0]!r} to itself")
        first, second = (self.bodies.poses[link] for link in links)
        if element.tag == "connect":
            anchor = np.array(self.reader.numbers(element, "anchor", 3, where, None))
            one = homogeneous(anchor, np.eye(3))
            two = np.linalg.inv(second) @ first @ one
        else:
            one, two = self.weld(element, first, second, where)
        return self.bodies.frame(f"{name}_1", links[0], one), self.bodies.frame(f"{name}_2", links[1], two)

    def weld(self, element: ElementTree.Element, first: Array, second: Array, where: str) -> tuple[Array, Array]:
        """Return the frames that a weld makes coincide.

        On body 2 the anchor; on body 1 the relpose, which is where MuJoCo holds the anchor, or where it is now.
        """
        values = np.array(self.reader.numbers(element, "relpose", 7, where, [0.0] * 7))
        anchor = homogeneous(np.array(self.reader.numbers(element, "anchor", 3, where, [0.0] * 3)), np.eye(3))
        if np.any(values[3:]):
            return homogeneous(values[:3], quaternion_matrix(self.reader.unit(values[3:], "relpose", where))), anchor
        return np.linalg.inv(first) @ second @ anchor, anchor


def fixed_ratios(reader: MjcfReader, bodies: BodyTree, tendon: ElementTree.Element, where: str) -> dict[str, float]:
    """Return the coefficients of a fixed tendon by joint."""
    if tendon.tag != "fixed":
        raise reader.fail(where, f"ties a {tendon.tag} tendon to another; only fixed ones can be coupled")
    ratios: dict[str, float] = {}
    for joint in tendon:
        name = reader.text(joint, "joint", f"fixed {tendon.get('name', '')!r}")
        if name not in bodies.order:
            raise reader.fail(where, str(UnknownNameError("joint", name, bodies.order)))
        (c,) = reader.numbers(joint, "coef", 1, where, None)
        ratios[name] = ratios.get(name, 0.0) + c
    return ratios


def _apart(element: ElementTree.Element) -> ElementTree.Element:
    """Return an equality under a tag of its own: <joint> and <tendon> mean something else elsewhere in the file."""
    tag = element.tag if element.tag in ("connect", "weld") else f"{element.tag}_equality"
    return ElementTree.Element(tag, element.attrib)
