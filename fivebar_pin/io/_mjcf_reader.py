"""MJCF attributes with their default classes, angles in the compiler's unit, and orientations in all five ways."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.io._xml import Reader, direction

__all__ = ["KNOWN", "MjcfReader", "homogeneous", "shortest_turn"]

_ALONG = 1e-10  # sine of an angle to the z axis below which any axis across serves [-]

_POSE = "pos quat axisangle xyaxes zaxis euler"
_ATTRIBUTES = f"""
body      name childclass {_POSE} mocap gravcomp user sleep
joint     name class type group pos axis springdamper limited actuatorfrclimited solreflimit solimplimit
          solreffriction solimpfriction stiffness range actuatorfrcrange actuatorgravcomp margin ref springref
          armature damping frictionloss user
freejoint name group align
inertial  {_POSE} mass diaginertia fullinertia
geom      name class type contype conaffinity condim group priority size material rgba friction mass density
          {_POSE} shellinertia solmix solref solimp margin gap fromto hfield mesh fitscale fluidshape fluidcoef user
site      name class type group {_POSE} material size fromto rgba user
connect   name class active solref solimp body1 body2 anchor site1 site2
weld      name class active solref solimp body1 body2 relpose anchor site1 site2 torquescale
joint_equality   name class active solref solimp joint1 joint2 polycoef
tendon_equality  name class active solref solimp tendon1 tendon2 polycoef
tendon    name class group limited range solreflimit solimplimit solreffriction solimpfriction margin frictionloss
          springlength stiffness damping armature actuatorfrclimited actuatorfrcrange width material rgba user
"""


def _table(text: str) -> dict[str, list[str]]:
    table: dict[str, list[str]] = {}
    for line in text.strip().splitlines():
        words = line.split()
        if line[0] != " ":
            table[words.pop(0)] = words
        else:
            table[list(table)[-1]] += words
    return table


KNOWN = _table(_ATTRIBUTES)
"""Attributes that an element may have; another one is an error, so that no misspelt value is silently a default."""

_ORIENTATIONS = ("quat", "axisangle", "xyaxes", "zaxis", "euler")


class MjcfReader(Reader):
    """Reads elements of one MJCF file.

    Attributes:
        degrees: angles are in degrees (MJCF's own default).
        eulerseq: axes of Euler angles, lower case turning with the body, upper case fixed.
        defaults: attributes by default class and tag.
    """

    def __init__(self, path: Path, root: ElementTree.Element) -> None:
        super().__init__(path)
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
            self._read_defaults(default, default.get("class", "main"), {}, top=True)

    def merged(self, elements: list[ElementTree.Element]) -> dict[str, str]:
        """Return the attributes of sections that may come several times."""
        return {key: value for element in elements for key, value in element.attrib.items()}

    def _read_defaults(
        self, default: ElementTree.Element, name: str, above: dict[str, dict[str, str]], *, top: bool = False
    ) -> None:
        mine = {tag: dict(attributes) for tag, attributes in above.items()}
        for child in default:
            if child.tag != "default":
                mine.setdefault(child.tag, {}).update(child.attrib)
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
        full = ElementTree.Element(element.tag, {**self.defaults[name].get(element.tag, {}), **element.attrib})
        if any(word in element.attrib for word in _ORIENTATIONS):
            for word in _ORIENTATIONS:
                if word not in element.attrib:
                    full.attrib.pop(word, None)
        self.check_known(full, where)
        return full

    def check_known(self, element: ElementTree.Element, where: str) -> None:
        """Refuse attributes that this element does not have."""
        for attribute in element.attrib:
            if attribute not in KNOWN[element.tag]:
                problem = UnknownNameError(f"attribute of <{element.tag}>", attribute, KNOWN[element.tag])
                raise self.fail(where, str(problem))

    def flag(self, element: ElementTree.Element, attribute: str, where: str, default: str) -> str:
        """Return "true", "false" or "auto"."""
        value = element.get(attribute, default)
        if value not in ("true", "false", "auto"):
            raise self.fail(where, str(UnknownNameError(attribute, value, ("true", "false", "auto"))))
        return value

    def pose(self, element: ElementTree.Element, where: str) -> Array:
        """Return the pose that pos and one of the orientation attributes state, homogeneous (4, 4)."""
        position = np.array(self.numbers(element, "pos", 3, where, [0.0, 0.0, 0.0]))
        return homogeneous(position, self.rotation(element, where))

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
