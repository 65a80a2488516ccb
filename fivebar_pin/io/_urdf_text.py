"""A checked tree to URDF text and its sidecar; every number is written so that it reads back exactly."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain, Visual
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.io._build import joint_order
from fivebar_pin.io._entries import UNLIMITED, JointEntry, LinkEntry, TreeEntry, matrix_to_rpy
from fivebar_pin.io._outline import joint_data, outline
from fivebar_pin.io._sidecar import DATA_WORDS, Sidecar

__all__ = ["configurations", "mesh_name", "numbers", "quoted", "urdf_and_sidecar"]

GRAVITY = (0.0, 0.0, -9.81)
_ONE_AXIS = ("revolute", "continuous", "prismatic")
_STAND_IN = {"SPHERICAL": "continuous", "SPHERICAL_ZYX": "continuous", "TRANSLATION": "prismatic"}
_IN_URDF_IF_CONTINUOUS = ("damping", "effort", "friction", "velocity")
_IN_URDF = (*_IN_URDF_IF_CONTINUOUS, "lower", "upper")


def urdf_and_sidecar(chain: ClosedChain, folder: Path) -> tuple[str, Sidecar]:
    """Return the URDF text of a chain, with meshes named relative to `folder`, and what only the sidecar can say."""
    tree = _uncounted(chain, outline(chain))
    lines = ['<?xml version="1.0" encoding="utf-8"?>', f"<robot name={quoted(tree.name)}>"]
    for link in tree.links.values():
        lines += _link(link, folder)
    for joint in tree.joints.values():
        lines += _joint(joint, chain.model)
    lines += ["</robot>", ""]
    return "\n".join(lines), _sidecar(chain, tree)


def _uncounted(chain: ClosedChain, tree: TreeEntry) -> TreeEntry:
    """Return the tree with the revolute joints of couplings that have no limits as continuous ones, as URDF says it.

    Reading makes them count their turns again; reference configurations are those of joints that do.
    """
    joints, model = dict(tree.joints), chain.model
    for name in {name for closure in chain.closures for name in closure.counted}:
        k = model.idx_qs[model.getJointId(name)]
        limited = model.lowerPositionLimit[k] > -UNLIMITED or model.upperPositionLimit[k] < UNLIMITED
        if joints[name].kind == "revolute" and not limited:
            joints[name] = replace(joints[name], kind="continuous")
    return replace(tree, joints=joints)


def numbers(values: Iterable[float] | Array) -> str:
    """Return numbers as text that reads back exactly, -0 as 0.

    Raises:
        InvalidInputError: one of them is not finite.
    """
    values = [float(x) for x in values]
    if not all(np.isfinite(values)):
        raise InvalidInputError("number to write", values, "must be finite")
    return " ".join(repr(float(x) + 0.0) for x in values)


def quoted(text: str) -> str:
    """Return text as the value of an XML attribute, quotes included."""
    from xml.sax.saxutils import quoteattr  # loads what talks to the web, for which reading a file need not wait

    return quoteattr(text)


def _sidecar(chain: ClosedChain, tree: TreeEntry) -> Sidecar:
    model = chain.model
    moving = [j for j in tree.joints.values() if j.kind != "fixed"]
    data = {}
    for joint in moving:
        stated = _IN_URDF if joint.kind in ("revolute", "prismatic") else _IN_URDF_IF_CONTINUOUS
        words = tuple(w for w in DATA_WORDS if joint.kind not in _ONE_AXIS or w not in stated)
        entries = joint_data(model, model.getJointId(joint.name), words)
        if np.array_equal(_limit(model, joint, "lowerEffortLimit"), -_limit(model, joint, "upperEffortLimit")):
            entries.pop("effort_lower", None)
        if entries:
            data[joint.name] = {word: [_finite(x) for x in values] for word, values in entries.items()}
    usual = [name for name in joint_order(tree) if tree.joints[name].kind != "fixed"]
    gravity = tuple(float(g) for g in model.gravity.linear)
    return Sidecar(
        closures=chain.closures,
        actuated=chain.actuated,
        joint_types={j.name: j.kind for j in moving if j.kind in _STAND_IN},
        gravity=None if gravity == GRAVITY else gravity,
        joint_order=None if usual == list(chain.joints) else chain.joints,
        joint_data=data,
        configurations={name: [float(x) for x in q] for name, q in configurations(model)},
        springs=chain.springs,
        geometry=chain.geometry,
        closure_tolerance=chain.closure_tolerance,
    )


def _limit(model: pin.Model, joint: JointEntry, word: str) -> Array:
    j = model.getJointId(joint.name)
    return np.array(getattr(model, word))[model.idx_vs[j] : model.idx_vs[j] + model.nvs[j]]


def _finite(value: float) -> float:
    return min(max(value, -UNLIMITED), UNLIMITED)


def _origin(M: Array, indent: str) -> list[str]:
    if np.array_equal(M, np.eye(4)):
        return []
    rpy = "" if np.array_equal(M[:3, :3], np.eye(3)) else f' rpy="{numbers(matrix_to_rpy(M[:3, :3]))}"'
    return [f'{indent}<origin xyz="{numbers(M[:3, 3])}"{rpy}/>']


def _link(link: LinkEntry, folder: Path) -> list[str]:
    name = quoted(link.name)
    if link.inertia is None and not link.visuals:
        return [f"  <link name={name}/>"]
    lines = [f"  <link name={name}>"]
    if link.inertia is not None:
        I = np.array(link.inertia.inertia)
        entries = {"ixx": I[0, 0], "ixy": I[0, 1], "ixz": I[0, 2], "iyy": I[1, 1], "iyz": I[1, 2], "izz": I[2, 2]}
        tensor = " ".join(f'{word}="{numbers([value])}"' for word, value in entries.items())
        lines += [
            "    <inertial>",
            f'      <origin xyz="{numbers(link.inertia.lever)}"/>',
            f'      <mass value="{numbers([link.inertia.mass])}"/>',
            f"      <inertia {tensor}/>",
            "    </inertial>",
        ]
    for visual in link.visuals:
        for part in _parts(visual):
            lines += _visual(part, folder)
    return [*lines, "  </link>"]


def _parts(visual: Visual) -> list[Visual]:
    """Return shapes that URDF has: a capsule is a cylinder with two spheres."""
    if visual.shape != "capsule":
        return [visual]
    radius, length = visual.size
    parts = [Visual(visual.frame, "cylinder", visual.size, visual.placement, visual.rgba)]
    for end in (-0.5 * length, 0.5 * length):
        M = np.array(visual.placement)
        M[:3, 3] += M[:3, 2] * end
        parts.append(Visual(visual.frame, "sphere", (radius,), M, visual.rgba))
    return parts


def _visual(visual: Visual, folder: Path) -> list[str]:
    size = visual.size
    shape = {
        "box": lambda: f'<box size="{numbers(size)}"/>',
        "cylinder": lambda: f'<cylinder radius="{numbers(size[:1])}" length="{numbers(size[1:])}"/>',
        "sphere": lambda: f'<sphere radius="{numbers(size)}"/>',
        "mesh": lambda: f'<mesh filename={quoted(mesh_name(visual.mesh, folder))} scale="{numbers(size)}"/>',
    }[visual.shape]()
    return [
        "    <visual>",
        *_origin(visual.placement, "      "),
        f"      <geometry>{shape}</geometry>",
        f'      <material name=""><color rgba="{numbers(visual.rgba)}"/></material>',
        "    </visual>",
    ]


def mesh_name(mesh: str, folder: Path) -> str:
    """Return a mesh's name as seen from the folder of the file that names it."""
    if not mesh:
        raise InvalidInputError("mesh of a visual", mesh, "must name a file")
    path = Path(mesh)
    if not path.is_absolute():
        return mesh
    base = folder.resolve()
    return path.relative_to(base).as_posix() if path.is_relative_to(base) else path.as_posix()


