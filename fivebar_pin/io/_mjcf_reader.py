"""MJCF attributes with their default classes, angles in the compiler's unit, and orientations in all five ways."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import FileFormatError, UnknownNameError
from fivebar_pin.io._mjcf_attributes import DRIVES, KNOWN
from fivebar_pin.io._xml import Reader, direction

__all__ = ["MjcfReader", "homogeneous", "quaternion_matrix", "shortest_turn", "turn"]

_ALONG = 1e-10  # sine of an angle to the z axis below which any axis across serves [-]

_ORIENTATIONS = ("quat", "axisangle", "xyaxes", "zaxis", "euler")


FRAME = " frame"
"""Attribute for the number of the frame that stood around an element: no file can state one with a blank."""


_FAMILIES = {
    **dict.fromkeys(DRIVES, "actuator"),
    **dict.fromkeys(("connect", "weld", "joint_equality", "tendon_equality"), "equality"),
    **dict.fromkeys(("fixed", "spatial"), "tendon"),
}
"""Under what the defaults of elements are kept that share them."""


class MjcfReader(Reader):
    """Reads elements of one MJCF file.

    Attributes:
        left_out: what the chain goes without, see `_left_out`.
        frames: poses of the <frame> elements in their bodies, the first that of none (4, 4).
        sources: file of each named element that came with an included one.
        degrees: angles are in degrees (MJCF's own default).
        eulerseq: axes of Euler angles, lower case turning with the body, upper case fixed.
        defaults: attributes by default class and tag.
    """

    def __init__(self, path: Path, root: ElementTree.Element, sources: Mapping[str, Path]) -> None:
        super().__init__(path)
        self.sources = sources
        self.left_out: list[str] = []
        self.frames = [np.eye(4)]
        compiler = self.merged(root.findall("compiler"))
        angle = compiler.get("angle", "degree")
        if angle not in ("degree", "radian"):
            raise self.fail("<compiler>", str(UnknownNameError("angle unit", angle, ("degree", "radian"))))
        self.degrees = angle == "degree"
        self.eulerseq = compiler.get("eulerseq", "xyz")
        if len(self.eulerseq) != 3 or set(self.eulerseq.lower()) - set("xyz"):
            raise self.fail("<compiler>", f"eulerseq = {self.eulerseq!r} must be three of x, y, z")
        self.compiler = compiler
        self.defaults: dict[str, dict[str, dict[str, str]]] = {"main": {}}
        for default in root.findall("default"):
            name = default.get("class", "main")
            if default is not root.find("default") and name != "main":
                raise self.fail(
                    f"default {name!r}", "is a class of its own at the top; put it into the first <default>"
                )
            self._read_defaults(default, name, self.defaults["main"], top=True)

    def fail(self, where: str, problem: str) -> FileFormatError:
        """Return the error for an element, which names the file that the element stands in."""
        file = next((file for key, file in self.sources.items() if where.endswith(key)), self.path)
        return FileFormatError(file, f"{where}: {problem}")

    def merged(self, elements: list[ElementTree.Element]) -> dict[str, str]:
        """Return the attributes of sections that may come several times."""
        return {key: value for element in elements for key, value in element.attrib.items()}

    def _read_defaults(
        self, default: ElementTree.Element, name: str, above: dict[str, dict[str, str]], *, top: bool = False
    ) -> None:
        mine = {tag: dict(attributes) for tag, attributes in above.items()}
        for child in default:
            if child.tag != "default":
                mine.setdefault(_FAMILIES.get(child.tag, child.tag), {}).update(child.attrib)
        self.defaults[name] = mine
        if top:
            self.defaults["main"] = mine
        for child in default.findall("default"):
            self._read_defaults(child, self.text(child, "class", "a <default>"), mine)

    def with_defaults(self, element: ElementTree.Element, childclass: str | None) -> ElementTree.Element:
        """Return the element with the attributes of its default class filled in, all of them known."""
        where = f"{element.tag} {element.get('name', '')!r}"
        name = element.get("class") or childclass or "main"
        if name not in self.defaults:
            raise self.fail(where, str(UnknownNameError("default class", name, self.defaults)))
        defaults = self.defaults[name].get(_FAMILIES.get(element.tag, element.tag), {})
        full = ElementTree.Element(element.tag, {**defaults, **element.attrib})
        if any(word in element.attrib for word in _ORIENTATIONS):
            for word in _ORIENTATIONS:
                if word not in element.attrib:
                    full.attrib.pop(word, None)
        self.check_known(full, where)
        return full

    def check_known(self, element: ElementTree.Element, where: str) -> None:
        """Refuse attributes that this element does not have."""
        known = KNOWN[element.tag if element.tag in KNOWN else _FAMILIES[element.tag]]
        for attribute in element.attrib:
            if attribute not in known and attribute != FRAME:
                raise self.fail(where, str(UnknownNameError(f"attribute of <{element.tag}>", attribute, known)))

    def flag(self, element: ElementTree.Element, attribute: str, where: str, default: str) -> str:
        """Return "true", "false" or "auto"."""
        value = element.get(attribute, default)
        if value not in ("true", "false", "auto"):
            raise self.fail(where, str(UnknownNameError(attribute, value, ("true", "false", "auto"))))
        return value

    def pose(self, element: ElementTree.Element, where: str) -> Array:
        """Return the pose that pos and one of the orientation attributes state, homogeneous (4, 4).

        It is that in the body, whatever frames stand around the element.
        """
        position = np.array(self.numbers(element, "pos", 3, where, [0.0, 0.0, 0.0]))
        return self.frame(element) @ homogeneous(position, self.rotation(element, where))

    def frame(self, element: ElementTree.Element) -> Array:
        """Return the pose in the body of the frames that stand around an element, homogeneous (4, 4)."""
        return self.frames[int(element.get(FRAME, "0"))]

    def without_frames(self, body: ElementTree.Element) -> None:
        """Put what stands in the frames of a body, and of those in it, into the body, and keep where they are."""
        children: list[ElementTree.Element] = []
        for child in body:
            children += self._out_of_frame(child, 0, None) if child.tag == "frame" else [child]
        body[:] = children
        for child in body.findall("body"):
            self.without_frames(child)

    def _out_of_frame(
        self, frame: ElementTree.Element, above: int, childclass: str | None
    ) -> list[ElementTree.Element]:
        where = f"frame {frame.get('name', '')!r}"
        self.check_known(frame, where)
        frame.set(FRAME, str(above))
        self.frames.append(self.pose(frame, where))
        mine, childclass = len(self.frames) - 1, frame.get("childclass", childclass)
        children: list[ElementTree.Element] = []
        for child in frame:
            if child.tag == "frame":
                children += self._out_of_frame(child, mine, childclass)
                continue
            child.set(FRAME, str(mine))
            word = "childclass" if child.tag == "body" else "class"
            if childclass is not None and word not in child.attrib and word in KNOWN.get(child.tag, ()):
                child.set(word, childclass)
            children.append(child)
        return children

    def rotation(self, element: ElementTree.Element, where: str) -> Array:
        """Return the rotation matrix of an element."""
        stated = [word for word in _ORIENTATIONS if word in element.attrib]
        if len(stated) > 1:
            raise self.fail(where, f"states its orientation {len(stated)} times ({', '.join(stated)})")
        if not stated:
            return np.eye(3)
        word = stated[0]
        count = {"quat": 4, "axisangle": 4, "xyaxes": 6, "zaxis": 3, "euler": 3}[word]
        values = np.array(self.numbers(element, word, count, where, None))
        if word == "quat":
            return quaternion_matrix(self.unit(values, word, where))
        if word == "axisangle":
            return turn(self.unit(values[:3], word, where), self.angle(values[3]))
        if word == "euler":
            return self.euler(values)
        if word == "zaxis":
            return shortest_turn(self.unit(values, word, where))
        x = self.unit(values[:3], word, where)
        y = self.unit(values[3:] - (values[3:] @ x) * x, word, where)
        return np.stack([x, y, np.cross(x, y)], axis=1)

    def angle(self, value: float) -> float:
        """Return an angle in radians."""
        return float(np.deg2rad(value)) if self.degrees else float(value)

    def euler(self, values: Array) -> Array:
        """Return the product of three turns in the compiler's sequence."""
        R = np.eye(3)
        for letter, value in zip(self.eulerseq, values, strict=True):
            step = turn(np.eye(3)["xyz".index(letter.lower())], self.angle(value))
            R = R @ step if letter.islower() else step @ R
        return R

    def unit(self, values: Array, word: str, where: str) -> Array:
        """Return a vector scaled to length one; left as it is when it has that length already."""
        try:
            return direction(values)
        except ValueError:
            raise self.fail(where, f"{word} {values.tolist()} has no direction") from None


def homogeneous(position: Array, R: Array) -> Array:
    """Return the pose (4, 4)."""
    M = np.eye(4)
    M[:3, :3], M[:3, 3] = R, position
    return M


def quaternion_matrix(quaternion: Array) -> Array:
    """Return the rotation of a unit quaternion (w, x, y, z)."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def turn(axis: Array, angle: float) -> Array:
    """Return the rotation about a unit axis [rad]."""
    half = 0.5 * angle
    return quaternion_matrix(np.concatenate([[np.cos(half)], np.sin(half) * axis]))


def shortest_turn(z: Array) -> Array:
    """Return the smallest rotation that takes (0, 0, 1) to z."""
    axis = np.array([-z[1], z[0], 0.0])
    length = float(np.linalg.norm(axis))
    angle = float(np.arctan2(length, z[2]))
    return turn(axis / length if length > _ALONG else np.eye(3)[0], angle)
