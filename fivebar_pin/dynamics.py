"""Constrained inverse dynamics, reactions, what shakes the frame and what it carries.

With the open tree's inverse dynamics tau_t = M a + h (Pinocchio's recursive Newton-Euler) and the complement N,

    tau = N^T tau_t                                  the closure forces do no work           [Angeles and Lee 1988]
    J^T lambda = tau_t - S^T tau                     closure forces from the passive rows
    F = -dp/dt,        M_O = -dH_O/dt                shaking force and moment: inertia alone
    F + m g + f_e,     M_O + c x m g + m_e           frame force and moment: weight and applied forces besides

Frame force and moment are all that the mechanism exerts on the frame; motors and springs are internal to it. The
wrench on the frame comes out of the same recursion when the tree hangs on a free-flying root held at rest. It runs
without gravity, so that a balanced mechanism does not shake by the digits of its weight; the weight has a run of its
own, at rest, where there is any.
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
from fivebar_pin._arrays import Array, Immutable, checked, cross, figures, finite, frozen, numeric, settled
from fivebar_pin._loops import loops_of
from fivebar_pin._once import once_per_chain
from fivebar_pin._reactions import Reactions, determinate, reactions
from fivebar_pin._springs import JointSpring, Spring, SpringForces, checked_springs, spring_forces
from fivebar_pin.chain import ClosedChain, find_frame
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.trajectory import Trajectory

__all__ = ["Loads", "inverse_dynamics"]

_SAMPLES_PER_THREAD = 4096


@dataclass(frozen=True, eq=False, repr=False)
class Loads(Immutable):
    """Forces and torques along a trajectory. World axes; n samples.

    Attributes:
        torque: of the actuated joints, columns in the order of `chain.actuated` (n, na) [N m or N].
        shaking_force: -dp/dt, the force of the bodies' inertia on the frame (n, 3) [N].
        shaking_moment: -dH/dt about `about`, a fixed point (n, 3) [N m].
        frame_force: all that the mechanism exerts on the frame: the shaking force, weight, applied forces (n, 3) [N].
        frame_moment: the same about `about`, motor reactions included (n, 3) [N m].
        about: the point the moments refer to (3,) [m].
        chain, trajectory: what the loads belong to.
        external: wrenches (n, 6) by frame name, as given to `inverse_dynamics`.
        springs: as given to `inverse_dynamics`.

    The armature of a joint is inertia that its motor feels: it counts in torque and `rotor_energy` and carries no
    momentum. A geared rotor that shall count in the shaking moment is modelled as a body.
    """

    torque: Array
    shaking_force: Array
    shaking_moment: Array
    frame_force: Array
    frame_moment: Array
    about: Array
    chain: ClosedChain
    trajectory: Trajectory
    tree_torque: Array = field(repr=False)
    external: Mapping[str, Array] = field(default_factory=dict, repr=False)
    springs: tuple[Spring | JointSpring, ...] = field(default=(), repr=False)

    def __repr__(self) -> str:
        names = ("torque", "shaking_force", "shaking_moment", *(("frame_force", "frame_moment") if self.loaded else ()))
        words = ", ".join(f"{x} {figures(self.peak(x))}" for x in names)
        return f"Loads({len(self.trajectory)} samples; peaks: {words})"

    @property
    def loaded(self) -> bool:
        """Whether weight or applied forces act; without them the frame carries the shaking force and moment alone."""
        heavy = self.chain.mass > 0.0 and np.any(self.chain.model.gravity.linear)
        return bool(heavy or any(w.any() for w in self.external.values()))

    @cached_property
    @finite()
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
    def bearing_force(self) -> Array:
        """Force in every joint, then in every closure (n, nb + closures, 3) [N], as far as it is determinate.

        Of a force that redundant closures share it is the part across the directions in which they can strain each
        other: in a planar mechanism the force in the plane, whichever way this lies in the world.
        """
        r = self.reactions
        return frozen(np.matmul(determinate(r.free), r.forces[..., None])[..., 0])

    @cached_property
    def kinetic_energy(self) -> Array:
        """Kinetic energy of the bodies (n,) [J]; that of the rotors is `rotor_energy`."""
        return frozen(0.5 * np.sum(self._bodies.twist * self._bodies.momentum, axis=(1, 2)))

    @cached_property
    def rotor_energy(self) -> Array:
        """Kinetic energy of the rotors, where joints have an armature (n,) [J]."""
        return frozen(0.5 * np.sum(np.array(self.chain.model.armature) * self.trajectory.v**2, axis=1))

    @cached_property
    @finite()
    def potential_energy(self) -> Array:
        """Potential energy of gravity, zero at the world origin (n,) [J]."""
        gravity = np.array(self.chain.model.gravity.linear)
        return frozen(-self.chain.mass * self.com @ gravity)

    @cached_property
    @finite()
    def elastic_energy(self) -> Array:
        """Energy stored in the springs (n,) [J]."""
        return frozen(self._sprung.energy)

    @cached_property
    def _sprung(self) -> SpringForces:
        loops, q = loops_of(self.chain), self.trajectory.q
        return spring_forces(self.chain, loops, self.springs, q, self.trajectory.v, loops.tree.poses(q))

    @cached_property
    def _bodies(self) -> _bodies.BodyRates:
        tree, q, v = loops_of(self.chain).tree, self.trajectory.q, self.trajectory.v
        poses = tree.poses(q)
        return _bodies.body_rates(
            tree, _bodies.Bodies.of(self.chain), poses, tree.rates(q, v, poses), self.trajectory.a
        )

    def peak(self, quantity: str) -> float:
        """Return the largest size of a quantity over the samples, 0 where it is only round-off [its unit].

        Args:
            quantity: "torque" (of any motor), "shaking_force", "shaking_moment", "frame_force", "frame_moment" or
                "travel" (distance of the mass centre from where it starts).

        Raises:
            UnknownNameError: another quantity.
        """
        scale = self.scale(quantity)
        values = self.com - self.com[0] if quantity == "travel" else getattr(self, quantity)
        sizes = np.abs(values) if quantity == "torque" else np.linalg.norm(values, axis=1)
        return settled(float(sizes.max(initial=0.0)), scale)

    def scale(self, quantity: str) -> float:
        """Return the sum of the sizes of all that adds up to a quantity, the largest over the samples [its unit].

        A value far below it is the round-off of this sum, not a result.

        Args:
            quantity: as for `peak`.

        Raises:
            UnknownNameError: another quantity.
        """
        if quantity not in self._sizes:
            raise UnknownNameError("quantity", quantity, self._sizes)
        return float(self._sizes[quantity].max(initial=0.0))

    @cached_property
    def _sizes(self) -> dict[str, Array]:
        """Sums of the sizes of what adds up to each quantity (n,)."""
        chain, path, moving = self.chain, self.trajectory, self._bodies
        mass = _bodies.Bodies.of(chain).mass
        force, moment, arm = _bodies.sizes(moving, self.about)
        weight = mass * float(np.linalg.norm(chain.model.gravity.linear))
        pull, turn, generalised = _applied_sizes(chain, path, self.external, self.about)
        linear, angular = _bodies.speeds(loops_of(chain).tree, path.q, moving.centre, path.N)  # (n, nb, na)
        work = np.sum((force + weight)[..., None] * linear + moment[..., None] * angular, axis=1)
        other = np.abs(np.array(chain.model.armature) * path.a) + np.abs(friction_torque(chain, path.v))
        other = other + np.abs(self._sprung.force) + generalised
        shaking, about = force.sum(axis=1), np.sum(moment + arm * force, axis=1)
        return {
            "torque": (work + np.einsum("nvk,nv->nk", np.abs(path.N), other)).max(axis=1, initial=0.0),
            "shaking_force": shaking,
            "shaking_moment": about,
            "frame_force": shaking + weight.sum() + pull,
            "frame_moment": about + arm @ weight + turn,
            "travel": np.linalg.norm(moving.centre, axis=2) @ mass / max(float(mass.sum()), 1e-300),
        }

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
        """Return the largest mismatch of shaking and frame wrench with sums over the bodies, relative [-]."""
        r = self.reactions
        applied = r.external.sum(axis=1) + _on_ground(self.chain, self.external, len(self.trajectory))
        shaking = -np.sum(r.bodies.rate, axis=1)
        mismatch = 0.0
        for wrench, force, moment in (
            (shaking, self.shaking_force, self.shaking_moment),
            (shaking + np.sum(r.gravity, axis=1) + applied, self.frame_force, self.frame_moment),
        ):
            about = wrench[:, 3:] - cross(self.about, wrench[:, :3])
            off = float(np.abs(wrench[:, :3] - force).max()), float(np.abs(about - moment).max()) / self.chain.length
            mismatch = max(mismatch, *off)
        sizes = (r.bodies.rate, r.gravity, applied)
        return mismatch / max(sum(float(np.abs(x[..., :3]).max(initial=0.0)) for x in sizes), 1e-300)


@finite(open=("N", "torque"))
def inverse_dynamics(
    chain: ClosedChain,
    trajectory: Trajectory,
    *,
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
    external: Mapping[str, npt.ArrayLike] | None = None,
    springs: Iterable[Spring | JointSpring] = (),
) -> Loads:
    """Compute the actuated torques, what shakes the frame and what it carries along a trajectory.

    Gravity, armature, viscous damping and dry friction are taken from the chain's model. Springs belong to the
    mechanism: what one that is anchored in the ground pulls there is part of the force on the frame, which is
    -dp/dt + m g with springs as without; they change the torques and the reactions.

    Args:
        chain: the mechanism.
        trajectory: consistent motion, from `drive` or `simulate`.
        about: point (3,) that shaking and frame moment refer to [m], world.
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
    wrench, tree_torque = _hanging(chain).inertia(trajectory.q, trajectory.v, trajectory.a)
    shaking, carried = -wrench, np.zeros_like(wrench)
    gravity = np.array(chain.model.gravity.linear)
    if gravity.any():
        weight, weight_torque = _hanging(chain).weight(trajectory.q, gravity)
        carried -= weight
        tree_torque += weight_torque
    tree_torque += friction_torque(chain, trajectory.v)
    applied, attached = _external(chain, external, n), checked_springs(chain, springs)
    if attached:
        loops = loops_of(chain)
        poses = loops.tree.poses(trajectory.q)
        tree_torque -= spring_forces(chain, loops, attached, trajectory.q, trajectory.v, poses).force
    if applied:
        generalised, total = _applied(chain, trajectory, applied)
        tree_torque -= generalised
        carried += total
    torque = np.matmul(np.swapaxes(trajectory.N, 1, 2), tree_torque[..., None])[..., 0]
    frame = shaking + carried
    return Loads(
        torque=frozen(torque),
        shaking_force=frozen(shaking[:, :3]),
        shaking_moment=frozen(_about(point, shaking)),
        frame_force=frozen(frame[:, :3]),
        frame_moment=frozen(_about(point, frame)),
        about=point,
        chain=chain,
        trajectory=trajectory,
        tree_torque=frozen(tree_torque),
        external=applied,
        springs=attached,
    )


