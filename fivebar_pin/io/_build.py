"""From a checked tree to a pin.Model, in Pinocchio's own joint order or the one the sidecar asks for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain.coordinates import q_slice, v_slice
from fivebar_pin.errors import FileFormatError, UnknownNameError
from fivebar_pin.io._entries import UNLIMITED, JointEntry, TreeEntry
from fivebar_pin.io._sidecar import DATA_FIELDS, UNIVERSAL, Sidecar

__all__ = ["bare_inertia", "build_model", "joint_model", "joint_order", "set_default_limits", "stated_inertia"]

ROOT_JOINT = "root_joint"
_NO_MOMENT = 1e-9  # moment of inertia up to which a link that has no mass is taken to have none [kg m2]
_NOT_NEGATIVE = ("armature", "damping", "effort", "friction", "rotor_inertia", "velocity")
_AXES = {(1.0, 0.0, 0.0): 0, (0.0, 1.0, 0.0): 1, (0.0, 0.0, 1.0): 2}
_ALIGNED = {
    "revolute": (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ),
    "continuous": (pin.JointModelRUBX, pin.JointModelRUBY, pin.JointModelRUBZ),
    "prismatic": (pin.JointModelPX, pin.JointModelPY, pin.JointModelPZ),
}
_UNALIGNED = {
    "revolute": pin.JointModelRevoluteUnaligned,
    "prismatic": pin.JointModelPrismaticUnaligned,
}
_OBLIQUE = """<robot name="one"><link name="a"/><link name="b"/><joint name="j" type="continuous">
<parent link="a"/><child link="b"/><axis xyz="{} {} {}"/></joint></robot>"""
_OTHERS = {
    "floating": pin.JointModelFreeFlyer,
    "planar": pin.JointModelPlanar,
    "SPHERICAL": pin.JointModelSpherical,
    "SPHERICAL_ZYX": pin.JointModelSphericalZYX,
    "TRANSLATION": pin.JointModelTranslation,
}


def joint_order(tree: TreeEntry) -> list[str]:
    """Return all joints, fixed ones too, depth first and alphabetical, as Pinocchio's reader takes them."""
    children: dict[str, list[str]] = {}
    for name in sorted(tree.joints, reverse=True):
        children.setdefault(tree.joints[name].parent, []).append(name)
    order: list[str] = []
    stack = list(children.get(tree.root, []))
    while stack:
        order.append(stack.pop())
        stack.extend(children.get(tree.joints[order[-1]].child, []))
    return order


def build_model(tree: TreeEntry, sidecar: Sidecar, *, free_flyer: bool, urdf: Path, beside: Path) -> pin.Model:
    """Return the open tree as a pin.Model.

    Args:
        tree: the URDF.
        sidecar: joint types, order, gravity, joint data and configurations that the URDF cannot state.
        free_flyer: put the root link on a free-flying base.
        urdf: file to name in errors about the tree.
        beside: file to name in errors about the sidecar.
    """
    tree = _with_types(tree, sidecar.joint_types, beside)
    return _Builder(tree, free_flyer, urdf).model(sidecar, beside)


def _with_types(tree: TreeEntry, types: Mapping[str, str], beside: Path) -> TreeEntry:
    joints = dict(tree.joints)
    for name, word in types.items():
        if name not in joints:
            continue  # whoever reads the sidecar tells of it
        joint = joints[name]
        if word == "FIXED":
            joints[name] = replace(joint, kind="fixed", data={})
        elif word in UNIVERSAL:
            joints.update(_universal(joints.pop(name), UNIVERSAL[word], tree, beside))
        else:
            joints[name] = replace(joint, kind=word, data={})
    links = {**tree.links}
    for joint in joints.values():
        for end in (joint.parent, joint.child):
            if end not in links:
                links[end] = replace(links[tree.root], name=end, inertia=None, visuals=())
    return replace(tree, joints=joints, links=links)


def _universal(joint: JointEntry, axes: str, tree: TreeEntry, beside: Path) -> dict[str, JointEntry]:
    """Return two hinges, about two axes of the joint's own frame, with a massless cross between them."""
    first, second = (f"{joint.name}_{letter}" for letter in axes)
    cross = f"{joint.name}_cross"
    if {first, second} & set(tree.joints) or cross in tree.links:
        problem = f"a universal joint for {joint.name!r} would make a second {first}, {second} or {cross}"
        raise FileFormatError(beside, f"joint_type: {problem}")
    one, two = (np.eye(3)["XYZ".index(letter)] for letter in axes)
    data = {"lower": [-UNLIMITED], "upper": [UNLIMITED]}
    return {
        first: replace(joint, name=first, kind="revolute", child=cross, axis=one, data=data, offset=np.eye(4)),
        second: replace(joint, name=second, kind="revolute", parent=cross, placement=np.eye(4), axis=two, data=data),
    }


