"""Simulation of any closed chain, driven, under-driven or free.

The simulation integrates independent coordinates of the closed configurations, adaptively; all other coordinates are
solved from the closures at every evaluation, so that the loops stay closed to round-off and there is no drift to
stabilise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, finite, integer, number
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.equations import EquationsOfMotion
from fivebar_pin.dynamics.forward import constant_torque, require_consistent
from fivebar_pin.dynamics.wrenches import Wrench, require_frames
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.mechanism.closing import CLOSED
from fivebar_pin.simulation.chart_motion import ClosedState, Inputs
from fivebar_pin.simulation.integrator import run
from fivebar_pin.trajectory import Trajectory

__all__ = ["Torque", "simulate"]


Torque = npt.ArrayLike | Callable[[float, Array, Array], npt.ArrayLike] | None


@finite(open=("N",))
def simulate(
    chain: ClosedChain,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    tau: Torque = None,
    t: npt.ArrayLike | None = None,
    *,
    external: Mapping[str, Wrench] | None = None,
    initial: Literal["check", "project"] = "check",
    rtol: float = 1e-11,
    atol: float = 1e-13,
    max_steps: int = 1_000_000,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Integrate the motion of the mechanism from a given state.

    Forces are as in `forward_dynamics`. Joints with dry friction slip or stick; the instants at which they change are
    found, and joints at rest are settled together by Gauss's principle.

    Args:
        chain: the mechanism, with any number of motors.
        q: configuration at t[0] (nq,).
        v: velocity at t[0] (nv,).
        tau: torque of the actuated joints: constant (na,), one number where there is one motor, or a function
            (t, q, v) of either [N m or N]; no torque unless given.
        t: increasing output times (n,) [s]; always needed.
        external: forces from outside: frame name -> wrench (6,) or a function (t, q, v) -> (6,), force [N] and moment
            [N m] in world axes at the frame's origin.
        initial: "check" refuses a state that does not keep the loops closed; "project" moves it to a near one that
            does (the velocity as a sudden closing of the loops would leave it).
        rtol, atol: error allowed per step: rtol + atol of the independent coordinates [rad, or chain lengths], and
            rtol |rate| + atol of their rates.
        max_steps: bound on the number of steps.
        progress: called with the done fraction of the time span, 0 to 1, after every step.

    Returns:
        q, v, a at the output times, loops closed to round-off. N is the complement of the actuated joints; nan where
        they do not determine the motion.

    Raises:
        InvalidInputError: wrong shapes, times that do not increase, an inconsistent initial state, a torque that is
            not finite, a mechanism that cannot move.
        SingularityError: the motion meets a bifurcation that it cannot be followed through.
        SolverError: the integrator fails.
    """
    if t is None:
        raise InvalidInputError("t", t, "must be the output times [s]", "Without a torque: simulate(chain, q, v, t=t).")
    times = checked("t", t, (None,))
    if times.size < 1 or np.any(np.diff(times) <= 0.0):
        raise InvalidInputError("t", times.tolist()[:5], "must hold one or more increasing times")
    for name, value in (("rtol", rtol), ("atol", atol)):
        if not 0.0 < number(name, value) < 1.0:
            raise InvalidInputError(name, value, "must lie between 0 and 1")
    integer("max_steps", max_steps, least=1)
    if initial not in ("check", "project"):
        raise InvalidInputError("initial", initial, "must be 'check' or 'project'")
    system = EquationsOfMotion.of(chain)
    require_frames(chain, external or {})
    state = _initial_state(system, checked("q", q, (chain.nq,)), checked("v", v, (chain.nv,)), initial)
    inputs = Inputs(tau if callable(tau) else constant_torque(chain, tau), dict(external or {}))
    return run(system, inputs, state, times, rtol=rtol, atol=atol, max_steps=max_steps, progress=progress)


def _initial_state(system: EquationsOfMotion, q: Array, v: Array, initial: str) -> ClosedState:
    """Return the state brought to round-off, once it is consistent or asked to be made so."""
    manifold = system.manifold
    if initial == "check":
        require_consistent(manifold.at(np.array(q[None])), v[None])
    point = manifold.project(q, CLOSED)
    rank = manifold.rank_of(point)
    if rank == system.chain.nv:
        raise InvalidInputError("mobility", 0, "must be at least one: the mechanism cannot move")
    return ClosedState(point, system.project_velocity(point, v, rank), rank)
