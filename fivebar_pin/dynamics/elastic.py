"""Springs and dampers over a batch: their generalised forces, their energy and their wrenches on the bodies.

between frames    F = k (|d| - l) + c d|d|/dt   along d = p_2 - p_1, pulling the frames together when positive
on a joint        tau = -k (q - rest) - b dq/dt
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fivebar_pin._arrays import Array, Immutable, cross
from fivebar_pin.chain import ClosedChain, find_frame
from fivebar_pin.errors import SolverError
from fivebar_pin.mechanism.loops import Loops
from fivebar_pin.mechanism.tree import Poses
from fivebar_pin.springs import JointSpring, Spring

__all__ = ["SpringForces", "body_wrenches", "frame_points", "resting_force", "spring_forces", "undirected"]

_TOGETHER = 1e-12  # distance of a spring's ends that is round-off: they lie on one point [chain lengths]


@dataclass(frozen=True, slots=True, eq=False)
class SpringForces(Immutable):
    """What springs do at a batch of states.

    Attributes:
        force: generalised force on the tree (n, nv) [N m or N].
        energy: stored (n,) [J].
        dissipation: power the dampers take (n,) [W].
        size: sum of the sizes of all springs' forces on the tree (n, nv) [N m or N].
    """

    force: Array
    energy: Array
    dissipation: Array
    size: Array

    def __add__(self, other: SpringForces) -> SpringForces:
        return SpringForces(
            self.force + other.force,
            self.energy + other.energy,
            self.dissipation + other.dissipation,
            self.size + other.size,
        )


def spring_forces(chain: ClosedChain, loops: Loops, q: Array, v: Array, poses: Poses) -> SpringForces:
    """Evaluate all springs of the chain at states q (n, nq), v (n, nv)."""
    return _sum(chain, chain.springs, loops, q, v, poses)


def resting_force(chain: ClosedChain, loops: Loops, q: Array, poses: Poses) -> Array:
    """Return the generalised force (n, nv) of the chain's springs at rest in q (n, nq), where dampers play no part."""
    undamped = tuple(replace(spring, damping=0.0) for spring in chain.springs)
    return _sum(chain, undamped, loops, q, np.zeros((q.shape[0], chain.nv)), poses).force


def _sum(
    chain: ClosedChain, springs: tuple[Spring | JointSpring, ...], loops: Loops, q: Array, v: Array, poses: Poses
) -> SpringForces:
    none = np.zeros(v.shape[0])
    total = SpringForces(np.zeros_like(v), none, none, np.zeros_like(v))
    for spring in springs:
        if isinstance(spring, JointSpring):
            total = total + _on_joint(chain, loops, spring, q, v)
        else:
            total = total + _between(chain, loops, spring, v, poses)
    return total


def body_wrenches(chain: ClosedChain, loops: Loops, v: Array, poses: Poses) -> Array:
    """Return the wrench of the chain's springs between frames on every body, at the world origin (n, nb, 6).

    Springs on joints act through the joint and are not among them.
    """
    out = np.zeros((v.shape[0], chain.model.njoints - 1, 6))
    for spring in chain.springs:
        if isinstance(spring, JointSpring):
            continue
        pull = _pull(chain, loops, spring, v, poses)
        force = pull.size[:, None] * pull.u
        for frame, point, sign in zip((spring.frame1, spring.frame2), pull.points, (1.0, -1.0), strict=True):
            j = int(find_frame(chain.model, frame).parentJoint)
            if j:
                out[:, j - 1] += sign * np.concatenate([force, cross(point, force)], axis=1)
    return out


def undirected(spring: str) -> SolverError:
    """Make the error for a spring whose ends meet."""
    return SolverError(
        f"spring {spring} has its ends on one point: the direction of its force is not "
        "defined there. Give it other frames, or a free length of zero and no damping."
    )


def frame_points(chain: ClosedChain, loops: Loops, frame: str, poses: Poses) -> tuple[Array, Array]:
    """Return a frame's world origin (n, 3) and the Jacobian of its twist at the world origin (n, 6, nv)."""
    found = find_frame(chain.model, frame)
    j = int(found.parentJoint)
    point = poses.p[j] + np.matmul(poses.R[j], np.array(found.placement.translation))
    return point, poses.S * loops.tree.support[j]


def _on_joint(chain: ClosedChain, loops: Loops, spring: JointSpring, q: Array, v: Array) -> SpringForces:
    joint = chain.model.joints[chain.model.getJointId(spring.joint)]
    k = int(joint.idx_v)
    deflection = loops.tree.coordinate(q, k) - spring.rest
    if joint.nq == 2:
        deflection = np.remainder(deflection + np.pi, 2.0 * np.pi) - np.pi
    force = np.zeros_like(v)
    force[:, k] = -spring.stiffness * deflection - spring.damping * v[:, k]
    energy, dissipation = 0.5 * spring.stiffness * deflection**2, spring.damping * v[:, k] ** 2
    return SpringForces(force, energy, dissipation, np.abs(force))


@dataclass(frozen=True, slots=True, eq=False)
class _Pull:
    """What a spring between frames does: the forces at its ends are `size` u and -`size` u."""

    points: tuple[Array, Array]  # (n, 3) each
    u: Array  # unit, from frame 1 to frame 2 (n, 3)
    row: Array  # rate of the length = row v (n, nv)
    stretch: Array  # (n,)
    rate: Array
    size: Array


def _pull(chain: ClosedChain, loops: Loops, spring: Spring, v: Array, poses: Poses) -> _Pull:
    (p1, J1), (p2, J2) = (frame_points(chain, loops, f, poses) for f in (spring.frame1, spring.frame2))
    d = p2 - p1
    size = np.linalg.norm(d, axis=1)
    stretch = size - spring.length
    free = spring.length == 0.0 and spring.damping == 0.0  # then the force is k d, without a direction to define
    if not free and np.any(size < _TOGETHER * chain.length):
        raise undirected(spring.name)
    u = np.divide(d, size[:, None], out=np.zeros_like(d), where=size[:, None] > 0.0)
    # rate of |d|, as a row over v: u . (v_2 - v_1)
    row = np.einsum("ni,nik->nk", u, _point(p2, J2) - _point(p1, J1))
    rate = np.einsum("nk,nk->n", row, v)
    return _Pull((p1, p2), u, row, stretch, rate, spring.stiffness * stretch + spring.damping * rate)


def _between(chain: ClosedChain, loops: Loops, spring: Spring, v: Array, poses: Poses) -> SpringForces:
    pull = _pull(chain, loops, spring, v, poses)
    energy, dissipation = 0.5 * spring.stiffness * pull.stretch**2, spring.damping * pull.rate**2
    force = -pull.size[:, None] * pull.row
    return SpringForces(force, energy, dissipation, np.abs(force))


def _point(p: Array, J: Array) -> Array:
    """Return the Jacobian of the velocity of a point (n, 3, nv)."""
    return np.asarray(J[:, :3] - np.swapaxes(cross(p[:, None, :], np.swapaxes(J[:, 3:], 1, 2)), 1, 2))
