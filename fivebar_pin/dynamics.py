"""Constrained inverse dynamics, reactions, and the force and moment that shake the frame.

With the open tree's inverse dynamics tau_t = M a + h (Pinocchio's recursive Newton-Euler) and the complement N,

    tau = N^T tau_t                                  the closure forces do no work           [Angeles and Lee 1988]
    J^T lambda = tau_t - S^T tau                     closure forces from the passive rows
    F = -dp/dt + m g,  M_O = -dL_O/dt + c x m g      what the mechanism exerts on the frame, motors included

The wrench on the frame comes out of the same recursion when the tree hangs on a free-flying root held at rest.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin import _bodies
from fivebar_pin._arrays import Array, checked, cross, frozen, numeric
from fivebar_pin._loops import loops_of
from fivebar_pin._once import once_per_chain
from fivebar_pin._reactions import Reactions, reactions
from fivebar_pin._springs import JointSpring, Spring, SpringForces, checked_springs, spring_forces
from fivebar_pin.chain import ClosedChain, find_frame
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.trajectory import Trajectory

__all__ = ["Loads", "inverse_dynamics"]

_SAMPLES_PER_THREAD = 4096


@dataclass(frozen=True, eq=False, repr=False)
class Loads:
    """Forces and torques along a trajectory. World axes; n samples.

    Attributes:
        torque: of the actuated joints, columns in the order of `chain.actuated` (n, na) [N m or N].
        shaking_force: exerted by the mechanism on the frame (n, 3) [N].
        shaking_moment: the same about `about`, motor reactions included (n, 3) [N m].
        about: the point the moment refers to (3,) [m].
        chain, trajectory: what the loads belong to.
        external: wrenches (n, 6) by frame name, as given to `inverse_dynamics`.
        springs: as given to `inverse_dynamics`.
    """

    torque: Array
    shaking_force: Array
    shaking_moment: Array
    about: Array
    chain: ClosedChain
    trajectory: Trajectory
    tree_torque: Array = field(repr=False)
    external: Mapping[str, Array] = field(default_factory=dict, repr=False)
    springs: tuple[Spring | JointSpring, ...] = field(default=(), repr=False)

    def __repr__(self) -> str:
        peak = {
            x: float(np.abs(getattr(self, x)).max(initial=0.0)) for x in ("torque", "shaking_force", "shaking_moment")
        }
        return (
            f"Loads({len(self.trajectory)} samples; peaks: " + ", ".join(f"{k} {v:.4g}" for k, v in peak.items()) + ")"
        )

    @cached_property
    def com(self) -> Array:
        """Centre of mass of all moving bodies (n, 3) [m]."""
        loops = loops_of(self.chain)
        return frozen(_bodies.total_centre(_bodies.Bodies.of(self.chain), loops.tree.poses(self.trajectory.q)))

    @cached_property
    def reactions(self) -> Reactions:
        """Closure forces and joint reactions; components that the model leaves open are nan."""
        return reactions(self.chain, self.trajectory, self.tree_torque, self.torque, self.external, self.springs)

    @property
    def joint_reactions(self) -> Array:
        """Wrench by the parent on the body of every joint, about the joint origin (n, njoints - 1, 6) [N, N m].

        Motors, losses and springs on the joint are part of it; springs between frames are not.
        """
        return self.reactions.joint

    @property
    def joint_reactions_local(self) -> Array:
        """The same in the axes of the joint: in a tilted plane fewer components are open (n, njoints - 1, 6)."""
        return self.reactions.joint_local

    @property
    def closure_reactions(self) -> Array:
        """Wrench by body 1 on body 2 of every closure, about the closure point (n, closures, 6) [N, N m]."""
        return self.reactions.closure

    @property
    def closure_reactions_local(self) -> Array:
        """The same in the axes of the closure's frame 1 (n, closures, 6) [N, N m]."""
        return self.reactions.closure_local

    @cached_property
    def kinetic_energy(self) -> Array:
        """Kinetic energy of the bodies, without that of the rotors (armature) (n,) [J]."""
        rates = self.reactions.bodies
        return frozen(0.5 * np.sum(rates.twist * rates.momentum, axis=(1, 2)))

    @cached_property
    def potential_energy(self) -> Array:
        """Potential energy of gravity, zero at the world origin (n,) [J]."""
        gravity = np.array(self.chain.model.gravity.linear)
        return frozen(-self.chain.mass * self.com @ gravity)

    @cached_property
    def elastic_energy(self) -> Array:
        """Energy stored in the springs (n,) [J]."""
        return frozen(self._sprung.energy)

    @cached_property
    def _sprung(self) -> SpringForces:
        loops, q = loops_of(self.chain), self.trajectory.q
        return spring_forces(self.chain, loops, self.springs, q, self.trajectory.v, loops.tree.poses(q))

    def power_residual(self) -> float:
        """Return the largest mismatch between the power of the motors and the rate of energy, relative [-].

        The rate of energy is summed body by body (Newton and Euler), the torque comes from Pinocchio. Friction,
        rotors (armature), springs and external forces are accounted for.
        """
        r = self.reactions
        va = self.trajectory.v[:, self.chain.actuated_index]
        supplied = self.torque * va
        lost = (friction_torque(self.chain, self.trajectory.v) - self._sprung.force) * self.trajectory.v
        rate = np.sum((r.bodies.rate - r.gravity - r.external) * r.bodies.twist, axis=2)
        lost = lost + np.array(self.chain.model.armature) * self.trajectory.a * self.trajectory.v
        mismatch = np.abs(supplied.sum(axis=1) - lost.sum(axis=1) - rate.sum(axis=1))
        scale = np.abs(supplied).sum(axis=1) + np.abs(rate).sum(axis=1)
        return float(np.max(mismatch) / max(float(np.max(scale)), 1e-300))

    def momentum_residual(self) -> float:
        """Return the largest mismatch of the shaking wrench with momentum summed body by body, relative [-]."""
        r = self.reactions
        wrench = -np.sum(r.bodies.rate - r.gravity - r.external, axis=1)
        moment = wrench[:, 3:] - cross(self.about, wrench[:, :3])
        mismatch = max(
            float(np.abs(wrench[:, :3] - self.shaking_force).max()),
            float(np.abs(moment - self.shaking_moment).max()) / self.chain.length,
        )
        scale = float(np.abs(r.bodies.rate[..., :3]).max() + np.abs(r.gravity[..., :3]).max())
        return mismatch / max(scale, 1e-300)


