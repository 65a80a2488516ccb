"""Poses as URDF states them: xyz and rpy."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.io._entries import rpy_to_matrix
from fivebar_pin.io._xml import Reader

__all__ = ["pose", "stated_pose"]


def pose(reader: Reader, parent: ElementTree.Element, where: str, tag: str = "origin") -> Array:
    """Return the pose of the child element <origin>, homogeneous (4, 4); the identity where there is none."""
    element = reader.only(parent, tag, where)
    reader.known(element, ("xyz", "rpy"), where)
    return stated_pose(reader, element, where)


def stated_pose(reader: Reader, element: ElementTree.Element | None, where: str) -> Array:
    """Return the pose in the attributes xyz and rpy of an element, homogeneous (4, 4)."""
    M = np.eye(4)
    M[:3, 3] = reader.numbers(element, "xyz", 3, where, [0.0, 0.0, 0.0])
    M[:3, :3] = rpy_to_matrix(reader.numbers(element, "rpy", 3, where, [0.0, 0.0, 0.0]))
    return M
