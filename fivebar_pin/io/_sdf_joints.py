"""The joints of an SDF model: kinds, ends, axes, limits, losses and springs."""

from __future__ import annotations

from dataclasses import dataclass, field
from xml.etree import ElementTree

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.closures import Coupling
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.io._entries import UNLIMITED
from fivebar_pin.io._sdf_frames import Frames, Thing
from fivebar_pin.io._sdf_pose import text_numbers
from fivebar_pin.io._xml import Reader, direction

__all__ = ["GEARBOX", "Axis", "SdfJoint", "read_joint"]

GEARBOX = "gearbox"
_AXES = {
    "ball": 0, "continuous": 1, "fixed": 0, GEARBOX: 2, "prismatic": 1, "revolute": 1, "revolute2": 2, "screw": 1,
    "universal": 2,
}  # fmt: skip
"""Kinds of joints, and how many axes each has."""
_IN_JOINT = (
    "parent", "child", "pose", "axis", "axis2", "physics", "sensor", "gearbox_ratio", "gearbox_reference_body",
    "thread_pitch", "screw_thread_pitch",
)  # fmt: skip
_IN_AXIS = ("xyz", "limit", "dynamics", "mimic", "use_parent_model_frame", "initial_position")
_IN_LIMIT = ("lower", "upper", "effort", "velocity", "stiffness", "dissipation")
_IN_DYNAMICS = ("damping", "friction", "spring_reference", "spring_stiffness")
_NO_LIMIT = 1e16
"""What SDF files write for a limit that is none [m or rad]."""
_AXIS_OF_THE_MODEL = 1.4
"""Last version whose axes are in the axes of the model, whatever the joint's pose."""


@dataclass(frozen=True, slots=True, eq=False)
class Axis:
    """One axis of a joint, unit and in the axes of the joint (3,), with limits and losses, and its spring.

    Attributes:
        data: limits and losses, as `JointEntry.data`.
        stiffness: of the spring [N m/rad or N/m].
        rest: coordinate at which the spring is at rest [rad or m].
    """

    direction: Array
    data: dict[str, list[float]] = field(default_factory=dict)
    stiffness: float = 0.0
    rest: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class SdfJoint:
    """A joint between two links, either way round.

    Attributes:
        kind: of SDF.
        parent, child: links, or the world.
        pose: in the world, all joints at zero, homogeneous (4, 4).
        axes: as many as the kind has.
        damping: of a ball [N m s/rad].
        pitch: how far a screw advances [m/rad].
        ratio, reference: of a gearbox: child = -ratio parent, angles to the link `reference`.
        mimic: the coupling with another joint that the file states.
    """

    name: str
    kind: str
    parent: str
    child: str
    pose: Array
    axes: tuple[Axis, ...]
    damping: float = 0.0
    pitch: float = 0.0
    ratio: float = 0.0
    reference: str = ""
    mimic: Coupling | None = None


def read_joint(reader: Reader, frames: Frames, thing: Thing, version: float) -> SdfJoint:
    """Return a joint as the file states it.

    Raises:
        FileFormatError: an unknown kind, ends that are not there, an axis without direction; names the joint.
    """
    element, name = thing.element, thing.name
    where = f"joint {name!r}"
    kind = reader.text(element, "type", where)
    if kind not in _AXES:
        raise reader.fail(where, str(UnknownNameError("joint type", kind, _AXES)))
    reader.no_misspelt(element, where, tags=_IN_JOINT)
    parent, child = (_end(reader, frames, thing, tag) for tag in ("parent", "child"))
    if parent == child:
        raise reader.fail(where, f"joins link {parent!r} to itself")
    pose = frames.pose(thing)
    count = _AXES[kind]
    axes = tuple(_axis(reader, frames, thing, pose, tag, version) for tag in ("axis", "axis2")[:count])
    damping = text_numbers(reader, element, "axis/dynamics/damping", 1, where, [0.0])[0] if kind == "ball" else 0.0
    pitch = _pitch(reader, element, where) if kind == "screw" else 0.0
    ratio, reference = 0.0, ""
    if kind == GEARBOX:
        (ratio,) = text_numbers(reader, element, "gearbox_ratio", 1, where, [1.0])
        reference = _end(reader, frames, thing, "gearbox_reference_body")
    stated = element.find("axis/mimic")
    mimic = None if stated is None else _mimic(reader, thing, stated, where)
    return SdfJoint(name, kind, parent, child, pose, axes, damping, pitch, ratio, reference, mimic)


def _end(reader: Reader, frames: Frames, thing: Thing, tag: str) -> str:
    where = f"joint {thing.name!r}"
    stated = reader.only(thing.element, tag, where)
    name = "" if stated is None else (stated.text or "").strip()
    if not name:
        raise reader.fail(where, f"needs <{tag}>")
    return frames.link(name, thing.scope, where)