class _Builder:
    """Adds the joints of one tree to one model."""

    def __init__(self, tree: TreeEntry, free_flyer: bool, urdf: Path) -> None:
        self.tree, self.urdf, self.free_flyer = tree, urdf, free_flyer
        self.pin = pin.Model()
        self.pin.name = tree.name
        self.inertias: dict[int, list[tuple[Array, pin.Inertia]]] = {}
        self.link: dict[str, tuple[int, Array, int]] = {}
        base, placement = 0, tree.placement
        if free_flyer:
            if ROOT_JOINT in tree.joints:
                raise FileFormatError(urdf, f"has a joint {ROOT_JOINT!r} already; a free-flying base needs that name")
            base = self.pin.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3(placement), ROOT_JOINT)
            self.pin.addJointFrame(base, 0)
            placement = np.eye(4)
        self.body(tree.root, base, placement, self.pin.nframes - 1)

    def model(self, sidecar: Sidecar, beside: Path) -> pin.Model:
        for name in self.order(sidecar, beside):
            self.joint(self.tree.joints[name])
        for j, parts in self.inertias.items():
            self.pin.inertias[j] = _merged(parts)
        for name, entries in sidecar.joint_data.items():
            _set_data(self.pin, name, entries, beside)
        if sidecar.gravity is not None:
            self.pin.gravity.linear = np.array(sidecar.gravity)
        for name, q in sidecar.configurations.items():
            if len(q) != self.pin.nq:
                where = f"reference_configurations of {name}"
                raise FileFormatError(beside, f"{where}: has {len(q)} values; the mechanism has nq = {self.pin.nq}")
            self.pin.referenceConfigurations[name] = np.array(q)
        return self.pin

    def order(self, sidecar: Sidecar, beside: Path) -> list[str]:
        everything = joint_order(self.tree)
        if sidecar.joint_order is None:
            return everything
        moving = [name for name in everything if self.tree.joints[name].kind != "fixed"]
        for name in sidecar.joint_order:
            if name not in moving and (name != ROOT_JOINT or not self.free_flyer):
                raise FileFormatError(beside, "joint_order: " + str(UnknownNameError("moving joint", name, moving)))
        wanted = [name for name in sidecar.joint_order if name in moving]
        if sorted(wanted) != sorted(moving):
            raise FileFormatError(beside, f"joint_order: must name each of the {len(moving)} moving joints once")
        return _with_fixed(self.tree, wanted, beside)

    def joint(self, joint: JointEntry) -> None:
        parent, M, frame = self.link[joint.parent]
        placement = _moved(M, joint.placement)
        if joint.kind == "fixed":
            fixed = pin.Frame(joint.name, parent, frame, pin.SE3(placement), pin.FrameType.FIXED_JOINT)
            self.body(joint.child, parent, _moved(placement, joint.offset), self.pin.addFrame(fixed))
            return
        j = self.pin.addJoint(parent, joint_model(joint.kind, joint.axis), pin.SE3(placement), joint.name)
        self.pin.addJointFrame(j, frame)
        set_default_limits(self.pin, j, joint.kind)
        for word, values in joint.data.items():
            _set_entry(self.pin, j, word, np.array(values))
        self.body(joint.child, j, joint.offset, self.pin.nframes - 1)

    def body(self, link: str, joint: int, placement: Array, frame: int) -> None:
        self.pin.addBodyFrame(link, joint, pin.SE3(placement), frame)
        self.link[link] = (joint, placement, self.pin.nframes - 1)
        inertia = self.tree.links[link].inertia
        if inertia is not None:
            self.inertias.setdefault(joint, []).append((placement, inertia))


def _moved(M: Array, placement: Array) -> Array:
    """Return the product of two poses, to the last digit where the first is none."""
    return placement if np.array_equal(M, np.eye(4)) else M @ placement


