"""Open-tree kinematics over a batch of samples.

Pinocchio evaluates one configuration per call; from Python the calls and the copies cost more than the arithmetic.
Here the same recursion runs over all samples at once, joint by joint. Everything a joint does is read off
Pinocchio's own joint models; joints other than revolute and prismatic ones are evaluated through them, sample by
sample. Spatial quantities are linear-before-angular, in world axes at the world origin.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array, cross

__all__ = ["Poses", "Rates", "Tree", "motion_cross"]


_FEW = 6  # up to here one Pinocchio call per sample beats the batch
_LARGE = 60  # velocity coordinates from which on pin.Data is not made: it holds tables of nv^3 (1.6 GB for 300)


class _Kind(Enum):
    REVOLUTE = "revolute"  # q = angle
    UNBOUNDED = "unbounded"  # q = (cos, sin)
    PRISMATIC = "prismatic"
    OTHER = "other"  # evaluated by Pinocchio's joint model


@dataclass(frozen=True, slots=True, eq=False)
class _Joint:
    kind: _Kind
    parent: int
    R: Array | None  # placement rotation in the parent, None for identity
    p: Array | None  # placement translation, None for zero
    axis: Array  # unit, in the joint frame
    K: Array  # [axis]x
    K2: Array  # [axis]x squared
    aligned: int  # 0, 1, 2 when the axis is x, y, z of the joint frame, else -1
    q: slice
    v: slice
    model: Any  # Pinocchio's joint model


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """World poses of the joints and their motion subspaces.

    Attributes:
        R: per joint (n, 3, 3), index 0 is the universe.
        p: per joint (n, 3) [m].
        S: motion subspace of every velocity coordinate, world axes at the world origin (n, 6, nv).
        q: the configurations (n, nq).
    """

    R: list[Array]
    p: list[Array]
    S: Array
    q: Array


@dataclass(frozen=True, slots=True, eq=False)
class Rates:
    """Spatial velocity and bias acceleration (zero joint accelerations) per joint, (n, 6) each."""

    V: list[Array]
    A: list[Array]


class Tree:
    """The open tree of one model, prepared for batches.

    Args:
        model: read, never changed; must outlive this object.
    """

    def __init__(self, model: pin.Model) -> None:
        self.nq, self.nv, self.njoints = int(model.nq), int(model.nv), int(model.njoints)
        self._model = model
        self._workspace = threading.local()
        self.joints: list[_Joint | None] = [None, *(_read_joint(model, j) for j in range(1, self.njoints))]
        self._owner = [
            joint for joint in self.joints[1:] if joint is not None for _ in range(joint.v.stop - joint.v.start)
        ]
        self.is_vector_space = all(j is None or j.q.stop - j.q.start == j.v.stop - j.v.start for j in self.joints) and (
            not any(j is not None and j.kind is _Kind.OTHER for j in self.joints)
        )
        self.support = np.zeros((self.njoints, self.nv), dtype=np.bool_)
        for j, joint in enumerate(self.joints):
            if joint is not None:
                self.support[j] = self.support[joint.parent]
                self.support[j, joint.v] = True

    def poses(self, q: Array) -> Poses:
        """Return the poses of all joints.  q (n, nq)."""
        n = q.shape[0]
        if n <= _FEW and self.nv <= _LARGE:
            return self._poses_of_few(q)
        R: list[Array] = [np.broadcast_to(np.eye(3), (n, 3, 3))]
        p: list[Array] = [np.zeros((n, 3))]
        S = np.zeros((n, 6, self.nv))
        for joint in self.joints[1:]:
            assert joint is not None
            _advance(joint, q, R, p, S)
        return Poses(R, p, S, q)

    @property
    def _data(self) -> Any:
        """Pinocchio's workspace, of each thread its own: one that is shared gives wrong numbers."""
        if not hasattr(self._workspace, "data"):
            self._workspace.data = self._model.createData()
        return self._workspace.data

    def _poses_of_few(self, q: Array) -> Poses:
        """The same through Pinocchio, which is faster for a handful of samples."""
        n, data = q.shape[0], self._data
        R = [np.empty((n, 3, 3)) for _ in range(self.njoints)]
        p = [np.empty((n, 3)) for _ in range(self.njoints)]
        S = np.empty((n, 6, self.nv))
        for i in range(n):
            S[i] = pin.computeJointJacobians(self._model, data, q[i]).reshape(6, self.nv)
            for j, M in enumerate(data.oMi):
                R[j][i], p[j][i] = M.rotation, M.translation
        return Poses(R, p, S, q)

    def coordinate(self, q: Array, k: int) -> Array:
        """Return the coordinate that belongs to velocity index k of a one-degree-of-freedom joint.  (n, nq) -> (n,)."""
        joint = self._of_velocity(k)
        if joint.kind is _Kind.UNBOUNDED:
            return np.asarray(np.arctan2(q[:, joint.q.start + 1], q[:, joint.q.start]))
        return np.asarray(q[:, joint.q.start])

    def set_coordinate(self, q: Array, k: int, value: Array) -> None:
        """Write the coordinate of velocity index k into q (n, nq), in place."""
        joint = self._of_velocity(k)
        if joint.kind is _Kind.UNBOUNDED:
            q[:, joint.q.start], q[:, joint.q.start + 1] = np.cos(value), np.sin(value)
        else:
            q[:, joint.q.start] = value

    def is_angle(self, k: int) -> bool:
        """Whether velocity index k is a rotation (else a length)."""
        return self._of_velocity(k).kind is not _Kind.PRISMATIC

    def is_cyclic(self, k: int) -> bool:
        """Whether velocity index k turns a joint that does not count its turns."""
        return self._of_velocity(k).kind is _Kind.UNBOUNDED

    def _of_velocity(self, k: int) -> _Joint:
        return self._owner[k]

    def rates(self, q: Array, v: Array, poses: Poses) -> Rates:
        """Return spatial velocities and bias accelerations.  q (n, nq), v (n, nv)."""
        zero = np.zeros((v.shape[0], 6))
        V, A = [zero], [zero]
        for j, joint in enumerate(self.joints):
            if joint is None:
                continue
            own = (
                poses.S[:, :, joint.v.start] * v[:, joint.v.start, None]
                if joint.v.stop - joint.v.start == 1
                else np.matmul(poses.S[:, :, joint.v], v[:, joint.v, None])[..., 0]
            )
            V.append(V[joint.parent] + own)
            bias = motion_cross(V[j], own) if joint.parent or joint.v.stop - joint.v.start > 1 else zero
            if joint.kind is _Kind.OTHER:
                bias = bias + _own_bias(joint, q, v, poses.R[j], poses.p[j])
            A.append(A[joint.parent] + bias)
        return Rates(V, A)

    def integrate(self, q: Array, dv: Array) -> Array:
        """Return q moved along the tangent dv.  q (n, nq), dv (n, nv)."""
        if self.is_vector_space:
            return np.asarray(q + dv)
        out = np.array(q)
        for joint in self.joints[1:]:
            assert joint is not None
            if joint.kind is _Kind.UNBOUNDED:
                c, s = np.cos(dv[:, joint.v.start]), np.sin(dv[:, joint.v.start])
                x, y = q[:, joint.q.start], q[:, joint.q.start + 1]
                cs = np.stack([c * x - s * y, s * x + c * y], axis=1)
                out[:, joint.q] = cs / np.linalg.norm(cs, axis=1)[:, None]
            elif joint.kind is _Kind.OTHER:
                continue
            else:
                out[:, joint.q] = q[:, joint.q] + dv[:, joint.v]
        if any(joint is not None and joint.kind is _Kind.OTHER for joint in self.joints):
            full = np.stack([pin.integrate(self._model, a, b) for a, b in zip(q, dv, strict=True)])
            for joint in self.joints[1:]:
                assert joint is not None
                if joint.kind is _Kind.OTHER:
                    out[:, joint.q] = full[:, joint.q]
        return out

    def difference(self, q0: Array, q1: Array) -> Array:
        """Return the tangent that leads from q0 to q1, (n, nv).

        Pinocchio's own loses turns of a (cos, sin) joint below 1e-8 rad: it takes them from a cosine.
        """
        if self.is_vector_space:
            return np.asarray(q1 - q0)
        q0, q1 = np.broadcast_arrays(q0, q1)
        others = any(joint is not None and joint.kind is _Kind.OTHER for joint in self.joints)
        if others:
            out = np.stack([pin.difference(self._model, a, b) for a, b in zip(q0, q1, strict=True)])
        else:
            out = np.empty((q0.shape[0], self.nv))
        for joint in self.joints[1:]:
            assert joint is not None
            if joint.kind is _Kind.UNBOUNDED:
                (c0, s0), (c1, s1) = (q[:, joint.q].T for q in (q0, q1))
                out[:, joint.v.start] = np.arctan2(c0 * s1 - s0 * c1, c0 * c1 + s0 * s1)
            elif joint.kind is not _Kind.OTHER:
                out[:, joint.v] = q1[:, joint.q] - q0[:, joint.q]
        return out


