"""Numbers and poses as SDF states them: as the text of elements."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.io._entries import rpy_to_matrix
from fivebar_pin.io._mjcf_reader import homogeneous, quaternion_matrix
from fivebar_pin.io._xml import HUGE, Reader

__all__ = ["read_pose", "said_numbers", "text_numbers"]

_FORMATS = ("euler_rpy", "quat_xyzw")


def text_numbers(
    reader: Reader,
    element: ElementTree.Element | None,
    path: str,
    count: int,
    where: str,
    default: list[float] | None,
    *,
    bound: float = HUGE,
) -> list[float]:
    """Return the numbers in the text of a descendant; `default` (None: required) where it is absent or empty."""
    return said_numbers(
        reader, "" if element is None else element.findtext(path, ""), path, count, where, default, bound
    )


def said_numbers(
    reader: Reader, text: str, tag: str, count: int, where: str, default: list[float] | None, bound: float = HUGE
) -> list[float]:
    """Return the `count` numbers in the text of an element; `default` (None: required) where it is empty."""
    words = text.split()
    if not words:
        if default is None:
            raise reader.fail(where, f"needs <{tag}>")
        return list(default)
    if len(words) != count:
        raise reader.fail(where, f"<{tag}> = {' '.join(words)!r} must be {count} number(s)")
    return [reader.number(word, f"<{tag}>", where, bound=bound) for word in words]


def read_pose(reader: Reader, parent: ElementTree.Element, where: str) -> Array:
    """Return the pose in the child element <pose>, homogeneous (4, 4); the identity where there is none."""
    element = reader.only(parent, "pose", where)
    if element is None or not (element.text or "").strip():
        return np.eye(4)
    style = element.get("rotation_format", "euler_rpy")
    if style not in _FORMATS:
        raise reader.fail(where, str(UnknownNameError("rotation_format", style, _FORMATS)))
    if style == "quat_xyzw":
        x, y, z, *turn = text_numbers(reader, parent, "pose", 7, where, None)
        length = float(np.linalg.norm(turn))
        if length == 0.0:
            raise reader.fail(where, "<pose>: the quaternion is zero")
        return homogeneous(np.array([x, y, z]), quaternion_matrix(np.roll(turn, 1) / length))
    x, y, z, *angles = text_numbers(reader, parent, "pose", 6, where, None)
    if element.get("degrees", "false").strip() in ("1", "true"):
        angles = np.radians(angles).tolist()
    return homogeneous(np.array([x, y, z]), rpy_to_matrix(angles))