def inverse_dynamics(
    chain: ClosedChain,
    trajectory: Trajectory,
    *,
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
    external: Mapping[str, npt.ArrayLike] | None = None,
    springs: Iterable[Spring | JointSpring] = (),
) -> Loads:
    """Compute the actuated torques and the force and moment on the frame along a trajectory.

    Gravity, armature, viscous damping and dry friction are taken from the chain's model. Springs belong to the
    mechanism: what one that is anchored in the ground pulls there is part of the force on the frame, which is
    -dp/dt + m g with springs as without; they change the torques and the reactions.

    Args:
        chain: the mechanism.
        trajectory: consistent motion, from `drive` or `simulate`.
        about: point (3,) the shaking moment refers to [m], world.
        external: forces applied from outside: frame name -> wrench (n, 6) or (6,), force [N] and moment [N m] in
            world axes at the frame's origin.
        springs: springs and dampers, as `simulate` takes them.

    Returns:
        The loads; reactions, energies and centre of mass are computed when asked for.

    Raises:
        InvalidInputError: a trajectory of another mechanism, wrong shapes.
        UnknownNameError: an external force or a spring on a frame or joint that does not exist.
        SolverError: a spring whose ends meet has a force of no direction.
    """
    n = len(trajectory)
    trajectory.require_of(chain)
    point = checked("about", about, (3,))
    wrench, tree_torque = _hanging(chain).evaluate(trajectory.q, trajectory.v, trajectory.a)
    tree_torque += friction_torque(chain, trajectory.v)
    applied, attached = _external(chain, external, n), checked_springs(chain, springs)
    if attached:
        loops = loops_of(chain)
        poses = loops.tree.poses(trajectory.q)
        tree_torque -= spring_forces(chain, loops, attached, trajectory.q, trajectory.v, poses).force
    force, moment = -wrench[:, :3], -wrench[:, 3:]
    if applied:
        generalised, total = _applied(chain, trajectory, applied)
        tree_torque -= generalised
        force, moment = force + total[:, :3], moment + total[:, 3:]
    torque = np.matmul(np.swapaxes(trajectory.N, 1, 2), tree_torque[..., None])[..., 0]
    return Loads(
        torque=frozen(torque),
        shaking_force=frozen(force),
        shaking_moment=frozen(moment - cross(point, force)),
        about=point,
        chain=chain,
        trajectory=trajectory,
        tree_torque=frozen(tree_torque),
        external=applied,
        springs=attached,
    )


