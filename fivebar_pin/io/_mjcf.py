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
from fivebar_pin.errors import FileFormatError, FiveBarPinError, UnknownNameError
from fivebar_pin.io._build import build_model
from fivebar_pin.io._mjcf_equality import Equality, check_tendons
from fivebar_pin.io._mjcf_reader import MjcfReader, homogeneous, quaternion_matrix
from fivebar_pin.io._mjcf_springs import tendon_springs
from fivebar_pin.io._mjcf_tree import BodyTree
from fivebar_pin.io._sidecar import Sidecar
from fivebar_pin.io._xml import parse_xml
from fivebar_pin.springs import JointSpring, Spring

__all__ = ["GRAIN", "MASSLESS", "ORDER", "UNBOUNDED", "read_mjcf"]

UNBOUNDED, ORDER, MASSLESS = "unbounded ", "joint order", "massless "
"""Names of <custom><numeric> entries that our writer makes.

A hinge whose coordinates are cosine and sine; for each joint its place in the file's order, when the chain has them in
another; a body whose mass of one `GRAIN` stands for none.
"""
GRAIN = 1e-14
"""Mass and moments of inertia that a moving body without any is written with: ten times MuJoCo's least [kg, kg m2]."""

_SECTIONS = (
    "actuator", "asset", "compiler", "contact", "custom", "default", "equality", "keyframe", "option", "sensor", "size",
    "statistic", "tendon", "visual", "worldbody",
)  # fmt: skip
_REFUSED = {
    "deformable": "deformable bodies are not supported",
    "include": "included files are not read; merge them into this one",
    "extension": "plugins are not supported",
}
_DRIVES = (
    "adhesion", "cylinder", "damper", "dcmotor", "general", "intvelocity", "motor", "muscle", "plugin", "position",
    "velocity",
)  # fmt: skip
_WIDTHS = {"JointModelSpherical": 4, "JointModelFreeFlyer": 7}


def read_mjcf(
    path: Path,
    *,
    closures: tuple[Closure, ...] | None = None,
    actuated: tuple[str, ...] | None = None,
    max_bytes: int = MAX_BYTES,
) -> ClosedChain:
    """Return the chain that an MJCF file describes; see `fivebar_pin.io.load`.

    Coordinates are in MuJoCo's order. Read: bodies, hinge / slide / ball / free joints with their limits and losses,
    inertias stated or from solid geoms, default classes, keyframes, the equalities connect, weld, joint and tendon,
    springs of joints, and spatial tendons between two sites as springs. Contacts, cameras, lights and sensors are not
    part of a mechanism and are passed over. Whatever else acts on it is refused by name.
    """
    root = parse_xml(path, root="mujoco", max_bytes=max_bytes)
    reader = MjcfReader(path, root)
    _check_sections(reader, root)
    check_tendons(reader, root)
    bodies = BodyTree(reader, _meshes(reader, root))
    for worldbody in root.findall("worldbody"):
        bodies.world(worldbody)
    if not bodies.order:
        raise FileFormatError(path, "has no joint in its <worldbody>")
    _unbounded(reader, root, bodies)
    _massless(reader, root, bodies)
    found = Equality(reader, root, bodies).closures() if closures is None else closures
    driven = _actuated(reader, root, bodies) if actuated is None else actuated
    tree = bodies.tree(root.get("model") or path.stem)
    sidecar = Sidecar(gravity=_gravity(reader, root), joint_order=_order(reader, root, bodies), joint_data=bodies.data)
    model = build_model(tree, sidecar, free_flyer=False, urdf=path, beside=path)
    _keyframes(reader, root, model, bodies.order)
    springs: tuple[Spring | JointSpring, ...] = (*tendon_springs(reader, root, bodies, model), *bodies.springs)
    visuals = tuple(v for link in tree.links.values() for v in link.visuals)
    try:
        return ClosedChain(model, found, driven, name=tree.name, visuals=visuals, springs=springs)
    except FiveBarPinError as error:
        if closures is not None or actuated is not None:
            raise
        raise FileFormatError(path, str(error)) from error