def _axis(reader: Reader, frames: Frames, thing: Thing, pose: Array, tag: str, version: float) -> Axis:
    where = f"joint {thing.name!r}"
    element = reader.only(thing.element, tag, where)
    if element is None:
        raise reader.fail(where, f"needs <{tag}>")
    reader.no_misspelt(element, where, tags=_IN_AXIS)
    axis = np.array(text_numbers(reader, element, "xyz", 3, where, [0.0, 0.0, 1.0]))
    expressed = element.find("xyz[@expressed_in]")
    of_model = element.findtext("use_parent_model_frame", "0").strip() in ("1", "true") or version <= _AXIS_OF_THE_MODEL
    stated = "__model__" if of_model else "" if expressed is None else expressed.get("expressed_in", "")
    if stated:
        axis = pose[:3, :3].T @ frames.named_pose(stated, thing.scope, where)[:3, :3] @ axis
    try:
        unit = direction(axis)
    except ValueError:
        raise reader.fail(where, f"<{tag}>: {axis.tolist()} has no direction") from None
    dynamics = reader.only(element, "dynamics", where)
    stiffness, rest = (
        text_numbers(reader, dynamics, word, 1, where, [0.0])[0] for word in ("spring_stiffness", "spring_reference")
    )
    return Axis(unit, _data(reader, element, where), stiffness, rest)


def _data(reader: Reader, axis: ElementTree.Element, where: str) -> dict[str, list[float]]:
    """Return limits and losses; -1 stands for an effort or velocity without limit."""
    limit, dynamics = reader.only(axis, "limit", where), reader.only(axis, "dynamics", where)
    reader.no_misspelt(limit, where, tags=_IN_LIMIT)
    reader.no_misspelt(dynamics, where, tags=_IN_DYNAMICS)
    data = {word: text_numbers(reader, dynamics, word, 1, where, [0.0]) for word in ("damping", "friction")}
    for word, (value,) in data.items():
        if value < 0.0:
            raise reader.fail(where, f"{word} = {value!r} must not be negative")
    for word in ("effort", "velocity"):
        value = _bound(reader, limit, word, where, UNLIMITED)
        data[word] = [UNLIMITED if value < 0.0 else value]
    data["lower"] = [_bound(reader, limit, "lower", where, -UNLIMITED)]
    data["upper"] = [_bound(reader, limit, "upper", where, UNLIMITED)]
    if data["lower"][0] > data["upper"][0]:
        raise reader.fail(where, f"lower limit {data['lower'][0]!r} is above upper {data['upper'][0]!r}")
    return data


def _bound(reader: Reader, limit: ElementTree.Element | None, word: str, where: str, default: float) -> float:
    text = "" if limit is None else limit.findtext(word, "").strip()
    if text.lstrip("+-").lower() in ("inf", "infinity"):
        return -UNLIMITED if text.startswith("-") else UNLIMITED
    (value,) = text_numbers(reader, limit, word, 1, where, [default], bound=UNLIMITED)
    return value if abs(value) < _NO_LIMIT else float(np.copysign(UNLIMITED, value))


def _pitch(reader: Reader, element: ElementTree.Element, where: str) -> float:
    """Return the advance of a screw [m/rad]: <screw_thread_pitch> [m/turn], or the older <thread_pitch> [-rad/m]."""
    (turn,) = text_numbers(reader, element, "screw_thread_pitch", 1, where, [0.0])
    (older,) = text_numbers(reader, element, "thread_pitch", 1, where, [0.0])
    if not turn and not older:
        raise reader.fail(where, "needs <screw_thread_pitch> [m per turn]")
    return turn / (2.0 * np.pi) if turn else -1.0 / older


def _mimic(reader: Reader, thing: Thing, mimic: ElementTree.Element, where: str) -> Coupling:
    """Return q = multiplier (q_leader - reference) + offset as a coupling."""
    leader = thing.scope + reader.text(mimic, "joint", where)
    if mimic.get("axis", "axis") != "axis":
        raise reader.fail(where, "<mimic> follows the second axis of a joint, which is not supported")
    if leader == thing.name:
        raise reader.fail(where, "mimics itself")
    m, offset, reference = (
        text_numbers(reader, mimic, word, 1, where, default)[0]
        for word, default in (("multiplier", None), ("offset", [0.0]), ("reference", [0.0]))
    )
    tied = {leader: -m} if m else {}
    return Coupling({thing.name: 1.0, **tied}, offset - m * reference, name=f"{thing.name} mimic")
