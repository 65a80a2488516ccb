"""Where the energy of a motion goes: stored, supplied by motors and from outside, lost in dampers and friction."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import TINY, Array, Immutable, checked, finite, frozen, numeric
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.bodies import Bodies, body_rates, gravity_wrenches, rotor_energy
from fivebar_pin.dynamics.equations import EquationsOfMotion
from fivebar_pin.dynamics.wrenches import checked_wrenches
from fivebar_pin.trajectory import Trajectory

__all__ = ["EnergyBalance", "energy_balance"]


@dataclass(frozen=True, slots=True, eq=False)
class EnergyBalance(Immutable):
    """Energies [J] and powers [W] along a trajectory, n samples.

    Attributes:
        kinetic: of the bodies (n,).
        rotor: kinetic, of the rotors where joints have an armature (n,).
        potential: of gravity, zero at the world origin (n,).
        elastic: stored in springs (n,).
        kinetic_rate, rotor_rate: of the two, from the accelerations (n,).
        stored_rate: of potential and elastic energy together (n,).
        supplied: by the motors and the forces from outside (n,).
        dissipated: by joint damping, dry friction and the springs' dampers (n,).
        exchanged: sizes of all powers together, body by body (n,); the scale of the residual.
    """

    kinetic: Array
    rotor: Array
    potential: Array
    elastic: Array
    kinetic_rate: Array
    rotor_rate: Array
    stored_rate: Array
    supplied: Array
    dissipated: Array
    exchanged: Array

    @property
    def total(self) -> Array:
        """Kinetic energy of bodies and rotors, potential and elastic energy together (n,) [J]."""
        return np.asarray(self.kinetic + self.rotor + self.potential + self.elastic)

    def drift(self) -> float:
        """Return the largest change of the total energy since the first sample, relative to the energy in play [-].

        The energy in play is the largest kinetic energy plus the range of the stored energy. Zero in exact arithmetic
        when nothing is supplied or dissipated.
        """
        stored = self.potential + self.elastic
        scale = float((self.kinetic + self.rotor).max() + np.ptp(stored))
        return float(np.abs(self.total - self.total[0]).max()) / max(scale, TINY)

    def residual(self) -> float:
        """Return the largest mismatch of the rates: kinetic + rotor + stored = supplied - dissipated, relative [-]."""
        mismatch = np.abs(self.kinetic_rate + self.rotor_rate + self.stored_rate - self.supplied + self.dissipated)
        return float(mismatch.max() / max(float(self.exchanged.max()), TINY))


@finite()
def energy_balance(
    chain: ClosedChain,
    trajectory: Trajectory,
    *,
    torque: npt.ArrayLike | None = None,
    external: Mapping[str, npt.ArrayLike] | None = None,
) -> EnergyBalance:
    """Account for the energy along a trajectory, body by body.

    Args:
        chain: the mechanism.
        trajectory: of this chain.
        torque: of the actuated joints (na,) or (n, na), as it was applied [N m or N]; None for none.
        external: wrenches (6,) or (n, 6) by frame, as they were applied.

    Returns:
        Energies, their rate, and the powers supplied and dissipated.
    """
    system, n, v = EquationsOfMotion.of(chain), len(trajectory), trajectory.v
    given = np.zeros(chain.na) if torque is None else numeric("torque", torque)
    tau = checked(
        "torque", np.broadcast_to(given, (n, chain.na)) if given.shape == (chain.na,) else given, (n, chain.na)
    )
    point = system.manifold.at(np.asarray(trajectory.q))
    tree = system.manifold.loops.tree
    bodies = Bodies.of(chain)
    moving = body_rates(tree, bodies, point.poses, tree.rates(trajectory.q, v), trajectory.a)
    gravity = np.array(chain.model.gravity.linear)
    weight = gravity_wrenches(bodies, moving.centre, gravity)
    armature = np.array(chain.model.armature)
    sprung = system.spring_forces(point, v)
    applied = system.wrench_forces(point, checked_wrenches(chain, external, n))
    inertial = np.sum(moving.rate * moving.twist, axis=2)  # (n, nb)
    heavy = np.sum(weight * moving.twist, axis=2)
    driven = np.column_stack([tau * v[:, chain.actuated_index], applied * v])
    dissipated = np.sum(system.damping * v * v + system.friction * np.abs(v), axis=1) + sprung.dissipation
    gross = [inertial, heavy, driven, sprung.force * v, dissipated[:, None]]
    return EnergyBalance(
        kinetic=frozen(moving.kinetic_energy),
        rotor=frozen(rotor_energy(chain, v)),
        potential=frozen(-np.einsum("nbi,i,b->n", moving.centre, gravity, bodies.mass)),
        elastic=frozen(sprung.energy),
        kinetic_rate=frozen(inertial.sum(axis=1)),
        rotor_rate=frozen(np.sum(armature * v * trajectory.a, axis=1)),
        stored_rate=frozen(-heavy.sum(axis=1) - np.sum(sprung.force * v, axis=1) - sprung.dissipation),
        supplied=frozen(driven.sum(axis=1)),
        dissipated=frozen(dissipated),
        exchanged=frozen(np.sum([np.abs(x).sum(axis=1) for x in gross], axis=0)),
    )