def motion_cross(V: Array, W: Array) -> Array:
    """Return V × W for spatial motion vectors (..., 6), linear before angular."""
    w = V[..., 3:]
    return np.concatenate(
        [cross(w, W[..., :3]) + cross(V[..., :3], W[..., 3:]), cross(w, W[..., 3:])],
        axis=-1,
    )


def _read_joint(model: pin.Model, j: int) -> _Joint:
    joint = model.joints[j]
    data = joint.createData()
    joint.calc(data, pin.neutral(model), np.zeros(model.nv))
    S = np.array(data.S).reshape(6, -1) if joint.nv else np.zeros((6, 0))
    kind, axis = _Kind.OTHER, np.array([0.0, 0.0, 1.0])
    name = joint.shortname()
    if joint.nv == 1 and name.startswith(("JointModelR", "JointModelP")) and "Helical" not in name:
        linear, angular = S[:3, 0], S[3:, 0]
        if not linear.any() and joint.nq == 2:
            kind, axis = _Kind.UNBOUNDED, angular
        elif not linear.any() and joint.nq == 1:
            kind, axis = _Kind.REVOLUTE, angular
        elif not angular.any() and joint.nq == 1:
            kind, axis = _Kind.PRISMATIC, linear
    R, p = np.array(model.jointPlacements[j].rotation), np.array(model.jointPlacements[j].translation)
    K = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    return _Joint(
        kind=kind,
        parent=int(model.parents[j]),
        R=None if np.array_equal(R, np.eye(3)) else R,
        p=p if p.any() else None,
        axis=axis,
        K=K,
        K2=K @ K,
        aligned=int(np.argmax(axis)) if np.array_equal(np.sort(axis), [0.0, 0.0, 1.0]) else -1,
        q=slice(joint.idx_q, joint.idx_q + joint.nq),
        v=slice(joint.idx_v, joint.idx_v + joint.nv),
        model=joint,
    )


