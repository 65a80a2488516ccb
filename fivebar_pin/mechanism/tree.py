"""Open-tree kinematics over a batch of samples, in Pinocchio's terms; the engine computes it sample by sample.

Spatial quantities are linear-before-angular, in world axes at the world origin.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, cross
from fivebar_pin.chain.coordinates import q_slice, v_slice
from fivebar_pin.engine import tables as e
from fivebar_pin.mechanism.layout import Parts, layout_of
from fivebar_pin.mechanism.links import Link, bodies_of, links_of
from fivebar_pin.springs import JointSpring, Spring

__all__ = ["Poses", "Rates", "Tree", "motion_cross"]


@dataclass(frozen=True, slots=True, eq=False)
class _Joint:
    parent: int
    q: slice
    v: slice
    links: tuple[Link, ...]  # one of each of its axes

    @property
    def kind(self) -> int:
        """Kind of a joint with one axis, see `engine.tables`."""
        return self.links[0].kind if len(self.links) == 1 else -1

    @property
    def is_other(self) -> bool:
        """Whether it is more than a turn about, or a slide along, one axis."""
        return self.kind not in (e.REVOLUTE, e.TURNING, e.SLIDE, e.SCREW)


@dataclass(frozen=True, slots=True, eq=False)
class Poses:
    """World poses of the joints and their motion subspaces.

    Attributes:
        R: of every joint (njoints, n, 3, 3), index 0 is the universe.
        p: likewise (njoints, n, 3) [m].
        S: motion subspace of every velocity coordinate, world axes at the world origin (n, 6, nv).
        q: the configurations (n, nq).
    """

    R: Array
    p: Array
    S: Array
    q: Array


@dataclass(frozen=True, slots=True, eq=False)
class Rates:
    """Spatial velocity and bias acceleration (zero joint accelerations) per joint, (njoints, n, 6) each."""

    V: Array
    A: Array


@dataclass(frozen=True, slots=True, eq=False)
class _Bare:
    """A model without closures, motors and springs."""

    model: pin.Model
    actuated_index: npt.NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, dtype=np.intp))
    springs: tuple[Spring | JointSpring, ...] = ()
    na: int = 0

    @property
    def nq(self) -> int:
        return int(self.model.nq)

    @property
    def nv(self) -> int:
        return int(self.model.nv)


class Tree:
    """The open tree of one model, prepared for batches.

    Args:
        model: read, never changed; must outlive this object.
    """

    def __init__(self, model: pin.Model) -> None:
        self.nq, self.nv, self.njoints = int(model.nq), int(model.nv), int(model.njoints)
        self._model, self._threads = model, threading.local()
        links = links_of(model)
        self.joints: list[_Joint | None] = [None, *(_joint(model, j, links) for j in range(1, self.njoints))]
        self._owner = [
            joint for joint in self.joints[1:] if joint is not None for _ in range(joint.v.stop - joint.v.start)
        ]
        self.is_vector_space = all(x.kind in (e.REVOLUTE, e.SLIDE, e.SCREW) for x in links)
        self.support = np.zeros((self.njoints, self.nv), dtype=np.bool_)
        for j, joint in enumerate(self.joints):
            if joint is not None:
                self.support[j] = self.support[joint.parent]
                self.support[j, joint.v] = True
        bodies = bodies_of(links)
        self._bodies = np.array([bodies[j][0] for j in range(self.njoints)], dtype=np.int64)
        self._turns = np.stack([bodies[j][1].T for j in range(self.njoints)])
        self._I, self._W = layout_of(Parts(_Bare(model), links, (), (), (), np.ones(self.nv), 1.0))

    def _memory(self) -> Array:
        """Return the working memory of this thread."""
        if not hasattr(self._threads, "W"):
            self._threads.W = np.array(self._W)
        found: Array = self._threads.W
        return found

    def poses(self, q: Array) -> Poses:
        """Return the poses of all joints.  q (n, nq)."""
        from fivebar_pin.engine.batches import poses

        n, q = q.shape[0], e.unwritten(q)
        R, p, S = np.empty((self.njoints, n, 3, 3)), np.empty((self.njoints, n, 3)), np.empty((n, 6, self.nv))
        poses(self._I, self._memory(), self._bodies, self._turns, q, R, p, S)
        return Poses(R, p, S, q)

    def coordinate(self, q: Array, k: int) -> Array:
        """Return the coordinate that belongs to velocity index k of a one-degree-of-freedom joint.  (n, nq) -> (n,)."""
        joint = self._of_velocity(k)
        if joint.kind == e.TURNING:
            return np.asarray(np.arctan2(q[:, joint.q.start + 1], q[:, joint.q.start]))
        return np.asarray(q[:, joint.q.start])

    def set_coordinate(self, q: Array, k: int, value: Array) -> None:
        """Write the coordinate of velocity index k into q (n, nq), in place."""
        joint = self._of_velocity(k)
        if joint.kind == e.TURNING:
            q[:, joint.q.start], q[:, joint.q.start + 1] = np.cos(value), np.sin(value)
        else:
            q[:, joint.q.start] = value

    def is_angle(self, k: int) -> bool:
        """Whether velocity index k is a rotation (else a length)."""
        return self._of_velocity(k).kind != e.SLIDE

    def is_cyclic(self, k: int) -> bool:
        """Whether velocity index k turns a joint that does not count its turns."""
        return self._of_velocity(k).kind == e.TURNING

    def _of_velocity(self, k: int) -> _Joint:
        return self._owner[k]

    def rates(self, q: Array, v: Array) -> Rates:
        """Return spatial velocities and bias accelerations.  q (n, nq), v (n, nv)."""
        from fivebar_pin.engine.batches import rates

        V, A = (np.empty((self.njoints, q.shape[0], 6)) for _ in range(2))
        rates(self._I, self._memory(), self._bodies, e.unwritten(q), e.unwritten(v), V, A)
        return Rates(V, A)

    def integrate(self, q: Array, dv: Array) -> Array:
        """Return q moved along the tangent dv.  q (n, nq), dv (n, nv)."""
        if self.is_vector_space:
            return np.asarray(q + dv)
        from fivebar_pin.engine.batches import integrated

        out = np.empty(q.shape)
        integrated(self._I, self._memory(), e.unwritten(q), e.unwritten(dv), out)
        return out

    def difference(self, q0: Array, q1: Array) -> Array:
        """Return the tangent that leads from q0 to q1, (n, nv).

        Pinocchio's own loses turns of a (cos, sin) joint below 1e-8 rad: it takes them from a cosine.
        """
        if self.is_vector_space:
            return np.asarray(q1 - q0)
        q0, q1 = np.broadcast_arrays(q0, q1)
        others = any(joint is not None and joint.is_other for joint in self.joints)
        if others:
            out = np.stack([pin.difference(self._model, a, b) for a, b in zip(q0, q1, strict=True)])
        else:
            out = np.empty((q0.shape[0], self.nv))
        for joint in self.joints[1:]:
            assert joint is not None
            if joint.kind == e.TURNING:
                (c0, s0), (c1, s1) = (q[:, joint.q].T for q in (q0, q1))
                out[:, joint.v.start] = np.arctan2(c0 * s1 - s0 * c1, c0 * c1 + s0 * s1)
            elif not joint.is_other:
                out[:, joint.v] = q1[:, joint.q] - q0[:, joint.q]
        return out


def motion_cross(V: Array, W: Array) -> Array:
    """Return V × W for spatial motion vectors (..., 6), linear before angular."""
    w = V[..., 3:]
    return np.concatenate(
        [cross(w, W[..., :3]) + cross(V[..., :3], W[..., 3:]), cross(w, W[..., 3:])],
        axis=-1,
    )


def _joint(model: pin.Model, j: int, links: list[Link]) -> _Joint:
    return _Joint(int(model.parents[j]), q_slice(model, j), v_slice(model, j), tuple(x for x in links if x.joint == j))
