"""Adaptive integration on independent coordinates, chart by chart.

Between two changes of the chart the state is (xi, u): the independent coordinates and the same components of the
velocity, u = B^T v. From it come q (Newton's method on the closures), v = N u and the accelerations.

Where the closures lose rank for an instant (a parallelogram lying flat), every chart of the mechanism does. The rank is
kept at its regular value there: steps lead over the instant, the branch that continues the motion smoothly is
predicted from velocity and acceleration, and every step is checked against them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.dynamics.equations import EquationsOfMotion
from fivebar_pin.errors import SolverError
from fivebar_pin.simulation.chart_motion import (
    ChartMotion,
    ClosedState,
    Inputs,
    Node,
    failure,
    first_node,
    is_smooth,
    next_node,
)
from fivebar_pin.simulation.dry_friction import Watch
from fivebar_pin.simulation.output import Interpolant, Record
from fivebar_pin.simulation.singular_step import Crossing, refine, singular_ahead, step_over
from fivebar_pin.trajectory import Trajectory

__all__ = ["run"]


_RETRIES = 40
_SHORTEST = 1e-13  # step, as part of the time reached or a second, that no longer moves the time [-]
_LOOK = 100  # steps after which the way done is looked at
_NOWHERE = 1e-4  # share of the time that all the steps would cover at the present rate, below which they are not taken
_CROSS = 2.0  # time to a singular instant, in usual steps, from which on one step over it is tried
_STILL = 100  # shortest number of steps over the whole time while some joint sticks: what acts must be looked at
_GAP = 0.467  # middle of the widest gap between the stages of DOP853, where a singular instant does least harm


def run(
    system: EquationsOfMotion,
    inputs: Inputs,
    state: ClosedState,
    times: Array,
    *,
    rtol: float,
    atol: float,
    max_steps: int,
    progress: Callable[[float], None] | None,
) -> Trajectory:
    """Integrate from a state at times[0] and return the motion at all times (n,)."""
    steps = _Steps(system, inputs, state, float(times[0]), float(times[-1]), rtol, atol)
    record = Record(system, times)
    record.put(0, steps.node.point, steps.node.v, steps.node.a)
    step = 0
    for step in range(max_steps):
        if record.done == times.size:
            return record.trajectory(state.rank)
        if step % _LOOK == _LOOK - 1 and _hopeless(steps.node.t - times[0], times[-1] - times[0], step / max_steps):
            break
        node = steps.node
        interpolant = steps.advance()
        record.fill(steps.motion, interpolant, node, steps.node)
        steps.accept()
        if progress is not None:
            progress((steps.node.t - float(times[0])) / float(times[-1] - times[0]))
    raise SolverError(
        f"the simulation took {step + 1} steps (of {max_steps}) to get to t = {steps.node.t:.6g} s of "
        f"{times[-1]:.6g} s. "
        "The motion is stiff or not smooth (very stiff springs, a torque with jumps): loosen rtol and "
        "atol, or raise max_steps."
    )


def _hopeless(done: float, whole: float, used: float) -> bool:
    """Tell whether the steps left would hardly begin the way, judged by those used, as a share of all allowed."""
    return bool(done < _NOWHERE * used * whole)


class _Steps:
    """The integrator, restarted whenever the chart changes.

    Attributes:
        node: the state reached so far.
        motion: the rates in the present chart, around the node before while a step is being recorded.
    """

    def __init__(
        self,
        system: EquationsOfMotion,
        inputs: Inputs,
        state: ClosedState,
        start: float,
        end: float,
        rtol: float,
        atol: float,
    ) -> None:
        self.system, self.inputs, self.rank, self.end, self.rtol = system, inputs, state.rank, end, rtol
        f = system.chain.nv - state.rank
        self.atol = np.concatenate([np.full(f, atol + rtol), np.full(f, atol)])  # a chart may begin anywhere: unit 1
        self.h: float | None = None
        self._still = (end - start) / _STILL
        self._watch = Watch(system, inputs, state.rank) if np.any(system.friction) else None
        self.node = self._watch.start(state, start) if self._watch else first_node(system, inputs, state, start)
        self._recentre()

    def advance(self) -> Callable[[], Interpolant]:
        """Take one step, at most to where friction changes, and return what gives its interpolant."""
        interpolant = self._step()
        if self._watch is None:
            return interpolant
        way = interpolant()
        event = self._watch.event(self.motion, way, self.node)
        if event is not None:
            self.node, self._solver = self._watch.start(*event), None
        return lambda: way

    def _step(self) -> Callable[[], Interpolant]:
        """Take one step and return what gives its interpolant."""
        crossed = self._crossed()
        if crossed is not None:
            self.node, self._solver = crossed.node, None
            return crossed.way
        for _ in range(_RETRIES):
            solver = self._solver = self._solver or self._start()
            solver.max_step = _longest(self.node, solver.h_abs)
            if self.motion.slip is not None and self.motion.slip.stuck.size:
                solver.max_step = min(solver.max_step, self._still)
            message = solver.step()
            if solver.status == "failed":
                raise failure(self.node, self.rank, message or "")
            reached = next_node(self.motion, solver.t, solver.y)
            if reached is not None and is_smooth(self.system, self.node, reached):
                motion, h = self.motion, reached.t - self.node.t
                self.node, self.h = reached, solver.h_abs
                return lambda: refine(motion, h, solver.dense_output())
            self.h, self._solver = 0.25 * (solver.t - self.node.t), None
            if self.h < _SHORTEST * max(1.0, abs(self.node.t)):
                break
        raise failure(self.node, self.rank, "the step cannot be made short enough")

    def _crossed(self) -> Crossing | None:
        """Take a step over a singular instant near ahead; None when there is none or it cannot be taken."""
        if self.h is None or self.node.ahead > 1.5 * _CROSS * self.h:
            return None
        ahead = singular_ahead(self.motion, 2.0 * _CROSS * self.h)
        if ahead is None or ahead > _CROSS * self.h or self.node.t + 2.0 * ahead > self.end:
            return None
        self._recentre()
        return step_over(self.motion, 2.0 * ahead, self.rtol, self.atol)

    def accept(self) -> None:
        """Go on from the node reached; change the chart when it is worn."""
        self.motion.node = self.node
        if self._solver is None or self.motion.worn(self.node.point):
            self._recentre()

    def _recentre(self) -> None:
        chart = self.system.manifold.chart_at(self.node.point, self.rank)
        slip = self._watch.slip if self._watch else None
        self.motion, self._solver = ChartMotion(self.system, self.inputs, self.rank, chart, self.node, slip), None

    def _start(self) -> Any:
        from scipy.integrate import DOP853

        h = None if self.h is None else min(self.h, self.end - self.node.t)
        made: Any = DOP853  # its stubs know scalar tolerances only
        return made(
            self.motion.rate, self.node.t, self.motion.start(), self.end, rtol=self.rtol, atol=self.atol, first_step=h
        )


def _longest(node: Node, h: float) -> float:
    """Return the longest next step, so that a singular instant ahead falls into the gap between the stages.

    At a distance d from it the round-off of the closures is magnified by 1/d^2 in the accelerations.
    """
    place = node.ahead / h
    if place > 1.0 + _GAP or 0.9 * _GAP < place < 1.1 * _GAP:
        return np.inf
    if place <= _GAP:
        return node.ahead / _GAP
    return (place - _GAP) * h