def _about(point: Array, wrench: Array) -> Array:
    """Return the moments (n, 3) about a point of wrenches (n, 6) at the world origin."""
    return np.asarray(wrench[:, 3:] - cross(point, wrench[:, :3]))


def friction_torque(chain: ClosedChain, v: Array) -> Array:
    """Return the torque that viscous damping and dry friction take from the joints (n, nv): b v + f sign(v)."""
    b, f = np.array(chain.model.damping), np.array(chain.model.upperDryFrictionLimit)
    return np.asarray(b * v + f * np.sign(v))


class _Hanging:
    """The tree on a free-flying root held at rest, ready for Pinocchio's batched recursion."""

    def __init__(self, chain: ClosedChain) -> None:
        source, model = chain.model, pin.Model()
        model.gravity = pin.Motion.Zero()
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
        self._nv = int(model.nv)

    def inertia(self, q: Array, v: Array, a: Array) -> tuple[Array, Array]:
        """Return the wrench of the frame on the mechanism at the world origin (n, 6) and the torques (n, nv)."""
        V, A = (np.zeros((len(q), x.shape[1] + 6)) for x in (v, a))
        V[:, 6:], A[:, 6:] = v, a
        return self._evaluate(q, V, A)

    def weight(self, q: Array, gravity: Array) -> tuple[Array, Array]:
        """Return the same of the weight alone: at rest, on a root that accelerates against gravity (3,)."""
        V = np.zeros((len(q), self._nv))
        A = np.zeros_like(V)
        A[:, :3] = -gravity
        return self._evaluate(q, V, A)

    def _evaluate(self, q: Array, V: Array, A: Array) -> tuple[Array, Array]:
        n = q.shape[0]
        Q = np.zeros((n, q.shape[1] + 7))
        Q[:, 6], Q[:, 7:] = 1.0, q
        out = np.zeros((self._nv, n), order="F")
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


