"""The designs of one chunk, one after the other through the engine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, frozen, seal
from fivebar_pin.dynamics.compiled_calls import told_by_closures
from fivebar_pin.engine.tables import FOLLOWED, NA, NV, STATUS, unwritten
from fivebar_pin.mechanism.mobility import beyond
from fivebar_pin.sweeps.problem import Problem
from fivebar_pin.sweeps.result import Status
from fivebar_pin.sweeps.terms import widths

__all__ = ["Chunk", "run"]

_LEFT = 1e-7  # how far rows that were left out may be open, or open at unit speed of a motor, as round-off [-]


@dataclass(frozen=True, slots=True, eq=False)
class Chunk:
    """What came out: as in `Sweep`, of some designs."""

    status: npt.NDArray[np.int8]
    reached: npt.NDArray[np.int64]
    values: dict[str, Array]


def run(problem: Problem, k: slice) -> Chunk:
    """Compute some designs; alone or beside others, in any thread or process, to the same last digit."""
    with np.errstate(all="ignore"):
        bench, n = _Bench(problem), k.stop - k.start
        status, reached = np.empty(n, dtype=np.int8), np.zeros(n, dtype=np.int64)
        wanted = {term.quantity for term in problem.terms}
        series = {name: np.full((n, len(problem.motion), widths(problem.chain)[name]), np.nan) for name in wanted}
        for i, knots in enumerate(problem.constants(k)):
            status[i], reached[i] = bench.run(knots)
            if status[i] == Status.OK:
                bench.tell(series, i)
        return Chunk(status, reached, {x.name: x.of(series[x.quantity], problem.motion.t) for x in problem.terms})


class _Bench:
    """Memory for one design at a time."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.tables = problem, problem.tables
        self.W = np.array(self.tables.W)
        n, nq = len(problem.motion), problem.q0.size
        na, nv = int(self.tables.I[NA]), int(self.tables.I[NV])
        self.na, self.motors = na, problem.chain.actuated_index
        self.q0 = np.empty((1, nq))
        self.q, self.v, self.a = np.empty((n, nq)), np.empty((n, nv)), np.empty((n, nv))
        self.N, self.gap = np.empty((n, nv, na)), np.empty(n)
        self.table = np.empty((n, na + 12 + nv))
        self.told = told_by_closures(problem.chain)
        motion = problem.motion
        self.q_a, self.v_a, self.a_a = frozen(motion.q), frozen(motion.v), frozen(motion.a)
        self.nothing = np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros((1, 0, 6))
        seal(self.nothing)
        self.path = tuple(unwritten(x) for x in (self.q, self.v, self.a, self.N))
        self.moved: tuple[Status, int] | None = None

    def run(self, knots: Array) -> tuple[Status, int]:
        """Compute a design, whose constants at all knots are given, as far as it goes."""
        if not np.isfinite(knots[-1]).all():
            return Status.UNREAL, 0
        if self.moved is None or self.problem.parameters:  # bodies alone do not change how it moves
            self.moved = self._move(knots)
        if self.moved[0] != Status.OK:
            return self.moved
        return self.moved if self._load(knots[-1]) else (Status.SINGULAR, 0)

    def _move(self, knots: Array) -> tuple[Status, int]:
        """Drive a design."""
        from fivebar_pin.engine.entries import drive
        from fivebar_pin.engine.sweeping import lead

        I, W, n = self.tables.I, self.W, len(self.gap)
        W[:] = self.tables.W  # nothing of the design before is left
        self.q0[0] = self.problem.q0
        lead(I, W, self.tables.before, knots, self.q0)
        if W[I[STATUS]] != FOLLOWED:
            return Status.OPEN, 0
        self.q[0] = self.q0[0]
        done = int(drive(I, W, self.q_a, self.v_a, self.a_a, self.q, self.v, self.a, self.N, self.gap))
        if done and self._leaves_the_plane(done - 1):
            return Status.UNLIKE, 0
        if done < n:
            return Status.SINGULAR, done
        outside = beyond(self.q, *self.problem.limits).any(axis=1)
        return (Status.LIMITS, int(np.argmax(outside))) if outside.any() else (Status.OK, n)

    def _load(self, constants: Array) -> bool:
        """Compute what moves a design, and tell whether all its springs have a direction."""
        from fivebar_pin.engine.entries import loads

        self.W[: constants.size] = constants
        I, (q, v, a, N), outside, about = self.tables.I, self.path, self.nothing, self.problem.about
        lost = loads(I, self.W, q, v, a, N, about, *outside, self.table)
        if not self.told:
            tree = self.table[:, self.na + 12 :, None]
            self.table[:, : self.na] = np.matmul(np.swapaxes(self.N, 1, 2), tree)[..., 0]
        return bool(lost < 0)

    def _leaves_the_plane(self, sample: int) -> bool:
        """Tell whether rows that say nothing of the chain say something of this design."""
        from fivebar_pin.engine.sweeping import left_open

        checks = self.tables.checks
        return checks is not None and not left_open(checks, self.W, self.q, self.N, sample) <= _LEFT

    def tell(self, series: dict[str, Array], i: int) -> None:
        """Write what was computed where it is wanted."""
        na, table = self.na, self.table
        found = {
            "torque": table[:, :na],
            "power": table[:, :na] * self.v[:, self.motors],
            "shaking_force": table[:, na : na + 3],
            "shaking_moment": table[:, na + 3 : na + 6],
            "frame_force": table[:, na + 6 : na + 9],
            "frame_moment": table[:, na + 9 : na + 12],
            "q": self.q,
            "v": self.v,
            "a": self.a,
        }
        for name, values in series.items():
            values[i] = found[name]
