"""Equations of motion of a closed chain in the tangent space of its closures, over a batch of states.

With the scaled closure Jacobian's null space N (J N = 0) and the least accelerations a_c that hold the loops closed,

    a = N w + a_c,    J a_c = -(dJ/dt) v
    (N^T M N) w = N^T (S^T tau + applied forces - friction - nle - M a_c)              [Angeles and Lee 1988, (46)]

The closure forces do no work on N and never appear.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.elastic import SpringForces, spring_forces
from fivebar_pin.dynamics.mass import depth_first, mass_matrix
from fivebar_pin.dynamics.wrenches import moved_to_origin
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.manifold import Manifold, manifold_of

__all__ = ["STICKING", "EquationsOfMotion", "ReducedEquations", "Slip"]


STICKING = 1e-10  # yield of joints that stick, as part of the largest, below which they hold each other [-]
_MASSLESS = 1e-13  # smallest to largest eigenvalue of the reduced inertia below which it counts as singular [-]


@dataclass(frozen=True, slots=True, eq=False)
class Slip:
    """What dry friction does.

    Attributes:
        sense: sign of the velocity of the joints that slip, else zero (nv,).
        stuck: joints that stick (k,).
    """

    sense: Array
    stuck: npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class ReducedEquations:
    """Reduced equations of motion, inertia w = force and a = N w + held, over a batch.

    Attributes:
        N: tangent space of the closures (n, nv, f).
        inertia: N^T M N (n, f, f).
        force: (n, f).
        held: accelerations that hold the loops closed (n, nv).
    """

    N: Array
    inertia: Array
    force: Array
    held: Array


@dataclass(frozen=True, eq=False)
class EquationsOfMotion:
    """A chain, ready to give accelerations.

    Attributes:
        chain, manifold: the mechanism and its closed configurations.
        damping, friction: viscous coefficients and dry friction torques of the joints (nv,).
        data: Pinocchio's workspace, this object's own.
    """

    chain: ClosedChain
    manifold: Manifold
    damping: Array
    friction: Array
    data: pin.Data

    @staticmethod
    def of(chain: ClosedChain) -> EquationsOfMotion:
        """Prepare a chain."""
        model = chain.model
        return EquationsOfMotion(
            chain,
            manifold_of(chain),
            np.array(model.damping),
            np.array(model.upperDryFrictionLimit),
            model.createData(),
        )

    def accelerations(
        self, point: Configurations, v: Array, applied: Array, rank: int, slip: Slip | None = None
    ) -> Array:
        """Return the joint accelerations (n, nv).

        Args:
            point: closed configurations (n).
            v: velocities that keep them closed (n, nv).
            applied: generalised forces of motors and from outside (n, nv) [N m or N].
            rank: of the closures.
            slip: what dry friction does; the sign of v says it otherwise.
        """
        sense = np.sign(v) if slip is None else slip.sense
        eq = self.equations(point, v, applied - self.friction * sense, rank)
        free = _solve_inertia(eq.inertia, eq.force[..., None])
        if slip is not None and slip.stuck.size:
            E = eq.N[:, slip.stuck]
            yields = _solve_inertia(eq.inertia, np.swapaxes(E, 1, 2))
            excess = np.matmul(E, free) + eq.held[:, slip.stuck, None]
            free = free - np.matmul(yields, np.matmul(np.linalg.pinv(np.matmul(E, yields), rcond=STICKING), excess))
        return np.asarray(eq.held + np.matmul(eq.N, free)[..., 0])

    def equations(self, point: Configurations, v: Array, applied: Array, rank: int) -> ReducedEquations:
        """Return the reduced equations of motion at states (n); dry friction must be among the applied forces."""
        loops, scale = self.manifold.loops, self.manifold.scale
        M, bias = self._mass_and_bias(point.q, v)
        N = point.independent.tangent(rank) * scale[:, None]  # (n, nv, f)
        force = applied - bias - self.damping * v
        if self.chain.springs:
            force = force + self.spring_forces(point, v).force
        held = np.zeros_like(v)
        if rank:
            drift = loops.drift(point.q, v) @ loops.reduce.T
            held = -point.independent.solve(drift, rank) * scale
        force = force - np.matmul(M, held[..., None])[..., 0]
        NT = np.swapaxes(N, 1, 2)
        return ReducedEquations(N, np.matmul(NT, np.matmul(M, N)), np.matmul(NT, force[..., None])[..., 0], held)

    def spring_forces(self, point: Configurations, v: Array) -> SpringForces:
        """Return what the springs do at states (n)."""
        return spring_forces(self.chain, self.manifold.loops, point.q, v, point.poses)

    def wrench_forces(self, point: Configurations, external: Mapping[str, Array]) -> Array:
        """Return the generalised forces (n, nv) of wrenches (n, 6) on frames."""
        acting = moved_to_origin(self.chain, point.poses, external)
        return np.asarray(np.sum(acting.torques(self.manifold.loops.tree, point.poses), axis=0))

    def project_velocity(self, point: Configurations, v: Array, rank: int) -> Array:
        """Return the velocity (nv,) that a sudden closing of the loops leaves of v: nearest in kinetic energy."""
        M, _ = self._mass_and_bias(point.q, v[None])
        N = point.independent.tangent(rank) * self.manifold.scale[:, None]
        NT = N.swapaxes(1, 2)
        return np.asarray((N @ _solve_inertia(NT @ M @ N, NT @ M @ v[None, :, None]))[0, :, 0])

    def _mass_and_bias(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Return the mass matrix, armature included (n, nv, nv), and Coriolis plus gravity torques (n, nv)."""
        model, data = self.chain.model, self.data
        M, bias = np.empty((q.shape[0], v.shape[1], v.shape[1])), np.empty_like(v)
        for i in range(q.shape[0]):
            M[i] = mass_matrix(model, data, q[i], ordered=self._ordered)
            bias[i] = pin.nonLinearEffects(model, data, q[i], v[i])
        return M, bias

    @cached_property
    def _ordered(self) -> bool:
        return depth_first(self.chain.model)


def _solve_inertia(inertia: Array, force: Array) -> Array:
    """Solve inertia (n, f, f) x = force (n, f, 1)."""
    if not inertia.shape[1]:
        return np.zeros((inertia.shape[0], 0, 1))
    size = np.sqrt(np.maximum(np.einsum("nii->ni", inertia), 0.0))
    if np.all(size > 0.0):
        unit = inertia / (size[:, :, None] * size[:, None, :])
        least = float(np.linalg.eigvalsh(unit)[:, 0].min())
        if least > _MASSLESS:
            return np.asarray(np.linalg.solve(unit, force / size[..., None]) / size[..., None])
    raise massless("inertia of the free motion")


def massless(name: str) -> InvalidInputError:
    """Return the error of an inertia (k, k), called by this name, that is singular."""
    return InvalidInputError(
        name,
        "singular",
        "must be positive: some motion of the mechanism moves no mass",
        "Give the bodies mass and inertia, or the joints an armature.",
    )