def _with_fixed(tree: TreeEntry, wanted: list[str], beside: Path) -> list[str]:
    """Return all joints, the moving ones in the wanted order, fixed ones as soon as a moving one needs their link."""
    above = {joint.child: joint for joint in tree.joints.values()}
    order: list[str] = []
    there = {tree.root}
    for name in wanted:
        fixed: list[JointEntry] = []
        link = tree.joints[name].parent
        while link not in there:
            if above[link].kind != "fixed":
                problem = f"{name!r} comes before {above[link].name!r}, which carries it"
                raise FileFormatError(beside, f"joint_order: {problem}")
            fixed.append(above[link])
            link = above[link].parent
        for joint in (*reversed(fixed), tree.joints[name]):
            order.append(joint.name)
            there.add(joint.child)
    return order + [name for name in joint_order(tree) if tree.joints[name].child not in there]


def bare_inertia(mass: float, com: Array, tensor: Array) -> pin.Inertia:
    """Return an inertia as stated, plausible or not: whether such a body can exist is for the diagnosis to tell."""
    result = pin.Inertia.Zero()
    result.mass, result.lever, result.inertia = mass, com, tensor
    return result


def stated_inertia(mass: float, com: Array, tensor: Array) -> pin.Inertia | None:
    """Return the inertia that a file states of a link, None for one without mass or moments worth the name.

    Moments without mass are kept as they are: the diagnosis tells that no body has them.
    """
    massless = mass == 0.0 and np.abs(tensor).max() <= _NO_MOMENT
    return None if massless else bare_inertia(mass, com, tensor)


def joint_model(kind: str, axis: Array) -> object:
    """Return Pinocchio's joint of a kind; an axis along x, y or z gets the aligned joint."""
    if kind in _OTHERS:
        return _OTHERS[kind]()
    which = _AXES.get((float(axis[0]), float(axis[1]), float(axis[2])))
    if which is not None:
        return _ALIGNED[kind][which]()
    if kind == "continuous":  # Python cannot give this one an axis; Pinocchio's own reader can
        return pin.buildModelFromXML(_OBLIQUE.format(*(repr(float(x)) for x in axis))).joints[1]
    return _UNALIGNED[kind](np.array(axis))


def set_default_limits(model: pin.Model, j: int, kind: str) -> None:
    """Give coordinates that are sines, cosines or quaternions the bounds that Pinocchio's reader gives them."""
    angular = {"continuous": 2, "planar": 2, "floating": 4, "SPHERICAL": 4}.get(kind, 0)
    stop = model.idx_qs[j] + model.nqs[j]
    model.lowerPositionLimit[stop - angular : stop] = -1.01
    model.upperPositionLimit[stop - angular : stop] = 1.01


def _merged(parts: list[tuple[Array, pin.Inertia]]) -> pin.Inertia:
    total: pin.Inertia | None = None
    for placement, inertia in parts:
        moved = inertia if np.array_equal(placement, np.eye(4)) else pin.SE3(placement).act(inertia)
        total = moved if total is None else total + moved
    return total


def _set_data(model: pin.Model, name: str, entries: Mapping[str, list[float]], beside: Path) -> None:
    if not model.existJointName(name):
        known = list(model.names)[1:]
        raise FileFormatError(beside, "joint_data: " + str(UnknownNameError("joint", name, known)))
    j = model.getJointId(name)
    for word, values in sorted(entries.items()):
        count = model.nqs[j] if word in ("lower", "upper") else model.nvs[j]
        if len(values) != count:
            problem = f"{word} has {len(values)} values; the joint has {count}"
            raise FileFormatError(beside, f"joint_data of {name}: {problem}")
        if word in _NOT_NEGATIVE and min(values) < 0.0:
            raise FileFormatError(beside, f"joint_data of {name}: {word} = {values} must not be negative")
        _set_entry(model, j, word, np.array(values))
    for low, high, part in (("lower", "upper", q_slice(model, j)), ("effort_lower", "effort", v_slice(model, j))):
        limits = [getattr(model, DATA_FIELDS[word])[part] for word in (low, high)]
        if np.any(limits[0] > limits[1]):
            stated = " and ".join(f"{word} = {x.tolist()}" for word, x in zip((low, high), limits, strict=True))
            raise FileFormatError(beside, f"joint_data of {name}: {stated}: the lower limit is above the upper")


def _set_entry(model: pin.Model, j: int, word: str, values: Array) -> None:
    q, v = q_slice(model, j), v_slice(model, j)
    getattr(model, DATA_FIELDS[word])[q if word in ("lower", "upper") else v] = values
    mirrored = {"effort": "lowerEffortLimit", "velocity": "lowerVelocityLimit", "friction": "lowerDryFrictionLimit"}
    if word in mirrored:
        getattr(model, mirrored[word])[v] = -values