def _advance(joint: _Joint, q: Array, R: list[Array], p: list[Array], S: Array) -> None:
    """Append the pose of one joint and fill its columns of S."""
    Rp, pp = R[joint.parent], p[joint.parent]
    Rj = Rp if joint.R is None else np.matmul(Rp, joint.R)
    pj = pp if joint.p is None else pp + np.matmul(Rp, joint.p)
    k = joint.v.start
    if joint.kind is _Kind.PRISMATIC:
        axis = np.matmul(Rj, joint.axis)
        S[:, :3, k] = axis
        R.append(Rj)
        p.append(pj + q[:, joint.q] * axis)
    elif joint.kind is _Kind.OTHER:
        _advance_other(joint, q, Rj, pj, R, p, S)
    else:
        if joint.kind is _Kind.REVOLUTE:
            angle = q[:, joint.q.start]
            c, s = np.cos(angle), np.sin(angle)
        else:
            c, s = q[:, joint.q.start], q[:, joint.q.start + 1]
        Rw, axis = _turned(joint, Rj, c, s)
        R.append(Rw)
        p.append(pj)
        S[:, 3:, k] = axis
        S[:, :3, k] = cross(pj, axis)


def _turned(joint: _Joint, R: Array, c: Array, s: Array) -> tuple[Array, Array]:
    """Return R turned about the joint axis (n, 3, 3) and the axis in the world (n, 3)."""
    if joint.aligned < 0:
        turn = np.eye(3) + s[:, None, None] * joint.K + (1.0 - c)[:, None, None] * joint.K2
        return np.matmul(R, turn), np.matmul(R, joint.axis)
    i = joint.aligned
    j, k = (i + 1) % 3, (i + 2) % 3
    out = np.empty((c.size, 3, 3))
    c, s = c[:, None], s[:, None]
    out[:, :, i] = R[:, :, i]
    out[:, :, j] = c * R[:, :, j] + s * R[:, :, k]
    out[:, :, k] = c * R[:, :, k] - s * R[:, :, j]
    return out, out[:, :, i]


def _advance_other(joint: _Joint, q: Array, Rj: Array, pj: Array, R: list[Array], p: list[Array], S: Array) -> None:
    """The same for any other joint, through Pinocchio's joint model."""
    n = q.shape[0]
    data = joint.model.createData()
    Rl, pl, Sl = np.empty((n, 3, 3)), np.empty((n, 3)), np.empty((n, 6, joint.model.nv))
    for i in range(n):
        joint.model.calc(data, np.ascontiguousarray(q[i]))
        Rl[i], pl[i] = data.M.rotation, data.M.translation
        Sl[i] = np.array(data.S).reshape(6, -1)
    Rw, pw = np.matmul(Rj, Rl), pj + np.matmul(Rj, pl[..., None])[..., 0]
    R.append(Rw)
    p.append(pw)
    angular = np.matmul(Rw, Sl[:, 3:])
    S[:, 3:, joint.v] = angular
    S[:, :3, joint.v] = np.matmul(Rw, Sl[:, :3]) + cross(pw[:, None, :], np.swapaxes(angular, 1, 2)).swapaxes(1, 2)


def _own_bias(joint: _Joint, q: Array, v: Array, R: Array, p: Array) -> Array:
    """Bias that a joint whose subspace moves in its own frame adds, world axes at the world origin (n, 6)."""
    data = joint.model.createData()
    c = np.empty((q.shape[0], 6))
    for i in range(q.shape[0]):
        joint.model.calc(data, np.ascontiguousarray(q[i]), np.ascontiguousarray(v[i]))
        c[i] = data.c.vector if hasattr(data.c, "vector") else np.asarray(data.c)
    angular = np.matmul(R, c[:, 3:, None])[..., 0]
    return np.concatenate([np.matmul(R, c[:, :3, None])[..., 0] + cross(p, angular), angular], axis=1)
