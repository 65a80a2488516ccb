"""A chain to MJCF text: bodies at their joints, frames as sites, closures as equalities (see `_mjcf_words`), springs
as tendons.

MuJoCo takes no moving body without mass: one gets a grain of it, and a note that it has none. A <custom><numeric> entry
keeps the order of joints that were not added depth first. A spring on a joint is that joint's
own. MJCF has no place for velocity limits, rotor inertias and gear ratios; the URDF and its sidecar keep them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain, Visual, find_frame
from fivebar_pin.chain.coordinates import q_slice
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.io._entries import JointEntry, TreeEntry
from fivebar_pin.io._mjcf import GRAIN, MASSLESS, ORDER, TOLERANCE, UNBOUNDED
from fivebar_pin.io._mjcf_springs import joint_springs_to_write, tendon_lines
from fivebar_pin.io._mjcf_words import equality_lines
from fivebar_pin.io._outline import outline
from fivebar_pin.io._urdf_text import configurations, mesh_name, numbers, quoted

__all__ = ["mjcf_text"]

_KINDS = {"revolute": "hinge", "continuous": "hinge", "prismatic": "slide", "SPHERICAL": "ball", "floating": "free"}
_LIMITLESS = 1e300
_THIN = 1e-9  # second moment below which a body counts as flat, a rod or a point [m |c|^2 + moments of inertia]
_LEAST = 1e-15  # moment of inertia that MuJoCo takes a moving body to have at least (its mjMINVAL) [kg m2]
_SMALL = 1e-12  # moment of inertia below which MuJoCo takes no full tensor (some hundred times its mjEPS) [kg m2]


def mjcf_text(chain: ClosedChain, folder: Path) -> str:
    """Return the MJCF text of a chain, with meshes named relative to `folder`.

    Raises:
        InvalidInputError: a joint, closure kind or spring that MJCF lacks, a free joint that hangs on a body.
    """
    return _Writer(chain, folder).text()


class _Writer:
    def __init__(self, chain: ClosedChain, folder: Path) -> None:
        self.chain, self.model, self.folder = chain, chain.model, folder
        self.tree: TreeEntry = outline(chain)
        self.meshes: dict[tuple[str, tuple[float, ...]], str] = {}
        self.below: dict[str, list[JointEntry]] = {}
        for joint in self.tree.joints.values():
            self.below.setdefault(joint.parent, []).append(joint)
        self.extra_sites: dict[str, list[tuple[str, Array]]] = {}
        self.numeric: list[str] = []
        self.tendons: list[str] = []
        self.order: list[int] = []
        self.joint_springs = joint_springs_to_write(chain)
        self.sites = {j.child for j in self.tree.joints.values() if j.kind == "fixed"}

    def text(self) -> str:
        equality = [line for closure in self.chain.closures for line in equality_lines(self, closure)]
        self.tendons += tendon_lines(self.chain, self.site)
        bodies = self.contents(self.tree.root, "    ")
        if self.order != sorted(self.order):
            places = numbers([self.order.index(j) for j in sorted(self.order)])
            self.numeric.append(f'    <numeric name="{ORDER}" data="{places}"/>')
        if self.chain.closure_tolerance:
            self.numeric.append(f'    <numeric name="{TOLERANCE}" data="{numbers([self.chain.closure_tolerance])}"/>')
        motors = [f"    <motor name={quoted(a)} joint={quoted(a)}/>" for a in self.chain.actuated]
        gravity = numbers(self.model.gravity.linear)
        meshes = [f"    <mesh name={quoted(n)} file={quoted(f)}{_scale(s)}/>" for (f, s), n in self.meshes.items()]
        lines = [
            '<?xml version="1.0" encoding="utf-8"?>',
            f"<mujoco model={quoted(self.tree.name)}>",
            '  <compiler angle="radian" autolimits="true" inertiafromgeom="false"/>',
            f'  <option gravity="{gravity}"/>',
            *_section("asset", meshes),
            *_section("worldbody", bodies),
            *_section("tendon", self.tendons),
            *_section("equality", equality),
            *_section("actuator", motors),
            *_section("keyframe", self.keyframes()),
            *_section("custom", self.numeric),
            "</mujoco>",
            "",
        ]
        return "\n".join(lines)

    def contents(self, link: str, indent: str) -> list[str]:
        """Return what stands inside a body: its shapes, its sites and the bodies it carries."""
        lines = [line for visual in self.tree.links[link].visuals for line in self.geom(visual, np.eye(4), indent)]
        for name, M in self.extra_sites.get(link, []):
            lines.append(f"{indent}<site name={quoted(name)}{_pose(M)}/>")
        for joint in self.below.get(link, []):
            if joint.kind == "fixed":
                lines.append(f"{indent}<site name={quoted(joint.child)}{_pose(joint.placement)}/>")
                for visual in self.tree.links[joint.child].visuals:
                    lines += self.geom(visual, joint.placement, indent)
        moving = [joint for joint in self.below.get(link, []) if joint.kind != "fixed"]
        for joint in sorted(moving, key=lambda j: self.model.getJointId(j.name)):
            lines += self.body(joint, indent)
        return lines

    def body(self, joint: JointEntry, indent: str) -> list[str]:
        stacked = self.stacked(joint)
        link = stacked[-1].child
        lines = [f"{indent}<body name={quoted(link)}{_pose(joint.placement)}>"]
        lines += [self.joint(each, indent + "  ") for each in stacked]
        inertia = self.heavy(link)
        stated = f'pos="{numbers(inertia.lever)}" mass="{numbers([inertia.mass])}"'
        lines.append(f"{indent}  <inertial {stated} {_inertia(inertia)}/>")
        return [*lines, *self.contents(link, indent + "  "), f"{indent}</body>"]

    def heavy(self, link: str) -> pin.Inertia:
        """Return the inertia of a moving body; MuJoCo asks for a mass, and a body without one gets a grain of it."""
        inertia = self.tree.links[link].inertia
        if inertia is not None:
            return inertia
        self.numeric.append(f'    <numeric name={quoted(MASSLESS + link)} data="1"/>')
        return pin.Inertia(GRAIN, np.zeros(3), GRAIN * np.eye(3))

    def stacked(self, joint: JointEntry) -> list[JointEntry]:
        """Return the joints that share one body: massless links between joints at one place need none of their own."""
        joints = [joint]
        while True:
            link = self.tree.links[joints[-1].child]
            below = self.below.get(link.name, [])
            single = len(below) == 1 and _KINDS.get(below[0].kind) in ("hinge", "slide", "ball")
            if link.inertia or link.visuals or link.name in self.extra_sites or not single or joint.kind == "floating":
                return joints
            if not np.array_equal(below[0].placement, np.eye(4)):
                return joints
            joints.append(below[0])

    def joint(self, joint: JointEntry, indent: str) -> str:
        model, j = self.model, self.model.getJointId(joint.name)
        kind = _KINDS.get(joint.kind)
        self.order.append(j)
        if kind is None:
            short = model.joints[j].shortname()
            hint = "Save it as URDF only: formats=('urdf',)."
            raise InvalidInputError(f"kind of joint {joint.name}", short, "has no word in MJCF", hint)
        if kind == "free" and joint.parent != self.tree.root:
            raise InvalidInputError(f"joint {joint.name}", "free", "must hang on the world in MJCF")
        words = [f"name={quoted(joint.name)}", f'type="{kind}"']
        v = slice(model.idx_vs[j], model.idx_vs[j] + model.nvs[j])
        if kind in ("hinge", "slide"):
            words.append(f'axis="{numbers(joint.axis)}"')
            words += self.limits(joint, j)
        if joint.kind == "continuous":
            self.numeric.append(f'    <numeric name={quoted(UNBOUNDED + joint.name)} data="1"/>')
        fields = {"damping": "damping", "frictionloss": "upperDryFrictionLimit", "armature": "armature"}
        for word, field in fields.items():
            values = np.array(getattr(model, field))[v]
            if np.ptp(values) > 0.0:
                raise InvalidInputError(f"{word} of joint {joint.name}", values.tolist(), "must be one number in MJCF")
            value = float(values[0])
            if word == "damping" and joint.name in self.joint_springs:
                value += self.joint_springs[joint.name].damping
            if value:
                words.append(f'{word}="{numbers([value])}"')
        if joint.name in self.joint_springs:
            spring = self.joint_springs[joint.name]
            words.append(f'stiffness="{numbers([spring.stiffness])}" springref="{numbers([spring.rest])}"')
        return f"{indent}<joint {' '.join(words)}/>"

    def limits(self, joint: JointEntry, j: int) -> list[str]:
        model, words = self.model, []
        low, high = (float(x[model.idx_qs[j]]) for x in (model.lowerPositionLimit, model.upperPositionLimit))
        if joint.kind != "continuous" and (abs(low) < _LIMITLESS or abs(high) < _LIMITLESS):
            words.append(f'range="{numbers([low, high])}"')
        low, high = (float(x[model.idx_vs[j]]) for x in (model.lowerEffortLimit, model.upperEffortLimit))
        if abs(low) < _LIMITLESS and abs(high) < _LIMITLESS and (low, high) != (0.0, 0.0):
            words.append(f'actuatorfrcrange="{numbers([low, high])}"')
        return words

    def pose(self, frame: str) -> tuple[str, Array]:
        """Return the link of the body that carries a frame, and the frame's pose there."""
        f = find_frame(self.model, frame)
        if f.parentJoint == 0:
            return self.tree.root, np.array(f.placement.homogeneous)
        name = self.model.names[f.parentJoint]
        return self.tree.joints[name].child, np.array(f.placement.homogeneous)

    def site(self, frame: str) -> str:
        if frame in self.sites:
            return frame
        link, M = self.pose(frame)
        self.extra_sites.setdefault(link, []).append((frame, M))
        self.sites.add(frame)
        return frame

    def second_site(self, frame: str, offset: Array) -> str:
        link, M = self.pose(frame)
        name = f"{frame} axis"
        if name not in self.sites:
            self.extra_sites.setdefault(link, []).append((name, M @ offset))
            self.sites.add(name)
        return name

    def keyframes(self) -> list[str]:
        lines = []
        for name, q in configurations(self.model):
            qpos = np.concatenate([self.qpos(j, q) for j in self.order])
            lines.append(f'    <key name={quoted(name)} qpos="{numbers(qpos)}"/>')
        return lines

    def qpos(self, j: int, q: Array) -> Array:
        model = self.model
        mine = q[q_slice(model, j)]
        kind = model.joints[j].shortname()
        if kind == "JointModelFreeFlyer":
            world = pin.SE3ToXYZQUAT(model.jointPlacements[j] * pin.XYZQUATToSE3(mine))
            return np.concatenate([world[:3], np.roll(world[3:], 1)])
        if kind == "JointModelSpherical":
            return np.roll(mine, 1)
        return np.array([np.arctan2(mine[1], mine[0])]) if mine.size == 2 else mine

    def geom(self, visual: Visual, above: Array, indent: str) -> list[str]:
        size, M = visual.size, above @ visual.placement
        if visual.shape == "box":
            shape = f'type="box" size="{numbers([0.5 * s for s in size])}"'
        elif visual.shape == "sphere":
            shape = f'type="sphere" size="{numbers(size)}"'
        elif visual.shape == "mesh":
            asset = mesh_name(visual.mesh, self.folder), size
            shape = f'type="mesh" mesh={quoted(self.meshes.setdefault(asset, f"mesh{len(self.meshes)}"))}'
        else:
            shape = f'type="{visual.shape}" size="{numbers([size[0], 0.5 * size[1]])}"'
        rest = f'rgba="{numbers(visual.rgba)}" contype="0" conaffinity="0" mass="0"'
        return [f"{indent}<geom {shape}{_pose(M)} {rest}/>"]


