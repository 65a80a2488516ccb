"""From a pin.Model in memory back to named links and joints that a file can state."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain, Visual, find_frame
from fivebar_pin.chain.coordinates import q_slice, v_slice
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.io._build import joint_model, set_default_limits
from fivebar_pin.io._entries import JointEntry, LinkEntry, TreeEntry
from fivebar_pin.io._sidecar import DATA_FIELDS

__all__ = ["joint_data", "outline"]

_AXIS_KINDS = {"JointModelR": "revolute", "JointModelRUB": "continuous", "JointModelP": "prismatic"}
_UNALIGNED_KINDS = {
    "JointModelRevoluteUnaligned": "revolute",
    "JointModelRevoluteUnboundedUnaligned": "continuous",
    "JointModelPrismaticUnaligned": "prismatic",
}
_OTHER_KINDS = {
    "JointModelFreeFlyer": "floating",
    "JointModelPlanar": "planar",
    "JointModelSpherical": "SPHERICAL",
    "JointModelSphericalZYX": "SPHERICAL_ZYX",
    "JointModelTranslation": "TRANSLATION",
}
_UNWRITABLE = "[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]"


def outline(chain: ClosedChain) -> TreeEntry:
    """Return the chain's open tree as links and joints; frames without mass become links on fixed joints.

    Raises:
        InvalidInputError: a joint kind, an inertia or a name that no file can state.
    """
    return _Outline(chain).tree()


def joint_data(model: pin.Model, j: int, words: tuple[str, ...]) -> dict[str, list[float]]:
    """Return limits and losses of joint j that differ from those of a joint of its kind with nothing stated."""
    plain = pin.Model()
    plain.addJoint(0, joint_model(_kind(model, j)[0], _kind(model, j)[1]), pin.SE3.Identity(), "plain")
    set_default_limits(plain, 1, _kind(model, j)[0])
    result = {}
    for word in words:
        ours, usual = _values(model, j, word), _values(plain, 1, word)
        if not np.array_equal(ours, usual):
            result[word] = [float(x) for x in ours]
    return result


def _values(model: pin.Model, j: int, word: str) -> Array:
    part = (q_slice if word in ("lower", "upper") else v_slice)(model, j)
    return np.array(getattr(model, DATA_FIELDS[word]), dtype=np.float64)[part]


def _kind(model: pin.Model, j: int) -> tuple[str, Array]:
    """Return the kind of a joint, in our words, and its axis."""
    joint = model.joints[j]
    short = str(joint.shortname())
    if short in _OTHER_KINDS:
        return _OTHER_KINDS[short], np.array([0.0, 0.0, 1.0])
    if short in _UNALIGNED_KINDS:
        return _UNALIGNED_KINDS[short], _axis(model, joint)
    if short[:-1] in _AXIS_KINDS and short[-1] in "XYZ":
        return _AXIS_KINDS[short[:-1]], np.eye(3)["XYZ".index(short[-1])]
    raise InvalidInputError(
        f"kind of joint {model.names[j]}",
        short,
        "has no word in a file",
        "Make it of revolute and prismatic joints with massless links between them.",
    )


class _Outline:
    """Gives every frame of one model a link to stand for it."""

    def __init__(self, chain: ClosedChain) -> None:
        self.chain, self.model = chain, chain.model
        self.frames = list(self.model.frames)
        self.joints: dict[str, JointEntry] = {}
        self.link_of_joint: list[str] = []
        self.visuals: dict[str, list[Visual]] = {}
        self.inertia: dict[str, pin.Inertia] = {}

    def tree(self) -> TreeEntry:
        names = {f.name for f in self.frames if f.type != pin.FrameType.JOINT}
        for j in range(self.model.njoints):
            self.link_of_joint.append(self.main_link(j, names))
        for j in range(1, self.model.njoints):
            self.moving(j)
        extra = dict(self.fixed())
        self.place_visuals(set(self.link_of_joint) | set(extra.values()))
        links = [*self.link_of_joint, *extra.values()]
        for name in [*links, *self.joints, self.chain.name]:
            if not name.strip() or re.search(_UNWRITABLE, name):
                raise InvalidInputError("name", name, "must be printable text to be written to a file")
        if len(set(links)) != len(links):
            raise InvalidInputError(
                "frame names", sorted({x for x in links if links.count(x) > 1}), "must differ in a file"
            )
        entries = {x: LinkEntry(x, self.inertia.get(x), tuple(self.visuals.get(x, ()))) for x in links}
        return TreeEntry(self.chain.name, self.link_of_joint[0], entries, self.joints)

    def main_link(self, j: int, taken: set[str]) -> str:
        bodies = [f for f in self.frames if f.type == pin.FrameType.BODY and f.parentJoint == j]
        here = [f for f in bodies if _is_identity(f.placement)]
        own = [f for f in here if self.frames[f.parentFrame].type == pin.FrameType.JOINT or f.parentFrame == 0]
        if here:
            name = str((own or here)[0].name)
        else:
            name = _free("world" if j == 0 else f"{self.model.names[j]}_link", taken)
            taken.add(name)
        inertia = self.model.inertias[j]
        if inertia.mass > 0.0:
            self.inertia[name] = inertia
        elif np.any(np.array(inertia.inertia)):
            raise InvalidInputError(f"mass of link {name}", inertia.mass, "must be positive on a link that has inertia")
        return name

    def moving(self, j: int) -> None:
        model, name = self.model, str(self.model.names[j])
        kind, axis = _kind(model, j)
        parent = self.link_of_joint[model.parents[j]]
        placement = np.array(model.jointPlacements[j].homogeneous)
        self.joints[name] = JointEntry(name, kind, parent, self.link_of_joint[j], placement, axis)

    def fixed(self) -> Iterator[tuple[int, str]]:
        """Add a fixed joint for each frame that is not a joint's own; yield its index and the name of its link."""
        used = {self.link_of_joint[f.parentJoint] for f in self.frames}
        carried = {f.parentFrame for f in self.frames if f.type == pin.FrameType.BODY}
        names = {str(n) for n in self.model.names} | {
            f.name for f in self.frames if f.type == pin.FrameType.FIXED_JOINT
        }
        for k, f in enumerate(self.frames):
            own = f.type == pin.FrameType.JOINT and f.name == self.model.names[f.parentJoint]
            bracket = f.type == pin.FrameType.FIXED_JOINT and k in carried
            if k == 0 or own or bracket or (f.type == pin.FrameType.BODY and f.name in used):
                continue
            above = self.frames[f.parentFrame]
            if f.type == pin.FrameType.BODY and above.type == pin.FrameType.FIXED_JOINT and f.parentFrame != 0:
                joint = str(above.name)
            else:
                joint = _free(f"{f.name}_joint", names)
                names.add(joint)
            link, placement = str(f.name), np.array(f.placement.homogeneous)
            if joint in self.joints:
                raise InvalidInputError(
                    "name of a fixed joint", joint, "is that of another joint too; rename the frame"
                )
            parent = self.link_of_joint[f.parentJoint]
            self.joints[joint] = JointEntry(joint, "fixed", parent, link, placement, np.eye(3)[0])
            yield k, link

    def place_visuals(self, links: set[str]) -> None:
        for visual in self.chain.visuals:
            if visual.frame in links:
                self.visuals.setdefault(visual.frame, []).append(visual)
                continue
            f = find_frame(self.model, visual.frame)
            link = self.link_of_joint[f.parentJoint]
            pose = np.array(f.placement.homogeneous) @ visual.placement
            moved = Visual(link, visual.shape, visual.size, pose, visual.rgba, visual.mesh)
            self.visuals.setdefault(link, []).append(moved)


def _axis(model: pin.Model, joint: pin.JointModel) -> Array:
    """Return the axis of an oblique joint; Python sees that of an unbounded one in its motion subspace alone."""
    if joint.nq == joint.nv:
        return np.array(joint.extract().axis, dtype=np.float64)
    data = joint.createData()
    joint.calc(data, pin.neutral(model))
    return np.array(data.S, dtype=np.float64).reshape(6)[3:]


def _is_identity(placement: pin.SE3) -> bool:
    return bool(np.array_equal(np.array(placement.homogeneous), np.eye(4)))


def _free(name: str, taken: set[str]) -> str:
    k, free = 1, name
    while free in taken:
        k, free = k + 1, f"{name}_{k}"
    return free
