"""Random trees of every one-axis kind, and what it means that two chains are the same."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Closure
from fivebar_pin.io._build import joint_model

VECTORS = ("lowerPositionLimit", "upperPositionLimit", "upperEffortLimit", "upperVelocityLimit", "damping")
LOSSES = ("upperDryFrictionLimit", "lowerDryFrictionLimit", "armature", "rotorInertia", "rotorGearRatio")


def mass_matrix(model: pin.Model, q: Array) -> Array:
    M = pin.crba(model, model.createData(), q)
    return np.triu(M) + np.triu(M, 1).T


def random_inertia(rng: np.random.Generator) -> pin.Inertia:
    A = rng.normal(size=(3, 3))
    S = A @ A.T
    return pin.Inertia(rng.uniform(0.1, 3.0), rng.normal(size=3), np.trace(S) * np.eye(3) - S)


def random_placement(rng: np.random.Generator) -> pin.SE3:
    return pin.SE3(pin.Quaternion(rng.normal(size=4)).normalized().toRotationMatrix(), rng.normal(size=3))


def random_chain(seed: int, *, names: str = "dcabe") -> ClosedChain:
    """A spatial tree in an order that is not alphabetical, of every one-axis kind, with frames, limits and losses."""
    rng = np.random.default_rng(seed)
    unit = rng.normal(size=3)
    unit /= np.linalg.norm(unit)
    kinds = [
        pin.JointModelRZ(),
        pin.JointModelRevoluteUnaligned(unit),
        pin.JointModelPX(),
        joint_model("continuous", unit) if seed % 2 else pin.JointModelRUBY(),
        pin.JointModelPrismaticUnaligned(unit),
    ]
    model, parents = pin.Model(), (0, 1, 2, 0, 4)
    model.name = "every kind"
    for name, kind, parent in zip(names, kinds, parents, strict=True):
        j = model.addJoint(parent, kind, random_placement(rng), name)
        model.appendBodyToJoint(j, random_inertia(rng), pin.SE3.Identity())
        model.addJointFrame(j)
        model.addBodyFrame(f"link_{name}", j, pin.SE3.Identity(), model.nframes - 1)
        model.addFrame(pin.Frame(f"tip_{name}", j, model.nframes - 1, random_placement(rng), pin.FrameType.OP_FRAME))
    lower = model.lowerPositionLimit
    lower[:2], model.upperPositionLimit[:2] = -1e4, 1e4
    for word in ("damping", "armature", "upperDryFrictionLimit"):
        getattr(model, word)[:] = rng.uniform(0.01, 1.0, size=model.nv)
    model.lowerDryFrictionLimit[:] = -model.upperDryFrictionLimit
    model.gravity.linear = rng.normal(size=3)
    model.referenceConfigurations["home"] = pin.neutral(model)
    closures = (
        Closure((f"tip_{names[2]}", f"tip_{names[4]}"), "3d"),
        Closure((f"tip_{names[1]}", f"link_{names[3]}"), "revolute", axis=unit, name="hinge"),
        Closure(("universe", f"tip_{names[0]}"), "6d"),
    )
    return ClosedChain(model, closures, (names[4], names[0]))


def assert_same(first: ClosedChain, second: ClosedChain, rtol: float = 1e-15) -> None:
    """Every number of the two mechanisms agrees, relative to the largest of its kind."""
    a, b = first.model, second.model
    assert second.joints == first.joints
    assert second.actuated == first.actuated
    assert list(a.idx_qs) == list(b.idx_qs)
    for x, y in zip(a.jointPlacements, b.jointPlacements, strict=True):
        np.testing.assert_allclose(y.homogeneous, x.homogeneous, rtol=0.0, atol=rtol)
    for x, y in zip(a.inertias, b.inertias, strict=True):
        scale = max(1.0, float(np.abs(x.toDynamicParameters()).max()))
        np.testing.assert_allclose(y.toDynamicParameters(), x.toDynamicParameters(), rtol=0.0, atol=rtol * scale)
        np.testing.assert_allclose(y.lever, x.lever, rtol=rtol, atol=rtol)
        assert y.mass == pytest.approx(x.mass, rel=rtol)
    for word in (*VECTORS, *LOSSES):
        np.testing.assert_array_equal(getattr(b, word), getattr(a, word), err_msg=word)
    np.testing.assert_array_equal(b.gravity.linear, a.gravity.linear)
    assert [(c.name, c.joins, c.kind) for c in second.closures] == [(c.name, c.joins, c.kind) for c in first.closures]
    for c, d in zip(first.closures, second.closures, strict=True):
        assert c.values().keys() == d.values().keys()
        for key, value in c.values().items():
            np.testing.assert_allclose(d.values()[key], value, rtol=0.0, atol=rtol)
        for name in c.ends:
            f, g = (m.frames[m.getFrameId(name)] for m in (a, b))
            assert f.parentJoint == g.parentJoint
            np.testing.assert_allclose(g.placement.homogeneous, f.placement.homogeneous, rtol=0.0, atol=2 * rtol)