def _check_sections(reader: MjcfReader, root: ElementTree.Element) -> None:
    for section in root:
        if section.tag in _REFUSED and (len(section) or section.tag == "include"):
            raise reader.fail(f"<{section.tag}>", _REFUSED[section.tag])
        if section.tag not in _SECTIONS and section.tag not in _REFUSED:
            raise reader.fail("<mujoco>", str(UnknownNameError("section", section.tag, (*_SECTIONS, *_REFUSED))))
    for element in root.iter("include"):
        raise reader.fail(f"<{element.tag}>", _REFUSED["include"])
    for word in ("boundmass", "boundinertia", "settotalmass", "balanceinertia", "inertiagrouprange"):
        if reader.compiler.get(word, "0").split()[:1] not in (["0"], ["false"], ["-1"], ["0.0"]):
            raise reader.fail("<compiler>", f"{word} is not supported; state the masses and inertias themselves")
    if reader.compiler.get("coordinate", "local") != "local":
        raise reader.fail("<compiler>", "global coordinates are not supported; write local ones")
    if reader.compiler.get("inertiafromgeom", "auto") not in ("auto", "true", "false"):
        raise reader.fail("<compiler>", "inertiafromgeom must be auto, true or false")
    option = reader.merged(root.findall("option"))
    for word in ("density", "viscosity", "wind"):
        if any(reader.number(x, word, "<option>") for x in option.get(word, "").split()):
            raise reader.fail("<option>", f"{word}: forces of a fluid are not supported; remove it")


def _gravity(reader: MjcfReader, root: ElementTree.Element) -> tuple[float, ...]:
    option = ElementTree.Element("option", reader.merged(root.findall("option")))
    return tuple(reader.numbers(option, "gravity", 3, "<option>", [0.0, 0.0, -9.81]))


def _meshes(reader: MjcfReader, root: ElementTree.Element) -> dict[str, str]:
    folder = reader.path.parent / reader.compiler.get("meshdir", reader.compiler.get("assetdir", ""))
    meshes = {}
    for mesh in root.findall("asset/mesh"):
        file = mesh.get("file", "")
        meshes[mesh.get("name") or Path(file).stem] = str(folder / file) if file else ""
    return meshes


def _order(reader: MjcfReader, root: ElementTree.Element, bodies: BodyTree) -> tuple[str, ...]:
    """Return the joints in the file's order, or in the one that our writer noted."""
    for numeric in root.findall("custom/numeric"):
        if numeric.get("name") == ORDER:
            places = reader.numbers(numeric, "data", len(bodies.order), f"custom {ORDER!r}", None)
            if sorted(places) != list(range(len(places))):
                raise reader.fail(f"custom {ORDER!r}", "must name each place once")
            return tuple(bodies.order[int(k)] for k in places)
    return tuple(bodies.order)


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


def _actuated(reader: MjcfReader, root: ElementTree.Element, bodies: BodyTree) -> tuple[str, ...]:
    names: list[str] = []
    for actuator in root.findall("actuator/*"):
        where = f"{actuator.tag} {actuator.get('name', '')!r}"
        if actuator.tag not in _DRIVES:
            raise reader.fail(where, str(UnknownNameError("actuator", actuator.tag, _DRIVES)))
        joint = actuator.get("joint") or actuator.get("jointinparent")
        if joint is None:
            raise reader.fail(where, "drives no joint; only actuators with joint= are supported")
        if joint not in bodies.order:
            raise reader.fail(where, str(UnknownNameError("joint", joint, bodies.order)))
        if bodies.joints[joint].kind not in ("revolute", "prismatic", "continuous"):
            raise reader.fail(where, f"drives {joint!r}, which has several degrees of freedom; a motor drives one")
        if joint not in names:
            names.append(joint)
    return tuple(names)


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
        quaternion = reader.unit(mine[-4:], "qpos", where)
        if take == 7:
            world = pin.SE3(homogeneous(mine[:3], quaternion_matrix(quaternion)))
            parts[j] = pin.SE3ToXYZQUAT(model.jointPlacements[j].actInv(world))
        else:
            parts[j] = np.roll(quaternion, -1)
    return np.concatenate([parts[j] for j in sorted(parts)])
