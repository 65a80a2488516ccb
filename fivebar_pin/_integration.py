"""Adaptive integration on independent coordinates, chart by chart.

Between two changes of the chart the state is (xi, u): the independent coordinates and the same components of the
velocity, u = B^T v. From it come q (Newton's method on the closures), v = N u and the accelerations.

Where the closures lose rank for an instant (a parallelogram lying flat), every chart of the mechanism does. The rank is
kept at its regular value there: steps lead over the instant, the branch that continues the motion smoothly is
predicted from velocity and acceleration, and every step is checked against them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fivebar_pin._arrays import Array, checked
from fivebar_pin._manifold import Chart, Point
from fivebar_pin._system import System, Wrench
from fivebar_pin.errors import SingularityError, SolverError
from fivebar_pin.trajectory import Trajectory

_TURNED = 0.7  # cosine between chart and tangent space at which the chart is changed
_FAR = 1.5  # distance from its middle at which a chart of joints that are not plain numbers is changed [rad]
_SMOOTH = 0.02  # mismatch of a step with the velocities and accelerations at its ends, relative
_RETRIES = 40
_GAP = 0.467  # middle of the widest gap between the stages of DOP853, where a singular instant does least harm
_CLOSE = 1e-3  # scaled singular value below which a sample is interpolated from its neighbours [-]
_THROUGH = 12  # states that such an interpolation goes through
_NEARLY_SINGULAR = 1e-3  # scaled singular value at which a failure is put down to a bifurcation [-]
_DETERMINED = 1e-12  # scaled slope of the actuated joints below which they do not determine the motion [-]


@dataclass(frozen=True, slots=True, eq=False)
class Inputs:
    """What acts from outside.

    Attributes:
        tau: constant (na,) or a function (t, q, v).
        external: by frame, constant (6,) or a function (t, q, v).
    """

    tau: Any
    external: Mapping[str, Wrench]

    def applied(self, system: System, point: Point, t: float, v: Array) -> Array:
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
class State:
    """A closed configuration, its velocity (nv,) and the rank of the closures on this motion."""

    point: Point
    v: Array
    rank: int


@dataclass(frozen=True, slots=True, eq=False)
class _Node:
    """A state on the motion with its acceleration."""

    t: float
    point: Point
    v: Array
    a: Array
    jerk: Array  # backward difference of the accelerations
    sigma: float  # smallest singular value of the closures, scaled
    ahead: float  # time after which it would vanish at its present slope [s]


class _Motion:
    """The right-hand side in one chart, around one node."""

    def __init__(self, system: System, inputs: Inputs, rank: int, chart: Chart, node: _Node) -> None:
        self.system, self.inputs, self.rank, self.chart, self.node = system, inputs, rank, chart, node

    def start(self) -> Array:
        """Return (xi, u) at the node."""
        xi = self.system.manifold.coordinates(self.chart, self.node.point.q[0])
        return np.concatenate([xi, self.chart.B.T @ (self.node.v / self.system.manifold.scale)])

    def state(self, t: float, y: Array, guess: Array | None = None) -> tuple[Point, Array, Array] | None:
        """Return the point, v (nv,) and a (nv,) of (xi, u); None where the chart does not reach."""
        manifold, f = self.system.manifold, self.chart.B.shape[1]
        if not np.all(np.isfinite(y)):
            return None
        point = manifold.solve(self.chart, y[:f], self._predict(t) if guess is None else guess, self.rank)
        if point is None:
            return None
        T = point.Vt[0, self.rank :].T  # tangent space here (nv, f)
        try:
            v = T @ np.linalg.solve(self.chart.B.T @ T, y[f:]) * manifold.scale
        except np.linalg.LinAlgError:
            return None
        applied = self.inputs.applied(self.system, point, t, v)
        with np.errstate(all="ignore"):
            a = self.system.accelerations(point, v[None], applied, self.rank)[0]
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

    def _predict(self, t: float) -> Array:
        node, dt = self.node, t - self.node.t
        dq = dt * (node.v + dt * (0.5 * node.a + dt / 6.0 * node.jerk))
        return np.asarray(self.system.manifold.loops.tree.integrate(node.point.q, dq[None])[0])

    def worn(self, point: Point) -> bool:
        """Whether another chart should take over at a point."""
        cosines = np.linalg.svd(self.chart.B.T @ point.Vt[0, self.rank :].T, compute_uv=False)
        if float(cosines[-1]) < _TURNED:
            return True
        tree = self.system.manifold.loops.tree
        if tree.is_vector_space:
            return False
        away = tree.difference(self.chart.q[None], point.q)[0] / self.system.manifold.scale
        return bool(np.abs(away).max() > _FAR)


def run(
    system: System,
    inputs: Inputs,
    state: State,
    times: Array,
    *,
    rtol: float,
    atol: float,
    max_steps: int,
    progress: Callable[[float], None] | None,
) -> Trajectory:
    """Integrate from a state at times[0] and return the motion at all times (n,)."""
    from scipy.integrate import DOP853

    manifold, rank = system.manifold, state.rank
    node = _first(system, inputs, state, float(times[0]))
    record = _Record(system, times)
    record.put(0, node.point, node.v, node.a)
    motion = _Motion(system, inputs, rank, manifold.chart_at(node.point, rank), node)
    solver, retries, h = None, 0, None
    end = float(times[-1])
    for _ in range(max_steps):
        if record.done == times.size:
            return record.trajectory(rank)
        if solver is None:
            solver = DOP853(
                motion.rate, node.t, motion.start(), end, rtol=rtol, atol=atol, first_step=_bounded(h, node.t, end)
            )
        solver.max_step = _longest(node, solver.h_abs)
        message = solver.step()
        if solver.status == "failed":
            raise _failure(node, rank, message or "")
        reached = _reached(motion, solver.t, solver.y)
        if reached is None or not _is_smooth(system, node, reached):
            retries += 1
            h = 0.25 * (solver.t - node.t)
            if retries > _RETRIES or h < 1e-13 * max(1.0, abs(node.t)):
                raise _failure(node, rank, "the step cannot be made short enough")
            solver = None
            motion.node = node
            continue
        retries, h = 0, solver.h_abs
        record.between(motion, solver, node, reached)
        node = motion.node = reached
        if progress is not None:
            progress((node.t - float(times[0])) / (end - float(times[0])))
        if motion.worn(node.point):
            motion = _Motion(system, inputs, rank, manifold.chart_at(node.point, rank), node)
            solver = None
    raise SolverError(
        f"the simulation took {max_steps} steps to get to t = {node.t:.6g} s of {end:.6g} s. The motion is stiff or "
        "not smooth (dry friction at rest, very stiff springs): loosen rtol and atol, or raise max_steps."
    )


class _Record:
    """The output samples, filled as the integration passes them."""

    def __init__(self, system: System, times: Array) -> None:
        n, chain = times.size, system.chain
        self.system, self.times, self.done = system, times, 0
        self.q, self.v, self.a = np.empty((n, chain.nq)), np.empty((n, chain.nv)), np.empty((n, chain.nv))
        self.residual = np.zeros(n)

    def put(self, k: int, point: Point, v: Array, a: Array) -> None:
        self.q[k], self.v[k], self.a[k] = point.q[0], v, a
        self.residual[k] = np.abs(point.residual).max(initial=0.0)
        self.done = k + 1

    def between(self, motion: _Motion, solver: Any, node: _Node, reached: _Node) -> None:
        """Fill the samples after a node, up to the next one."""
        dense = None
        while self.done < self.times.size and self.times[self.done] <= reached.t:
            t = float(self.times[self.done])
            if t == reached.t:
                self.put(self.done, reached.point, reached.v, reached.a)
                continue
            dense = dense or solver.dense_output()
            found = motion.state(t, dense(t), _between(motion.system, node, reached, t))
            if found is None or _sigma(found[0], motion.rank) < _CLOSE:
                found = _across(motion, dense, node, reached, t)
            self.put(self.done, *found)

    def trajectory(self, rank: int) -> Trajectory:
        """Return everything that was recorded."""
        N = _complement(self.system, self.q, rank)
        return Trajectory(self.times, self.q, self.v, self.a, N, self.residual)


def _first(system: System, inputs: Inputs, state: State, t: float) -> _Node:
    applied = inputs.applied(system, state.point, t, state.v)
    a = system.accelerations(state.point, state.v[None], applied, state.rank)[0]
    return _Node(t, state.point, state.v, a, np.zeros_like(a), _sigma(state.point, state.rank), np.inf)


def _reached(motion: _Motion, t: float, y: Array) -> _Node | None:
    """Return the node at the end of a step."""
    found = motion.state(t, y)
    if found is None:
        return None
    point, v, a = found
    node, sigma = motion.node, _sigma(point, motion.rank)
    falling = (node.sigma - sigma) / (t - node.t)
    ahead = sigma / falling if falling > 0.0 else np.inf
    return _Node(t, point, v, a, (a - node.a) / (t - node.t), sigma, ahead)


def _sigma(point: Point, rank: int) -> float:
    return float(point.s[0, rank - 1]) if rank else 1.0


def _longest(node: _Node, h: float) -> float:
    """Return the longest next step, so that a singular instant ahead falls into the gap between the stages.

    At a distance d from it the round-off of the closures is magnified by 1/d^2 in the accelerations.
    """
    place = node.ahead / h
    if place > 1.0 + _GAP or 0.9 * _GAP < place < 1.1 * _GAP:
        return np.inf
    if place <= _GAP:
        return node.ahead / _GAP
    return (place - _GAP) * h


def _is_smooth(system: System, node: _Node, reached: _Node) -> bool:
    """Whether the way between two nodes agrees with the velocities and accelerations at both: no jump of branch."""
    scale, h = system.manifold.scale, reached.t - node.t
    way = system.manifold.loops.tree.difference(node.point.q, reached.point.q)[0] / scale
    expected = h * (0.5 * (node.v + reached.v) + h / 12.0 * (node.a - reached.a)) / scale
    size = max(float(np.abs(x).max(initial=0.0)) for x in (way, h * node.v / scale, h * reached.v / scale))
    return float(np.abs(way - expected).max(initial=0.0)) <= _SMOOTH * size + 1e-12


def _between(system: System, node: _Node, reached: _Node, t: float) -> Array:
    """Interpolate a configuration (nq,) between two nodes from q, v and a at both: quintic."""
    tree, h = system.manifold.loops.tree, reached.t - node.t
    s, way = (t - node.t) / h, tree.difference(node.point.q, reached.point.q)[0]
    v0, v1, a0, a1 = h * node.v, h * reached.v, h * h * node.a, h * h * reached.a
    c3 = 10.0 * way - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15.0 * way + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1
    c5 = 6.0 * way - 3.0 * (v0 + v1) - 0.5 * (a0 - a1)
    dq = s * (v0 + s * (0.5 * a0 + s * (c3 + s * (c4 + s * c5))))
    return np.asarray(tree.integrate(node.point.q, dq[None])[0])


def _across(motion: _Motion, dense: Any, node: _Node, reached: _Node, t: float) -> tuple[Point, Array, Array]:
    """Return point, v and a at a singular instant: the polynomial through states before and after it."""
    system, tree, times = motion.system, motion.system.manifold.loops.tree, []
    rows = []
    h = reached.t - node.t
    for s in 0.5 - 0.5 * np.cos((np.arange(_THROUGH) + 0.5) * np.pi / _THROUGH):
        at = node.t + s * h
        if abs(at - t) < 0.02 * h:
            continue
        found = motion.state(at, dense(at), _between(system, node, reached, at))
        if found is not None and _sigma(found[0], motion.rank) >= _CLOSE:
            rows.append(np.concatenate([tree.difference(node.point.q, found[0].q)[0], found[1], found[2]]))
            times.append((at - t) / h)
    if len(times) < _THROUGH - 3:
        raise _failure(node, motion.rank, f"the configuration at t = {t:.6g} s is not determined")
    x = np.array(times)
    weight = np.array([np.prod(np.delete(x, k) / (np.delete(x, k) - x[k])) for k in range(x.size)])
    dq, v, a = np.split(weight @ np.array(rows), 3)
    point = system.manifold.project(tree.integrate(node.point.q, dq[None])[0], 1e-12)
    return point, v, a


def _complement(system: System, q: Array, rank: int) -> Array:
    """Return N (n, nv, na) of the actuated joints; nan where they do not determine the motion.

    With more motors than mobility, N is the one of least torque: N^T distributes a load over the motors with the
    least sum of squares.
    """
    chain, index = system.chain, system.chain.actuated_index
    N = np.full((q.shape[0], chain.nv, chain.na), np.nan)
    if chain.na < chain.nv - rank or not chain.na:
        return N
    T = np.swapaxes(system.manifold.at(q).Vt[:, rank:], 1, 2) * system.manifold.scale[:, None]  # (n, nv, f)
    regular = np.linalg.svd(T[:, index] / system.manifold.scale[index, None], compute_uv=False)[:, -1] > _DETERMINED
    N[regular] = np.matmul(T[regular], np.linalg.pinv(T[regular][:, index]))
    return N


def _value(name: str, given: Any, shape: tuple[int, ...], t: float, q: Array, v: Array) -> Array:
    """Return a constant or the value of a function of state, checked."""
    return checked(name, given(t, q.copy(), v.copy()) if callable(given) else given, shape)


def _bounded(h: float | None, t: float, end: float) -> float | None:
    return None if h is None else min(h, end - t)


def _failure(node: _Node, rank: int, reason: str) -> SingularityError | SolverError:
    """Say why the motion cannot be followed on from a node."""
    sigma = _sigma(node.point, rank)
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
        "stiff there: look at tau, the springs and dry friction at rest, or loosen rtol and atol."
    )