def _inertia(inertia: pin.Inertia) -> str:
    """Return a tensor about the mass centre in the form that MuJoCo takes.

    It asks principal moments for A + B >= C. A flat body has A + B = C, and MuJoCo's own principal axes of a full
    tensor may miss it by round-off. Such a body is given in principal axes, its moments made of second moments
    a, b, c >= 0: (b + c) + (a + c) >= a + b, which rounding keeps because it is monotonic.
    """
    I = np.array(inertia.inertia)
    moments, R = np.linalg.eigh(I)
    second = 0.5 * moments.sum() - moments
    scale = np.abs(moments).sum() + inertia.mass * float(inertia.lever @ inertia.lever)
    thin = second.min() < _THIN * scale or moments[0] < _SMALL
    if not thin or second.min() < -_THIN * scale:  # an impossible body is written as it is
        return f'fullinertia="{numbers([I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]])}"'
    real = np.maximum(second, 0.0)
    a, b, c = real if np.sort(real)[:2].sum() > _LEAST else np.maximum(real, _LEAST)
    x, y, z, w = pin.Quaternion(R * [1.0, 1.0, np.sign(np.linalg.det(R))]).coeffs()
    return f'diaginertia="{numbers([b + c, a + c, a + b])}" quat="{numbers([w, x, y, z])}"'


def _section(tag: str, lines: list[str]) -> list[str]:
    return [f"  <{tag}>", *lines, f"  </{tag}>"] if lines else []


def _scale(scale: tuple[float, ...]) -> str:
    return "" if scale == (1.0, 1.0, 1.0) else f' scale="{numbers(scale)}"'


def _pose(M: Array) -> str:
    text = "" if not np.any(M[:3, 3]) else f' pos="{numbers(M[:3, 3])}"'
    if np.array_equal(M[:3, :3], np.eye(3)):
        return text
    x, y, z, w = pin.Quaternion(np.array(M[:3, :3])).coeffs()
    return text + f' quat="{numbers([w, x, y, z])}"'
