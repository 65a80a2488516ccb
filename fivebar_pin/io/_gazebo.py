"""What plugins of Gazebo say of the mechanism: which joints are driven, and which links are joined at the start."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.io._loops import Loop
from fivebar_pin.io._sdf_frames import relative
from fivebar_pin.io._xml import Reader

__all__ = ["controlled", "detachable", "others"]


def _called(plugin: ElementTree.Element) -> str:
    return f"{plugin.get('name', '')} {plugin.get('filename', '')}".lower().replace("-", "").replace("_", "")


def _drives(plugin: ElementTree.Element) -> bool:
    return "controller" in _called(plugin) and plugin.find("joint_name") is not None


def _joins(plugin: ElementTree.Element) -> bool:
    return "detachablejoint" in _called(plugin)


def controlled(plugins: Iterable[ElementTree.Element]) -> list[str]:
    """Return the joints that controllers name."""
    names = [name for plugin in plugins if _drives(plugin) for name in plugin.findall("joint_name")]
    return [(name.text or "").strip() for name in names]


def detachable(reader: Reader, plugins: Iterable[ElementTree.Element], poses: dict[str, Array]) -> list[Loop]:
    """Return the joints that a plugin makes at the start: welds of two links where they are with all joints at zero.

    Raises:
        FileFormatError: a link that is not there.
    """
    loops = []
    for plugin in plugins:
        if not _joins(plugin):
            continue
        ends = [plugin.findtext(tag, "").strip() for tag in ("parent_link", "child_link")]
        for end in ends:
            if end not in poses:
                raise reader.fail("plugin DetachableJoint", str(UnknownNameError("link", end, poses)))
        one, two = ends
        placed = (relative(poses[one], poses[two]), np.eye(4))
        loops.append(Loop(f"{one}~{two}", "fixed", (one, two), placed, np.array([1.0, 0.0, 0.0])))
    return loops


def others(plugins: Iterable[ElementTree.Element]) -> int:
    """Return how many plugins say nothing of the mechanism."""
    return sum(not _drives(plugin) and not _joins(plugin) for plugin in plugins)
