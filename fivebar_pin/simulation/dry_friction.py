"""Dry friction in a simulation: which joints slip, and which way; which ones stick.

While a joint slips its friction is constant, -f sign(v). At rest it is what keeps the joint at rest, up to f. Joints at
rest are settled together, by Gauss's principle: the accelerations minimise

    1/2 w^T I w - g^T w + sum_j f_j |a_j|,   a_j = E_j w + h_j   over the joints at rest

whose dual is a least-squares problem in the friction torques, |lambda_j| <= f_j.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array
from fivebar_pin.dynamics.equations import STICKING, EquationsOfMotion, Slip
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.simulation.chart_motion import ChartMotion, ClosedState, Inputs, Node, between, first_node

__all__ = ["REST", "Settled", "Watch", "settle"]


_SAMPLES = 8  # states of a step at which slipping and sticking is looked at
_BISECTIONS = 48
REST = 1e-10  # speed of a joint, relative to the fastest, below which it is at rest [-]
_SLOWEST = 1e-9  # speed that counts as motion where nothing has moved yet [rad/s, or chain lengths per s]
_GAUSS = 1e-14  # tolerance of the least-squares problem: round-off [-]
_HOLDS = 1e-9  # acceleration of a joint that sticks, relative to what its friction can cause [-]


@dataclass(frozen=True, slots=True, eq=False)
class Settled:
    """Joints at rest, settled.

    Attributes:
        slip: with the joints that stick, and the sense of all others.
        sticks: whether all joints that were at rest stay there.
    """

    slip: Slip
    sticks: bool


def settle(
    system: EquationsOfMotion,
    point: Configurations,
    v: Array,
    applied: Array,
    rank: int,
    resting: npt.NDArray[np.bool_],
) -> Settled:
    """Decide which joints at rest stick, and which way the others start.

    Args:
        system: with dry friction.
        point, v, applied: one state and the generalised forces on it, friction left out (1, nv).
        rank: of the closures.
        resting: joints with friction that are at rest (nv,), of bool.
    """
    moving = np.where((system.friction > 0.0) & ~resting, np.sign(v), 0.0)
    index = np.flatnonzero(resting)
    if not index.size:
        return Settled(Slip(moving, index), True)
    eq = system.equations(point, v[None], applied - system.friction * moving, rank)
    E, h, f = eq.N[0, index], eq.held[0, index], system.friction[index]
    _, a = _friction_at_rest(eq.inertia[0], eq.force[0], E, h, f)
    able = np.abs(E @ np.linalg.solve(eq.inertia[0], E.T)).max(initial=0.0) * float(f.max())
    slips = np.abs(a) > _HOLDS * able
    moving[index[slips]] = np.sign(a[slips])
    return Settled(Slip(moving, index[~slips]), not bool(slips.any()))


def _friction_at_rest(inertia: Array, force: Array, E: Array, h: Array, f: Array) -> tuple[Array, Array]:
    """Return the friction torques (k,) and the accelerations (k,) of joints at rest."""
    from scipy.optimize import lsq_linear

    force = force + inertia @ (np.linalg.pinv(E) @ h)
    L = np.linalg.cholesky(inertia)
    A, b = np.linalg.solve(L, E.T), np.linalg.solve(L, force)
    torque = np.asarray(lsq_linear(A * f, b, bounds=(-1.0, 1.0), method="bvls", tol=_GAUSS).x) * f
    return torque, np.asarray(A.T @ (b - A @ torque))


class Watch:
    """Looks over every step for a joint that comes to rest, or one that breaks loose."""

    def __init__(self, system: EquationsOfMotion, inputs: Inputs, rank: int) -> None:
        self.system, self.inputs, self.rank = system, inputs, rank
        self.fastest = _SLOWEST  # seen so far [rad/s, or chain lengths per s]

    def start(self, state: ClosedState, t: float) -> Node:
        """Settle the joints at rest in a state and return its node; `slip` tells how."""
        scale = self.system.manifold.scale
        self.fastest = max(self.fastest, float(np.abs(state.v / scale).max()))
        resting = (self.system.friction > 0.0) & (np.abs(state.v) <= REST * self.fastest * scale)
        v = _stopped(self.system, state, np.flatnonzero(resting))
        applied = self.inputs.applied(self.system, state.point, t, v)
        self.slip = settle(self.system, state.point, v, applied, self.rank, resting).slip
        return first_node(self.system, self.inputs, ClosedState(state.point, v, self.rank), t, self.slip)

    def event(
        self, motion: ChartMotion, interpolant: Callable[[float], Array], reached: Node
    ) -> tuple[ClosedState, float] | None:
        """Return the first state of a step at which friction changes, and its time; None when there is none."""
        node, scale = motion.node, self.system.manifold.scale
        self.fastest = max(self.fastest, float(np.abs(reached.v / scale).max()))

        def state(t: float) -> tuple[Configurations, Array, Array] | None:
            if t == reached.t:
                return reached.point, reached.v, reached.a
            return motion.state(t, interpolant(t), between(self.system, node, reached, t))

        left = node.t
        for right in np.linspace(node.t, reached.t, _SAMPLES + 1)[1:]:
            if self._changes(state(float(right)), float(right)):
                return self._locate(state, left, float(right))
            left = float(right)
        return None

    def _changes(self, found: tuple[Configurations, Array, Array] | None, t: float) -> bool:
        """Whether a joint slips against its sense, or one that sticks would not hold."""
        if found is None:
            return False
        point, v, _ = found
        if np.any(v * self.slip.sense < -0.5 * REST * self.fastest * self.system.manifold.scale):
            return True
        if not self.slip.stuck.size:
            return False
        resting = np.zeros(v.size, dtype=np.bool_)
        resting[self.slip.stuck] = True
        applied = self.inputs.applied(self.system, point, t, v)
        return not settle(self.system, point, v, applied, self.rank, resting).sticks

    def _locate(
        self, state: Callable[[float], tuple[Configurations, Array, Array] | None], left: float, right: float
    ) -> tuple[ClosedState, float]:
        for _ in range(_BISECTIONS):
            middle = 0.5 * (left + right)
            if not left < middle < right:
                break
            if self._changes(state(middle), middle):
                right = middle
            else:
                left = middle
        found = state(right)
        assert found is not None  # it changed there
        return ClosedState(found[0], found[1], self.rank), right


def _stopped(system: EquationsOfMotion, state: ClosedState, stuck: npt.NDArray[np.intp]) -> Array:
    """Return the velocity (nv,) with the joints at rest made exactly so."""
    T = state.point.independent.tangent(state.rank)[0] * system.manifold.scale[:, None]
    w = T.T @ (state.v / system.manifold.scale**2)
    v = T @ (w - np.linalg.pinv(T[stuck], rcond=STICKING) @ (T[stuck] @ w)) if stuck.size else np.array(state.v)
    v[stuck] = 0.0
    return np.asarray(v)
