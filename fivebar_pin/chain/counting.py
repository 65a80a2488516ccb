"""Joints that count their turns: a coupling with a ratio of 3.7 has to tell one turn from the next."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain.coordinates import q_slice
from fivebar_pin.chain.turns import Tie, with_turns
from fivebar_pin.closures import Closure

__all__ = ["counting_turns"]

_OF_VELOCITY = (
    "armature", "damping", "rotorGearRatio", "rotorInertia", "lowerDryFrictionLimit", "upperDryFrictionLimit",
    "lowerEffortLimit", "upperEffortLimit", "lowerVelocityLimit", "upperVelocityLimit",
)  # fmt: skip
_OF_CONFIGURATION = ("lowerPositionLimit", "upperPositionLimit", "positionLimitMargin")
_ALIGNED = (pin.JointModelRX, pin.JointModelRY, pin.JointModelRZ)


def counting_turns(model: pin.Model, closures: Iterable[Closure]) -> pin.Model:
    """Return the model with joints of two coordinates (cosine, sine) that closures count the turns of as revolute ones.

    They turn about the same axes, without limits. Reference configurations are converted; of the turns, which cosine
    and sine do not tell, the fewest are taken that make the closures hold. Where none do, angles are between -pi and
    pi. The model itself is returned where there is nothing to do.
    """
    closures = tuple(closures)
    joints = {name for closure in closures for name in closure.counted}
    turned = {
        j for j in range(1, model.njoints) if model.names[j] in joints and model.nqs[j] == 2 and model.nvs[j] == 1
    }
    if not turned:
        return model
    out = pin.Model()
    out.name, out.gravity = model.name, model.gravity
    for j in range(1, model.njoints):
        joint = _revolute(model, j) if j in turned else model.joints[j]
        out.addJoint(model.parents[j], joint, model.jointPlacements[j], model.names[j])
    for j in range(model.njoints):
        out.inertias[j] = model.inertias[j]
    for frame in list(model.frames)[1:]:
        out.addFrame(frame, False)
    for word in _OF_VELOCITY:
        setattr(out, word, np.array(getattr(model, word)))
    for word in _OF_CONFIGURATION:
        values = np.array(getattr(out, word))
        for j in set(range(1, model.njoints)) - turned:
            values[q_slice(out, j)] = np.array(getattr(model, word))[q_slice(model, j)]
        setattr(out, word, values)
    ties = [_tie(out, closure.counted, *closure.tie) for closure in closures if closure.tie]
    places = [int(out.idx_qs[j]) for j in sorted(turned)]
    for entry in model.referenceConfigurations:
        q = _counted(model, out, turned, np.array(entry.data()))
        out.referenceConfigurations[entry.key()] = with_turns(q, ties, places)
    return out


def _revolute(model: pin.Model, j: int) -> object:
    joint = model.joints[j]
    data = joint.createData()
    joint.calc(data, pin.neutral(model))
    axis = np.array(data.S, dtype=np.float64).reshape(6)[3:]
    for k, aligned in enumerate(_ALIGNED):
        if np.array_equal(axis, np.eye(3)[k]):
            return aligned()
    return pin.JointModelRevoluteUnaligned(axis)


def _counted(model: pin.Model, out: pin.Model, turned: set[int], q: Array) -> Array:
    """Return a configuration in the coordinates of the new model."""
    counted = np.zeros(out.nq)
    for j in range(1, model.njoints):
        mine = q[q_slice(model, j)]
        counted[q_slice(out, j)] = np.arctan2(mine[1], mine[0]) if j in turned else mine
    return counted


def _tie(model: pin.Model, joints: Iterable[str], ratios: Iterable[float], offset: float) -> Tie:
    """Return a coupling in terms of a configuration (nq,)."""
    c = np.zeros(model.nq)
    for joint, ratio in zip(joints, ratios, strict=True):
        c[model.idx_qs[model.getJointId(joint)]] = ratio
    return c, offset