def _applied_sizes(
    chain: ClosedChain, trajectory: Trajectory, applied: Mapping[str, Array], about: Array
) -> tuple[Array, Array, Array]:
    """Return the sums of the sizes of the external forces and moments (n,), and of their joint torques (n, nv)."""
    force, moment, generalised = np.zeros(len(trajectory)), np.zeros(len(trajectory)), np.zeros_like(trajectory.v)
    for name, wrench in applied.items():
        torque, at_origin = _applied(chain, trajectory, {name: wrench})
        generalised += np.abs(torque)
        force += np.linalg.norm(wrench[:, :3], axis=1)
        moment += np.linalg.norm(wrench[:, 3:], axis=1) + np.linalg.norm(
            _about(about, at_origin) - wrench[:, 3:], axis=1
        )
    return force, moment, generalised


def _on_ground(chain: ClosedChain, applied: Mapping[str, Array], n: int) -> Array:
    """Return the sum (n, 6) at the world origin of what is applied to the ground itself."""
    total = np.zeros((n, 6))
    for name, wrench in applied.items():
        frame = find_frame(chain.model, name)
        if frame.parentJoint == 0:
            total[:, :3] += wrench[:, :3]
            total[:, 3:] += wrench[:, 3:] + cross(np.array(frame.placement.translation), wrench[:, :3])
    return total
