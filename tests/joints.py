"""Every joint that a model may have, for tests of the tree."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from mechanisms import add, at, body

__all__ = ["JOINTS", "SLANTED", "tree_with"]

SLANTED = np.array([0.2, -0.6, 0.77]) / np.linalg.norm([0.2, -0.6, 0.77])


def composite(*joints: object) -> object:
    """Return several joints in one, each placed on the one before."""
    rng = np.random.default_rng(len(joints))
    made = pin.JointModelComposite(joints[0], at(*rng.normal(size=3), rng.normal(size=3)))
    for joint in joints[1:]:
        made.addJoint(joint, at(*rng.normal(size=3), rng.normal(size=3)))
    return made


def slanted_unbounded() -> object:
    """Return an unbounded hinge about a slanted axis; only the URDF reader makes one."""
    axis = " ".join(repr(float(x)) for x in SLANTED)
    links = '<link name="base"/><link name="arm"/>'
    hinge = f'<joint name="j" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="{axis}"/></joint>'
    return pin.buildModelFromXML(f'<robot name="r">{links}{hinge}</robot>').joints[1]


def nested() -> object:
    inner = composite(pin.JointModelRUBY(), pin.JointModelSpherical(), pin.JointModelHZ(0.2))
    return composite(pin.JointModelPX(), inner, pin.JointModelRX())


JOINTS = {
    "RX": pin.JointModelRX,
    "RY": pin.JointModelRY,
    "RZ": pin.JointModelRZ,
    "revolute": lambda: pin.JointModelRevoluteUnaligned(SLANTED),
    "revolute against z": lambda: pin.JointModelRevoluteUnaligned(np.array([0.0, 0.0, -1.0])),
    "RUBX": pin.JointModelRUBX,
    "RUBY": pin.JointModelRUBY,
    "RUBZ": pin.JointModelRUBZ,
    "revolute unbounded": lambda: slanted_unbounded(),
    "PX": pin.JointModelPX,
    "PY": pin.JointModelPY,
    "PZ": pin.JointModelPZ,
    "prismatic": lambda: pin.JointModelPrismaticUnaligned(SLANTED),
    "HX": lambda: pin.JointModelHX(-0.4),
    "HY": lambda: pin.JointModelHY(0.4),
    "HZ": lambda: pin.JointModelHZ(0.3),
    "helical": lambda: pin.JointModelHelicalUnaligned(SLANTED, -0.2),
    "prismatic of another length": lambda: pin.JointModelPrismaticUnaligned(2.0 * SLANTED),
    "spherical": pin.JointModelSpherical,
    "spherical ZYX": pin.JointModelSphericalZYX,
    "translation": pin.JointModelTranslation,
    "planar": pin.JointModelPlanar,
    "free flyer": pin.JointModelFreeFlyer,
    "ellipsoid": lambda: pin.JointModelEllipsoid(0.3, -0.4, 0.55),
    "ball on an ellipsoid of no size": lambda: pin.JointModelEllipsoid(0.0, 0.0, 0.0),
    "universal": lambda: pin.JointModelUniversal(np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.6, 0.8])),
    "composite": lambda: composite(pin.JointModelRX(), pin.JointModelPY(), pin.JointModelRZ()),
    "composite with an ellipsoid": lambda: composite(
        pin.JointModelRY(), pin.JointModelEllipsoid(0.2, 0.7, 0.4), pin.JointModelPX()
    ),
    "composite of wide ones": lambda: composite(pin.JointModelFreeFlyer(), pin.JointModelPlanar()),
    "nested composite": nested,
}


def tree_with(joint: object, base: pin.SE3 | None = None) -> pin.Model:
    """Return a tree, not depth-first, that has the joint at its roots, in its middle and at a tip."""
    model, base = pin.Model(), at() if base is None else base
    root = add(model, 0, joint(), base * at(0.1, -0.2, 0.3, (0.3, 0.2, -0.5)), "root", body(1))
    middle = add(model, root, pin.JointModelRY(), at(0.4, 0.1, -0.1), "hinge", body(2))
    branch = add(model, middle, joint(), at(0.2, 0.3, 0.2, (-0.4, 0.9, 0.1)), "branch", body(3))
    add(model, root, pin.JointModelPX(), at(0.0, 0.3, 0.1, (0.9, 0.0, 0.3)), "slide", body(4))
    add(model, 0, joint(), base * at(0.5, 0.5, 0.1, (0.4, 0.8, 0.3)), "second root", body(6))
    add(model, branch, joint(), at(), "tip", body(5))
    return model
