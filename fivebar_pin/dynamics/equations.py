"""Equations of motion of a closed chain in the tangent space of its closures, over a batch of states.

With the scaled closure Jacobian's null space N (J N = 0) and the least accelerations a_c that hold the loops closed,

    a = N w + a_c,    J a_c = -(dJ/dt) v
    (N^T M N) w = N^T (S^T tau + applied forces - friction - nle - M a_c)              [Angeles and Lee 1988, (46)]

The closure forces do no work on N and never appear.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, checked, numeric
from fivebar_pin.chain import ClosedChain, frames_by_name
from fivebar_pin.closures import ClosureKind
from fivebar_pin.dynamics.elastic import SpringForces, frame_points, spring_forces, wrench_force
from fivebar_pin.dynamics.mass import depth_first, mass_matrix
from fivebar_pin.errors import InvalidInputError, UnknownNameError
from fivebar_pin.mechanism.manifold import Manifold, Point, manifold_of

__all__ = ["Equations", "Mode", "System", "Wrench", "check_frame", "checked_wrench"]


Wrench = npt.ArrayLike | Callable[[float, Array, Array], npt.ArrayLike]

_FEW = 6  # up to here one Pinocchio call per sample beats the batch
_MASSLESS = 1e-13  # smallest to largest eigenvalue of the reduced inertia below which it counts as singular [-]


@dataclass(frozen=True, slots=True, eq=False)
class Mode:
    """What dry friction does.

    Attributes:
        sense: sign of the velocity of the joints that slip, else zero (nv,).
        stuck: joints that stick (k,).
    """

    sense: Array
    stuck: npt.NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Equations:
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
class System:
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
    def of(chain: ClosedChain) -> System:
        """Prepare a chain."""
        model = chain.model
        return System(
            chain,
            manifold_of(chain),
            np.array(model.damping),
            np.array(model.upperDryFrictionLimit),
            model.createData(),
        )

    def accelerations(self, point: Point, v: Array, applied: Array, rank: int, mode: Mode | None = None) -> Array:
        """Return the joint accelerations (n, nv).

        Args:
            point: closed configurations (n).
            v: velocities that keep them closed (n, nv).
            applied: generalised forces of motors and from outside (n, nv) [N m or N].
            rank: of the closures.
            mode: what dry friction does; the sign of v says it otherwise.
        """
        sense = np.sign(v) if mode is None else mode.sense
        eq = self.equations(point, v, applied - self.friction * sense, rank)
        free = _solve_inertia(eq.inertia, eq.force[..., None])
        if mode is not None and mode.stuck.size:
            E = eq.N[:, mode.stuck]
            yields = _solve_inertia(eq.inertia, np.swapaxes(E, 1, 2))
            excess = np.matmul(E, free) + eq.held[:, mode.stuck, None]
            free = free - np.matmul(yields, np.matmul(np.linalg.pinv(np.matmul(E, yields), rcond=1e-10), excess))
        return np.asarray(eq.held + np.matmul(eq.N, free)[..., 0])

    def equations(self, point: Point, v: Array, applied: Array, rank: int) -> Equations:
        """Return the reduced equations of motion at states (n); dry friction must be among the applied forces."""
        loops, scale = self.manifold.loops, self.manifold.scale
        M, bias = self._mass_and_bias(point.q, v)
        N = np.swapaxes(point.Vt[:, rank:], 1, 2) * scale[:, None]  # (n, nv, f)
        force = applied - bias - self.damping * v
        if self.chain.springs:
            force = force + self.spring_forces(point, v).force
        held = np.zeros_like(v)
        if rank:
            drift = self._drift(point, v) @ loops.reduce.T
            along = np.einsum("nir,ni->nr", point.U[:, :, :rank], drift) / point.s[:, :rank]
            held = -np.einsum("nrk,nr->nk", point.Vt[:, :rank], along) * scale
        force = force - np.matmul(M, held[..., None])[..., 0]
        NT = np.swapaxes(N, 1, 2)
        return Equations(N, np.matmul(NT, np.matmul(M, N)), np.matmul(NT, force[..., None])[..., 0], held)

    def spring_forces(self, point: Point, v: Array) -> SpringForces:
        """Return what the springs do at states (n)."""
        return spring_forces(self.chain, self.manifold.loops, point.q, v, point.poses)

    def wrench_forces(self, point: Point, external: Mapping[str, Array]) -> Array:
        """Return the generalised forces (n, nv) of wrenches (n, 6) on frames."""
        out = np.zeros((point.q.shape[0], self.chain.nv))
        for frame, wrench in external.items():
            origin, J = frame_points(self.chain, self.manifold.loops, frame, point.poses)
            out += wrench_force(origin, J, wrench)
        return out

    def project_velocity(self, point: Point, v: Array, rank: int) -> Array:
        """Return the velocity (nv,) that a sudden closing of the loops leaves of v: nearest in kinetic energy."""
        M, _ = self._mass_and_bias(point.q, v[None])
        N = (point.Vt[:, rank:] * self.manifold.scale).swapaxes(1, 2)
        NT = N.swapaxes(1, 2)
        return np.asarray((N @ _solve_inertia(NT @ M @ N, NT @ M @ v[None, :, None]))[0, :, 0])

    def _drift(self, point: Point, v: Array) -> Array:
        """Return the second rate of the closures at zero joint accelerations (n, m), the loops being closed."""
        loops, n = self.manifold.loops, v.shape[0]
        if n > _FEW or any(c.kind is not ClosureKind.POINT for c in self.chain.closures):
            return loops.drift(point.pairs, loops.tree.rates(point.q, v, point.poses))
        model, data, out, still = self.chain.model, self.data, np.empty((n, loops.m)), np.zeros(self.chain.nv)
        for i in range(n):
            pin.forwardKinematics(model, data, point.q[i], v[i], still)
            for k, (first, second) in enumerate(self._frames):
                a1, a2 = (
                    pin.getFrameClassicalAcceleration(model, data, f, pin.LOCAL_WORLD_ALIGNED).linear
                    for f in (first, second)
                )
                out[i, 3 * k : 3 * k + 3] = (a2 - a1) @ point.pairs[k].R1[i]
        return out

    @cached_property
    def _frames(self) -> list[tuple[int, int]]:
        """Frame numbers of every closure."""
        model = self.chain.model
        named = frames_by_name(model)
        found = [[named[name] for name in c.frames] for c in self.chain.closures]
        return [(model.getFrameId(f.name, f.type), model.getFrameId(g.name, g.type)) for f, g in found]

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


def checked_wrench(chain: ClosedChain, external: Mapping[str, npt.ArrayLike] | None, n: int) -> dict[str, Array]:
    """Return external wrenches (n, 6) by frame name.

    Raises:
        UnknownNameError: a frame that does not exist.
        InvalidInputError: a wrong shape.
    """
    out = {}
    for name, wrench in (external or {}).items():
        check_frame(chain, name)
        w = numeric(f"external[{name!r}]", wrench)
        out[name] = checked(f"external[{name!r}]", np.broadcast_to(w, (n, 6)) if w.shape == (6,) else w, (n, 6))
    return out


def check_frame(chain: ClosedChain, name: str) -> None:
    """Raise when an external force names a frame that the chain does not have."""
    names = [f.name for f in chain.model.frames]
    if name not in names:
        raise UnknownNameError("frame of an external force", name, names)


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
    raise InvalidInputError(
        "inertia of the free motion",
        "singular",
        "must be positive: some motion of the mechanism moves no mass",
        "Give the bodies mass and inertia, or the joints an armature.",
    )