def friction_torque(chain: ClosedChain, v: Array) -> Array:
    """Return the torque that viscous damping and dry friction take from the joints (n, nv): b v + f sign(v)."""
    b, f = np.array(chain.model.damping), np.array(chain.model.upperDryFrictionLimit)
    return np.asarray(b * v + f * np.sign(v))


class _Hanging:
    """The tree on a free-flying root held at rest, ready for Pinocchio's batched recursion."""

    def __init__(self, chain: ClosedChain) -> None:
        source, model = chain.model, pin.Model()
        model.gravity = source.gravity
        root = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "frame")
        ids = [root]
        for j in range(1, source.njoints):
            ids.append(
                model.addJoint(ids[source.parents[j]], source.joints[j], source.jointPlacements[j], source.names[j])
            )
            model.appendBodyToJoint(ids[j], source.inertias[j], pin.SE3.Identity())
        model.armature = np.concatenate([np.zeros(6), source.armature])
        self._threads = max(
            1, len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        )
        self._pool = pin.ModelPool(model, self._threads)

    def evaluate(self, q: Array, v: Array, a: Array) -> tuple[Array, Array]:
        """Return the wrench of the frame on the mechanism at the world origin (n, 6) and the torques (n, nv)."""
        n = q.shape[0]
        Q = np.zeros((n, q.shape[1] + 7))
        Q[:, 6], Q[:, 7:] = 1.0, q
        V, A = (np.zeros((n, x.shape[1] + 6)) for x in (v, a))
        V[:, 6:], A[:, 6:] = v, a
        out = np.zeros((v.shape[1] + 6, n), order="F")
        threads = min(self._threads, 1 + n // _SAMPLES_PER_THREAD)
        pin.rneaInParallel(threads, self._pool, Q.T, V.T, A.T, out)
        return out[:6].T, np.array(out[6:].T)


@once_per_chain
def _hanging(chain: ClosedChain) -> _Hanging:
    return _Hanging(chain)


def _external(chain: ClosedChain, external: Mapping[str, npt.ArrayLike] | None, n: int) -> dict[str, Array]:
    names = [f.name for f in chain.model.frames]
    out = {}
    for name, wrench in (external or {}).items():
        if name not in names:
            raise UnknownNameError("frame of an external force", name, names)
        label = f"external[{name!r}]"
        w = numeric(label, wrench)
        out[name] = np.broadcast_to(checked(label, w, (6,)), (n, 6)) if w.ndim == 1 else checked(label, w, (n, 6))
    return out


def _applied(chain: ClosedChain, trajectory: Trajectory, applied: Mapping[str, Array]) -> tuple[Array, Array]:
    """Return the joint torques (n, nv) of the external forces and their sum at the world origin (n, 6)."""
    loops = loops_of(chain)
    poses = loops.tree.poses(trajectory.q)
    generalised, total = np.zeros_like(trajectory.v), np.zeros((len(trajectory), 6))
    for name, wrench in applied.items():
        frame = find_frame(chain.model, name)
        j = int(frame.parentJoint)
        point = poses.p[j] + np.matmul(poses.R[j], np.array(frame.placement.translation))
        at_origin = np.concatenate([wrench[:, :3], wrench[:, 3:] + cross(point, wrench[:, :3])], axis=1)
        total += at_origin
        generalised += np.einsum("nik,ni->nk", poses.S, at_origin) * loops.tree.support[j]
    return generalised, total
