"""The output of a simulation: states at the asked times, between the steps of the integrator."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.equations import EquationsOfMotion
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.mechanism.closing import CLOSED
from fivebar_pin.mechanism.complement import complement_of
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.idle import at_rest
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.mechanism.rank import UNDRIVEN, smallest_values
from fivebar_pin.simulation.chart_motion import ChartMotion, Node, between, failure, sigma_of
from fivebar_pin.simulation.singular_step import lagrange
from fivebar_pin.trajectory import Trajectory

__all__ = ["Interpolant", "Record"]


Interpolant = Callable[[float], Array]

_CLOSE = 0.03  # scaled singular value below which a sample is interpolated from its neighbours, at most [-]
_DIP = 0.2  # the same, of the larger value at the two ends of the step
_THROUGH = 20  # states that such an interpolation goes through


class Record:
    """The output samples, filled as the integration passes them."""

    def __init__(self, system: EquationsOfMotion, times: Array) -> None:
        n, chain = times.size, system.chain
        self.system, self.times, self.done = system, times, 0
        self.q, self.v, self.a = np.empty((n, chain.nq)), np.empty((n, chain.nv)), np.empty((n, chain.nv))
        self.residual = np.zeros(n)

    def put(self, k: int, point: Configurations, v: Array, a: Array) -> None:
        self.q[k], self.v[k], self.a[k] = point.q[0], v, a
        self.residual[k] = np.abs(point.residual).max(initial=0.0)
        self.done = k + 1

    def fill(self, motion: ChartMotion, interpolant: Callable[[], Interpolant], node: Node, reached: Node) -> None:
        """Fill the samples after a node, up to the next one."""
        dense: Interpolant | None = None
        across: _Across | None = None
        while self.done < self.times.size and self.times[self.done] <= reached.t:
            t = float(self.times[self.done])
            if t == reached.t:
                self.put(self.done, reached.point, reached.v, reached.a)
                continue
            dense = dense or interpolant()
            found = motion.state(t, dense(t), between(motion.system, node, reached, t))
            if found is None or sigma_of(found[0], motion.rank) < _close(node, reached):
                across = across or _Across(motion, dense, node, reached)
                found = across.at(t)
            self.put(self.done, *found)

    def trajectory(self, rank: int) -> Trajectory:
        """Return everything that was recorded."""
        N = _complement(self.system, self.q, rank)
        return Trajectory(self.times, self.q, self.v, self.a, N, self.residual)


def _beside_idle(chain: ClosedChain, q: Array, N: Array) -> Array:
    """Return N where all that the motors leave undetermined moves nothing else: what is free needs no force."""
    loops = loops_of(at_rest(chain))
    if not loops.lacking:
        here = Configurations(loops, q)
        regular = here.passive.sigma > UNDRIVEN
        with suppress(InvalidInputError):  # motors that are tied to each other
            N[regular] = complement_of(here)[regular]
    return N


def _close(node: Node, reached: Node) -> float:
    """Return the singular value below which round-off shows in a state between two nodes."""
    return min(_CLOSE, _DIP * max(node.sigma, reached.sigma))


class _Across:
    """States of one step at and near a singular instant: independent coordinates as integrated, all others through
    states of the step that are clear of it."""

    def __init__(self, motion: ChartMotion, dense: Interpolant, node: Node, reached: Node) -> None:
        self.motion, self.dense, self.node, self.h = motion, dense, node, reached.t - node.t
        tree, times, rows = motion.system.manifold.loops.tree, [], []
        for s in 0.5 - 0.5 * np.cos((np.arange(_THROUGH) + 0.5) * np.pi / _THROUGH):
            t = node.t + s * self.h
            found = motion.state(t, dense(t), between(motion.system, node, reached, t))
            if found is not None and sigma_of(found[0], motion.rank) >= _close(node, reached):
                away = tree.difference(motion.chart.q[None], found[0].q)[0]
                rows.append(np.concatenate([away, found[1], found[2]]))
                times.append(s)
        if len(times) < _THROUGH // 2:
            raise failure(node, motion.rank, "the configuration is not determined over a whole step")
        self.times, self.rows = np.array(times), np.array(rows)

    def at(self, t: float) -> tuple[Configurations, Array, Array]:
        """Return point, v (nv,) and a (nv,) at a time."""
        manifold, B = self.motion.system.manifold, self.motion.chart.B
        dq, v, a = np.split(lagrange(np.array((t - self.node.t) / self.h), self.times) @ self.rows, 3)
        xi, u = np.split(self.dense(t), 2)
        dq = dq + manifold.scale * (B @ (xi - B.T @ (dq / manifold.scale)))
        v = v + manifold.scale * (B @ (u - B.T @ (v / manifold.scale)))
        q = manifold.loops.tree.integrate(self.motion.chart.q[None], dq[None])[0]
        return manifold.project(q, CLOSED), v, a


def _complement(system: EquationsOfMotion, q: Array, rank: int) -> Array:
    """Return N (n, nv, na) of the actuated joints; nan where they do not determine the motion.

    With more motors than mobility, N is the one of least torque: N^T distributes a load over the motors with the
    least sum of squares.
    """
    chain, index = system.chain, system.chain.actuated_index
    N = np.full((q.shape[0], chain.nv, chain.na), np.nan)
    if not chain.na:
        return N
    if chain.na < chain.nv - rank:
        return _beside_idle(chain, q, N)
    tangent, scale = system.manifold.at(q).independent.tangent(rank), system.manifold.scale
    driven = tangent[:, index]  # what the motors see of it (n, na, f)
    regular = smallest_values(driven) > UNDRIVEN
    T = tangent[regular] * scale[:, None]
    N[regular] = np.matmul(T, np.linalg.pinv(T[:, index]))
    return N