def _joint(joint: JointEntry, model: pin.Model) -> list[str]:
    kind = _STAND_IN.get(joint.kind, joint.kind)
    lines = [
        f'  <joint name={quoted(joint.name)} type="{kind}">',
        *_origin(joint.placement, "    "),
        f"    <parent link={quoted(joint.parent)}/>",
        f"    <child link={quoted(joint.child)}/>",
    ]
    if kind not in ("fixed", "floating"):
        lines.append(f'    <axis xyz="{numbers(joint.axis)}"/>')
    if joint.kind in _ONE_AXIS:
        lines += _limits(joint, model)
    elif kind == "prismatic":
        limit = numbers([UNLIMITED])
        lines.append(f'    <limit lower="-{limit}" upper="{limit}" effort="{limit}" velocity="{limit}"/>')
    return [*lines, "  </joint>"]


def _limits(joint: JointEntry, model: pin.Model) -> list[str]:
    j = model.getJointId(joint.name)
    effort, velocity = (_finite(_limit(model, joint, w)[0]) for w in ("upperEffortLimit", "upperVelocityLimit"))
    damping, friction = (_limit(model, joint, w)[0] for w in ("damping", "upperDryFrictionLimit"))
    iq = model.idx_qs[j]
    lower, upper = (_finite(x[iq]) for x in (model.lowerPositionLimit, model.upperPositionLimit))
    stated = [lower, upper, effort, velocity, damping, friction]
    if not all(np.isfinite(stated)) or lower > upper or effort < 0.0 or velocity < 0.0:
        words = dict(zip(("lower", "upper", "effort", "velocity", "damping", "friction"), stated, strict=True))
        raise InvalidInputError(f"limits of joint {joint.name}", words, "cannot be written; lower <= upper, no nan")
    ends = "" if joint.kind == "continuous" else f'lower="{numbers([lower])}" upper="{numbers([upper])}" '
    lines = []
    if ends or min(effort, velocity) < UNLIMITED:
        lines.append(f'    <limit {ends}effort="{numbers([effort])}" velocity="{numbers([velocity])}"/>')
    if damping or friction:
        lines.append(f'    <dynamics damping="{numbers([damping])}" friction="{numbers([friction])}"/>')
    return lines


def configurations(model: pin.Model) -> list[tuple[str, Array]]:
    """Return the reference configurations by name."""
    return [(str(entry.key()), np.array(entry.data())) for entry in model.referenceConfigurations]
