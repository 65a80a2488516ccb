"""The equations of closures at one configuration, from Pinocchio's frames: what the engine is held against."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

import fivebar_pin as fb
from fivebar_pin.closures import Coupling
from fivebar_pin.closures.rows import Row
from fivebar_pin.mechanism.loops import loops_of

_ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class Equations:
    """Residual, Jacobian and drift of all closures of a chain, scaled (m,), (m, nv), (m,)."""

    def __init__(self, chain: fb.ClosedChain, q: np.ndarray, v: np.ndarray) -> None:
        model, data = chain.model, chain.model.createData()
        pin.computeJointJacobians(model, data, q)
        pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
        pin.updateFramePlacements(model, data)
        found = []
        for closure in chain.closures:
            if isinstance(closure, Coupling):
                found.append(_tied(closure, model, q))
            else:
                one, two = (_Frame(model, data, name, v) for name in closure.frames)
                found += [_row(row, one, two) for row in closure.rows]
        scale, (residual, J, drift) = loops_of(chain).row_scale, zip(*found, strict=True)
        self.residual, self.drift = scale * np.array(residual), scale * np.array(drift)
        self.J = scale[:, None] * np.array(J)


class _Frame:
    """A frame: axes, origin, Jacobians, angular velocity and those of its origin, accelerations, world axes."""

    def __init__(self, model: pin.Model, data: pin.Data, name: str, v: np.ndarray) -> None:
        k = model.getFrameId(name)
        J = pin.getFrameJacobian(model, data, k, _ALIGNED)
        self.R, self.p = data.oMf[k].rotation, data.oMf[k].translation
        self.linear, self.angular = J[:3], J[3:]
        self.v, self.w = self.linear @ v, self.angular @ v
        acceleration = pin.getFrameClassicalAcceleration(model, data, k, _ALIGNED)
        self.a, self.alpha = acceleration.linear, acceleration.angular


def _row(row: Row, one: _Frame, two: _Frame) -> tuple[float, np.ndarray, float]:
    b, d = one.R @ row.direction, two.p - one.p
    rate, second = two.v - one.v, two.a - one.a
    J_d, J_w = two.linear - one.linear, two.angular - one.angular
    if row.sort == "along":
        J = b @ (J_d + pin.skew(d) @ one.angular)
        turning = np.cross(one.w, np.cross(one.w, d)) - 2.0 * np.cross(one.w, rate) - np.cross(one.alpha, d)
        return b @ d - row.number, J, b @ (second + turning)
    if row.sort == "tilt":
        n, w = two.R @ row.other, two.w - one.w
        drift = np.cross(two.alpha - one.alpha, n) + np.cross(w, np.cross(two.w, n)) - np.cross(one.w, np.cross(w, n))
        return b @ n - row.number, np.cross(n, b) @ J_w, b @ drift
    if row.sort == "turned":
        Q = one.R.T @ two.R
        drift = b @ (two.alpha - one.alpha - np.cross(one.w, two.w))  # where it is closed
        return row.direction @ pin.log3(Q) - row.number, row.direction @ pin.Jlog3(Q) @ two.R.T @ J_w, drift
    size = float(np.linalg.norm(d))
    u = d / size
    return size - row.number, u @ J_d, u @ second + (rate @ rate - (u @ rate) ** 2) / size


def _tied(closure: Coupling, model: pin.Model, q: np.ndarray) -> tuple[float, np.ndarray, float]:
    J, total = np.zeros(model.nv), -closure.offset
    for name, ratio in closure.ratios.items():
        j = model.getJointId(name)
        J[model.idx_vs[j]] = ratio
        total += ratio * q[model.idx_qs[j]]
    return total, J, 0.0
