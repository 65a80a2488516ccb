"""Loads: torques, what shakes the frame and what it carries, along a trajectory."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

import numpy as np

from fivebar_pin._arrays import TINY, Array, Immutable, cross, figures, finite, frozen, seal, settled
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.bodies import Bodies, BodyRates, body_rates, inner, rotor_energy, sizes, speeds, total_centre
from fivebar_pin.dynamics.elastic import SpringForces, spring_forces
from fivebar_pin.dynamics.losses import friction_torque
from fivebar_pin.dynamics.reactions import Reactions, determinate, reactions
from fivebar_pin.dynamics.wrenches import moved_to_origin
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.trajectory import Trajectory

__all__ = ["Loads"]

_QUANTITIES = ("torque", "shaking_force", "shaking_moment", "frame_force", "frame_moment")


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

    def __post_init__(self) -> None:
        for name in (*_QUANTITIES, "about", "tree_torque"):
            getattr(self, name).setflags(write=False)
        if self.external:
            seal(self.external)

    def __repr__(self) -> str:
        names = _QUANTITIES if self.loaded else _QUANTITIES[:3]
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
        return frozen(total_centre(Bodies.of(self.chain), loops.tree.poses(self.trajectory.q)))

    @cached_property
    def reactions(self) -> Reactions:
        """Closure forces and joint reactions; components that the model leaves open are nan."""
        return reactions(self.chain, self.trajectory, self.tree_torque, self.torque, self.external)

    def torque_of(self, joint: str) -> Array:
        """Return the torque of one actuated joint (n,) [N m or N].

        Raises:
            UnknownNameError: it is not one of the actuated joints.
        """
        if joint not in self.chain.actuated:
            raise UnknownNameError("actuated joint", joint, self.chain.actuated)
        return self.torque[:, self.chain.actuated.index(joint)]

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
    def multipliers(self) -> Mapping[str, Array]:
        """Forces in the rows of every closure by its name (n, rows); nan where redundant rows leave them open.

        Of a coupling sum_k c_k q_k = offset it is what is transmitted: it acts with the torque c_k lambda in joint k
        [N m or N, divided by the unit of c_k]. Of a distance it is the force with which the rod pushes
        its ends apart [N].
        """
        r = self.reactions
        values = np.where(r.determinate_rows, r.multipliers, np.nan)
        found = {c.closure.name: frozen(values[:, c.rows]) for c in loops_of(self.chain).anchored}
        return MappingProxyType(found)

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
        return frozen(self._bodies.kinetic_energy)

    @cached_property
    def rotor_energy(self) -> Array:
        """Kinetic energy of the rotors, where joints have an armature (n,) [J]."""
        return frozen(rotor_energy(self.chain, self.trajectory.v))

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
        return spring_forces(self.chain, loops, q, self.trajectory.v, loops.tree.poses(q))

    @cached_property
    def _bodies(self) -> BodyRates:
        tree, q, v = loops_of(self.chain).tree, self.trajectory.q, self.trajectory.v
        poses = tree.poses(q)
        return body_rates(tree, Bodies.of(self.chain), poses, tree.rates(q, v), self.trajectory.a)

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
        bodies = Bodies.of(chain)
        mass = bodies.mass
        force, moment, arm = sizes(moving, self.about)
        weight = mass * float(np.linalg.norm(chain.model.gravity.linear))
        tree = loops_of(chain).tree
        poses = tree.poses(path.q)
        acting = moved_to_origin(chain, poses, self.external)
        pull, turn = acting.sizes(self.about)
        linear, angular = speeds(tree, path.q, moving.centre, path.N)  # (n, nb, na)
        work = np.sum((force + weight)[..., None] * linear + moment[..., None] * angular, axis=1)
        other = np.abs(np.array(chain.model.armature) * path.a) + np.abs(friction_torque(chain, path.v))
        other = other + self._sprung.size + np.abs(acting.torques(tree, poses)).sum(axis=0)
        whole = force + inner(bodies, moving, moment)
        shaking, about = whole.sum(axis=1), np.sum(moment + arm * whole, axis=1)
        return {
            "torque": (work + np.einsum("nvk,nv->nk", np.abs(path.N), other)).max(axis=1, initial=0.0),
            "shaking_force": shaking,
            "shaking_moment": about,
            "frame_force": shaking + weight.sum() + pull,
            "frame_moment": about + arm @ weight + turn,
            "travel": np.linalg.norm(moving.centre, axis=2) @ mass / max(float(mass.sum()), TINY),
        }

    def power_residual(self) -> float:
        """Return the largest mismatch between the power of the motors and the rate of energy, relative [-].

        The rate of energy is summed body by body (Newton and Euler), the torque comes by either road. Friction,
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
        return float(np.max(mismatch) / max(float(np.max(scale)), TINY))

    def momentum_residual(self) -> float:
        """Return the largest mismatch of shaking and frame wrench with sums over the bodies, relative [-]."""
        r = self.reactions
        poses = loops_of(self.chain).tree.poses(self.trajectory.q)
        applied = r.external.sum(axis=1) + moved_to_origin(self.chain, poses, self.external).on_ground
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
        return mismatch / max(sum(float(np.abs(x[..., :3]).max(initial=0.0)) for x in sizes), TINY)
