"""MJCF: the tree of bodies, the equality section as closures, the actuators' joints as driven joints."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin._files import MAX_BYTES
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Closure
from fivebar_pin.errors import FileFormatError, FiveBarPinError
from fivebar_pin.io._build import build_model
from fivebar_pin.io._find import title
from fivebar_pin.io._left_out import left_out
from fivebar_pin.io._mjcf_actuators import driven_joints
from fivebar_pin.io._mjcf_adjust import adjust_masses
from fivebar_pin.io._mjcf_assets import Assets
from fivebar_pin.io._mjcf_equality import FACTOR, HINGE, Equality
from fivebar_pin.io._mjcf_include import including
from fivebar_pin.io._mjcf_reader import MjcfReader, homogeneous, quaternion_matrix
from fivebar_pin.io._mjcf_sections import check_disabled, check_sections, gravity
from fivebar_pin.io._mjcf_springs import tendon_springs, timed_springs
from fivebar_pin.io._mjcf_tree import BodyTree
from fivebar_pin.io._sidecar import Sidecar
from fivebar_pin.springs import JointSpring, Spring

__all__ = ["GRAIN", "MASSLESS", "ORDER", "STATED", "TOLERANCE", "UNBOUNDED", "read_mjcf"]

UNBOUNDED, ORDER, MASSLESS, TOLERANCE = "unbounded ", "joint order", "massless ", "closure tolerance"
"""Names of <custom><numeric> entries that our writer makes.

A hinge whose coordinates are cosine and sine; for each joint its place in the file's order, when the chain has them in
another; a body whose mass of one `GRAIN` stands for none; how far loops may stay open.
"""
GRAIN = 1e-14
"""Mass and moments of inertia that a moving body without any is written with: ten times MuJoCo's least [kg, kg m2]."""

_OURS = (FACTOR, HINGE, MASSLESS, ORDER, TOLERANCE, UNBOUNDED)
STATED = "qpos0"
"""MuJoCo's name for the configuration in which the file places the bodies."""
_WIDTHS = {"JointModelSpherical": 4, "JointModelFreeFlyer": 7}


def read_mjcf(
    path: Path,
    *,
    closures: tuple[Closure, ...] | None = None,
    actuated: tuple[str, ...] | None = None,
    max_bytes: int = MAX_BYTES,
) -> ClosedChain:
    """Return the chain that an MJCF file describes; see `fivebar_pin.io.load`.

    Coordinates are MuJoCo's, in its order: a joint is at `ref` where the file places it, and that configuration is the
    reference "qpos0" where it is not zero. Read: included files, frames, bodies, hinge / slide / ball / free joints
    with their limits and losses, inertias stated or from geoms, meshes too, default classes, keyframes, the equalities
    connect, weld, joint and tendon, springs of joints, tendons of one joint and between two sites, and the joints that
    actuators drive. What does not move a mechanism (contacts, cameras, lights, sensors, textures, a fluid), what only
    stands for a controller (gravcomp, actuators without a joint) and what cannot be drawn is told in one
    `LeftOutWarning`. Whatever else acts on it is refused by name.
    """
    root, sources = including(path, max_bytes=max_bytes)
    reader = MjcfReader(path, root, sources)
    check_sections(reader, root)
    bodies = BodyTree(reader, Assets(reader, root))
    for worldbody in root.findall("worldbody"):
        bodies.world(worldbody)
    adjust_masses(reader, bodies)
    if not bodies.order:
        raise FileFormatError(path, "has no joint in its <worldbody>")
    _unbounded(reader, root, bodies)
    _massless(reader, root, bodies)
    found = Equality(reader, root, bodies).closures() if closures is None else closures
    driven = driven_joints(reader, root, bodies, found) if actuated is None else actuated
    tree = bodies.tree(title(root.get("model"), path))
    sidecar = Sidecar(gravity=gravity(reader, root), joint_order=_order(reader, root, bodies), joint_data=bodies.data)
    model = build_model(tree, sidecar, free_flyer=False, urdf=path, beside=path)
    stated = _stated_pose(model, bodies)
    _keyframes(reader, root, model, bodies.order)
    springs: tuple[Spring | JointSpring, ...] = (
        *tendon_springs(reader, root, bodies, model),
        *bodies.springs,
        *timed_springs(reader, bodies, model, stated),
    )
    acting = {
        "damper": bool(np.any(model.damping)) or any(spring.damping for spring in springs),
        "frictionloss": bool(np.any(model.upperDryFrictionLimit)),
        "spring": any(spring.stiffness for spring in springs),
    }
    check_disabled(reader, root, acting)
    visuals = tuple(v for link in tree.links.values() for v in link.visuals)
    try:
        chain = ClosedChain(model, found, driven, name=tree.name, visuals=visuals, springs=springs)
        chain = chain.with_tolerance(_tolerance(reader, root))
    except FiveBarPinError as error:
        if closures is not None or actuated is not None:
            raise
        raise FileFormatError(path, str(error)) from error
    if bodies.compensated:
        reader.left_out.append(f"gravcomp of {bodies.compensated} bodies, which are of full weight here")
    custom = [e.get("name", "") for e in root.findall("custom/*")]
    left_out(path, [*reader.left_out, *("custom value" for name in custom if not name.startswith(_OURS))])
    return chain


