"""The motion in one chart: the rates of the independent coordinates, and the states they stand for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fivebar_pin._arrays import Array, checked, numeric
from fivebar_pin.dynamics.equations import EquationsOfMotion, Slip
from fivebar_pin.dynamics.wrenches import Wrench
from fivebar_pin.errors import SingularityError, SolverError
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.manifold import Chart
from fivebar_pin.mechanism.rank import SINGULAR

__all__ = [
    "ChartMotion",
    "ClosedState",
    "Inputs",
    "Node",
    "between",
    "failure",
    "first_node",
    "is_smooth",
    "next_node",
    "sigma_of",
]


_TURNED = 0.7  # cosine between chart and tangent space at which the chart is changed
_FAR = 1.5  # distance from its middle at which a chart is changed [rad, or chain lengths]
_SMOOTH = 0.02  # mismatch of a step with the velocities and accelerations at its ends, relative
_UNFELT = 1e-12  # mismatch that is round-off, however short the step [rad, or chain lengths]
_NO_END = 1e-5  # scaled singular value that a step may not end below: round-off would show in the velocity [-]
_NEARLY_SINGULAR = 1e-3  # scaled singular value at which a failure is put down to a bifurcation [-]


@dataclass(frozen=True, slots=True, eq=False)
class Inputs:
    """What acts from outside.

    Attributes:
        tau: constant (na,) or a function (t, q, v).
        external: by frame, constant (6,) or a function (t, q, v).
    """

    tau: Any
    external: Mapping[str, Wrench]

    def applied(self, system: EquationsOfMotion, point: Configurations, t: float, v: Array) -> Array:
        """Return the generalised forces (1, nv) at one state."""
        q = point.q[0]
        wrenches = {
            name: _value(f"external[{name!r}] at t = {t:.6g} s", w, (6,), t, q, v)[None]
            for name, w in self.external.items()
        }
        out = system.wrench_forces(point, wrenches)
        if system.chain.na:
            tau = _value(f"tau at t = {t:.6g} s", self.tau, (system.chain.na,), t, q, v)
            out[0, system.chain.actuated_index] += tau
        return out


@dataclass(frozen=True, slots=True, eq=False)
class ClosedState:
    """A closed configuration, its velocity (nv,) and the rank of the closures on this motion."""

    point: Configurations
    v: Array
    rank: int


@dataclass(frozen=True, slots=True, eq=False)
class Node:
    """A state on the motion with its acceleration."""

    t: float
    point: Configurations
    v: Array
    a: Array
    jerk: Array  # backward difference of the accelerations
    sigma: float  # smallest singular value of the closures, scaled
    ahead: float  # time after which it would vanish at its present slope [s]


class ChartMotion:
    """The right-hand side in one chart, around one node."""

    def __init__(
        self, system: EquationsOfMotion, inputs: Inputs, rank: int, chart: Chart, node: Node, slip: Slip | None = None
    ) -> None:
        self.system, self.inputs, self.rank, self.chart, self.node = system, inputs, rank, chart, node
        self.slip = slip

    def start(self) -> Array:
        """Return (xi, u) at the node."""
        xi = self.system.manifold.coordinates(self.chart, self.node.point.q[0])
        return np.concatenate([xi, self.chart.B.T @ (self.node.v / self.system.manifold.scale)])

    def state(self, t: float, y: Array, guess: Array | None = None) -> tuple[Configurations, Array, Array] | None:
        """Return the point, v (nv,) and a (nv,) of (xi, u); None where the chart does not reach."""
        manifold, f = self.system.manifold, self.chart.B.shape[1]
        if not np.all(np.isfinite(y)):
            return None
        point = manifold.solve(self.chart, y[:f], self.predict(t) if guess is None else guess, self.rank)
        if point is None or sigma_of(point, self.rank) < SINGULAR:
            return None
        T = point.independent.tangent(self.rank)[0]  # (nv, f)
        try:
            v = T @ np.linalg.solve(self.chart.B.T @ T, y[f:]) * manifold.scale
        except np.linalg.LinAlgError:
            return None
        if self.slip is not None:
            v[self.slip.stuck] = 0.0
        applied = self.inputs.applied(self.system, point, t, v)
        with np.errstate(all="ignore"):
            a = self.system.accelerations(point, v[None], applied, self.rank, self.slip)[0]
        return (point, v, a) if np.all(np.isfinite(a)) else None

    def rate(self, t: float, y: Array) -> Array:
        """Return the rate of (xi, u); nan, which the integrator takes for a step too long, where there is none."""
        found = self.state(t, y)
        if found is None:
            return np.full_like(y, np.nan)
        point, v, a = found
        manifold = self.system.manifold
        slope = manifold.slope(self.chart, point.q[0])
        return np.concatenate([slope @ (v / manifold.scale), self.chart.B.T @ (a / manifold.scale)])

    def predict(self, t: float) -> Array:
        """Return the configuration (nq,) expected at a time, not closed, from v, a and the last change of a."""
        node, dt = self.node, t - self.node.t
        dq = dt * (node.v + dt * (0.5 * node.a + dt / 6.0 * node.jerk))
        return np.asarray(self.system.manifold.loops.tree.integrate(node.point.q, dq[None])[0])

    def worn(self, point: Configurations) -> bool:
        """Whether another chart should take over at a point."""
        cosines = np.linalg.svd(self.chart.B.T @ point.independent.tangent(self.rank)[0], compute_uv=False)
        if float(cosines[-1]) < _TURNED:
            return True
        tree = self.system.manifold.loops.tree
        away = tree.difference(self.chart.q[None], point.q)[0] / self.system.manifold.scale
        return bool(np.abs(away).max() > _FAR)


def first_node(
    system: EquationsOfMotion, inputs: Inputs, state: ClosedState, t: float, slip: Slip | None = None
) -> Node:
    """Return the node of a state that begins a stretch of smooth motion."""
    applied = inputs.applied(system, state.point, t, state.v)
    a = system.accelerations(state.point, state.v[None], applied, state.rank, slip)[0]
    return Node(t, state.point, state.v, a, np.zeros_like(a), sigma_of(state.point, state.rank), np.inf)


def next_node(motion: ChartMotion, t: float, y: Array) -> Node | None:
    """Return the node at the end of a step."""
    found = motion.state(t, y)
    if found is None:
        return None
    point, v, a = found
    node, sigma = motion.node, sigma_of(point, motion.rank)
    if sigma < _NO_END:
        return None
    falling = (node.sigma - sigma) / (t - node.t)
    ahead = sigma / falling if falling > 0.0 else np.inf
    return Node(t, point, v, a, (a - node.a) / (t - node.t), sigma, ahead)


def sigma_of(point: Configurations, rank: int) -> float:
    """Return the smallest singular value of the closures at the first of some configurations, scaled [-]."""
    return float(point.independent.smallest(rank)[0])


def is_smooth(system: EquationsOfMotion, node: Node, reached: Node) -> bool:
    """Whether the way between two nodes agrees with the velocities and accelerations at both: no jump of branch."""
    scale, h = system.manifold.scale, reached.t - node.t
    way = system.manifold.loops.tree.difference(node.point.q, reached.point.q)[0] / scale
    expected = h * (0.5 * (node.v + reached.v) + h / 12.0 * (node.a - reached.a)) / scale
    size = max(float(np.abs(x).max(initial=0.0)) for x in (way, h * node.v / scale, h * reached.v / scale))
    return float(np.abs(way - expected).max(initial=0.0)) <= _SMOOTH * size + _UNFELT


def between(system: EquationsOfMotion, node: Node, reached: Node, t: float) -> Array:
    """Interpolate a configuration (nq,) between two nodes from q, v and a at both: quintic."""
    tree, h = system.manifold.loops.tree, reached.t - node.t
    s, way = (t - node.t) / h, tree.difference(node.point.q, reached.point.q)[0]
    v0, v1, a0, a1 = h * node.v, h * reached.v, h * h * node.a, h * h * reached.a
    c3 = 10.0 * way - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15.0 * way + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1
    c5 = 6.0 * way - 3.0 * (v0 + v1) - 0.5 * (a0 - a1)
    dq = s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5))))
    return np.asarray(tree.integrate(node.point.q, dq[None])[0])


def failure(node: Node, rank: int, reason: str) -> SingularityError | SolverError:
    """Say why the motion cannot be followed on from a node."""
    sigma = sigma_of(node.point, rank)
    if sigma < _NEARLY_SINGULAR:
        error = SingularityError(
            f"at t = {node.t:.6g} s the motion comes to a configuration where the mechanism can move on in several "
            f"ways (smallest scaled singular value of the closures {sigma:.2g}); it cannot be followed through. "
            "Start from a state that passes it at speed, or not at all.",
            sigma=sigma,
        )
        error.time = node.t
        return error
    return SolverError(
        f"the simulation stops at t = {node.t:.6g} s: {reason.strip().rstrip('.')}. The motion is not smooth or too "
        "stiff there: look at tau and the springs, or loosen rtol and atol."
    )


def _value(name: str, given: Any, shape: tuple[int, ...], t: float, q: Array, v: Array) -> Array:
    """Return a constant or the value of a function of state, checked."""
    value = numeric(name, given(t, q.copy(), v.copy())) if callable(given) else given
    return checked(name, value.reshape(1) if np.ndim(value) == 0 and shape == (1,) else value, shape)