def _stated_pose(model: pin.Model, bodies: BodyTree) -> Array:
    """Return where the file places its joints, and keep it as a reference where it is not the neutral configuration."""
    q: Array = pin.neutral(model)
    moved = {joint: ref for joint, ref in bodies.refs.items() if ref}
    for joint, ref in moved.items():
        q[model.idx_qs[model.getJointId(joint)]] = ref
    if moved:
        model.referenceConfigurations[STATED] = q
    return q


def _order(reader: MjcfReader, root: ElementTree.Element, bodies: BodyTree) -> tuple[str, ...]:
    """Return the joints in the file's order, or in the one that our writer noted."""
    for numeric in root.findall("custom/numeric"):
        if numeric.get("name") == ORDER:
            places = reader.numbers(numeric, "data", len(bodies.order), f"custom {ORDER!r}", None)
            if sorted(places) != list(range(len(places))):
                raise reader.fail(f"custom {ORDER!r}", "must name each place once")
            return tuple(bodies.order[int(k)] for k in places)
    return tuple(bodies.order)


def _tolerance(reader: MjcfReader, root: ElementTree.Element) -> float:
    """Return how far loops may stay open, as our writer noted it [m or rad]."""
    stated = [e for e in root.findall("custom/numeric") if e.get("name") == TOLERANCE]
    return reader.numbers(stated[-1], "data", 1, f"custom {TOLERANCE!r}", None)[0] if stated else 0.0


def _unbounded(reader: MjcfReader, root: ElementTree.Element, bodies: BodyTree) -> None:
    """Make hinges that were saved from joints of two coordinates (cosine, sine) such joints again."""
    from dataclasses import replace

    for numeric in root.findall("custom/numeric"):
        name = numeric.get("name", "")
        if name.startswith(UNBOUNDED):
            joint = bodies.joints.get(name[len(UNBOUNDED) :])
            if joint is None or joint.kind != "revolute":
                raise reader.fail(f"custom {name!r}", "names no hinge of this file")
            if any(spring.joint == joint.name for spring in bodies.springs):
                raise reader.fail(f"joint {joint.name!r}", "stiffness of a hinge that does not count its turns")
            if bodies.refs.get(joint.name):
                raise reader.fail(f"joint {joint.name!r}", "ref of a hinge that does not count its turns")
            data = {word: joint.data[word] for word in ("effort", "velocity")}
            bodies.joints[joint.name] = replace(joint, kind="continuous", data=data)


def _massless(reader: MjcfReader, root: ElementTree.Element, bodies: BodyTree) -> None:
    """Take the grains of mass away that were given to bodies without; a mass stated since then stays."""
    from dataclasses import replace

    for numeric in root.findall("custom/numeric"):
        name = numeric.get("name", "")
        if not name.startswith(MASSLESS):
            continue
        link = bodies.bodies.get(name[len(MASSLESS) :])
        if link is None:
            raise reader.fail(f"custom {name!r}", "names no body of this file")
        inertia = bodies.links[link].inertia
        if inertia is not None and inertia.mass == GRAIN:
            bodies.links[link] = replace(bodies.links[link], inertia=None)


def _keyframes(reader: MjcfReader, root: ElementTree.Element, model: pin.Model, order: list[str]) -> None:
    """Keep keyframes as reference configurations, quaternions turned from (w, x, y, z) to (x, y, z, w)."""
    size = sum(
        {"JointModelSpherical": 4, "JointModelFreeFlyer": 7}.get(j.shortname(), 1) for j in list(model.joints)[1:]
    )
    for k, key in enumerate(root.findall("keyframe/key")):
        where = f"key {key.get('name', '')!r}"
        if "qpos" not in key.attrib:
            continue
        qpos = np.array(reader.numbers(key, "qpos", size, where, None))
        model.referenceConfigurations[key.get("name") or f"key{k}"] = _from_qpos(reader, model, qpos, order, where)


def _from_qpos(reader: MjcfReader, model: pin.Model, qpos: Array, order: list[str], where: str) -> Array:
    parts: dict[int, Array] = {}
    for j in (model.getJointId(name) for name in order):
        kind = model.joints[j].shortname()
        take = _WIDTHS.get(kind, 1)
        mine, qpos = qpos[:take], qpos[take:]
        if take == 1:
            parts[j] = np.array([np.cos(mine[0]), np.sin(mine[0])]) if model.nqs[j] == 2 else mine
            continue
        stated = mine[-4:] if np.any(mine[-4:]) else np.array([1.0, 0.0, 0.0, 0.0])  # as MuJoCo normalises it
        quaternion = reader.unit(stated, "qpos", where)
        if take == 7:
            world = pin.SE3(homogeneous(mine[:3], quaternion_matrix(quaternion)))
            parts[j] = pin.SE3ToXYZQUAT(model.jointPlacements[j].actInv(world))
        else:
            parts[j] = np.roll(quaternion, -1)
    return np.concatenate([parts[j] for j in sorted(parts)])
