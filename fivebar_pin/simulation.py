"""Forward dynamics and simulation of any closed chain, driven, under-driven or free.

Accelerations come from the null space of the closure Jacobian, so every mobility is handled alike. The simulation
integrates independent coordinates of the closed configurations, adaptively; all other coordinates are solved from
the closures at every evaluation, so that the loops stay closed to round-off and there is no drift to stabilise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, finite, integer, number, numeric
from fivebar_pin._energy import EnergyBalance, energy_balance
from fivebar_pin._integration import run
from fivebar_pin._manifold import Point
from fivebar_pin._motion_in_chart import Inputs, State
from fivebar_pin._springs import JointSpring, Spring
from fivebar_pin._system import System, Wrench, check_frame, checked_wrench
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.trajectory import Trajectory

__all__ = ["EnergyBalance", "JointSpring", "Spring", "energy_balance", "forward_dynamics", "simulate"]

Torque = npt.ArrayLike | Callable[[float, Array, Array], npt.ArrayLike] | None

_CLOSED = 1e-8  # closure residual and velocity mismatch that a given state may have [-]


@finite()
def forward_dynamics(
    chain: ClosedChain,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    tau: npt.ArrayLike | None = None,
    *,
    external: Mapping[str, npt.ArrayLike] | None = None,
    springs: Iterable[Spring | JointSpring] = (),
) -> Array:
    """Compute the joint accelerations of the closed chain, a = N w + a_c with (N^T M N) w = N^T (...).

    Gravity, armature, viscous damping and dry friction are taken from the chain's model; dry friction is -f sign(v),
    none at rest, as in `inverse_dynamics` (`simulate` lets joints stick). The mechanism may have any number of motors:
    the tangent space of the closures is used, not the actuated joints.

    Args:
        chain: the mechanism.
        q: closed configuration (nq,) or (n, nq).
        v: velocity that keeps it closed (nv,) or (n, nv).
        tau: torque of the actuated joints (na,) or (n, na), one number where there is one motor [N m or N]; no torque
            unless given.
        external: forces from outside: frame name -> wrench (6,) or (n, 6), force [N] and moment [N m] in world axes at
            the frame's origin.
        springs: springs and dampers.

    Returns:
        Accelerations (nv,) or (n, nv) [rad/s2 or m/s2].

    Raises:
        InvalidInputError: wrong shapes; q not closed or v not consistent with the closures; a motion without inertia.
        SingularityError: q is a bifurcation, where the motion is not determined.
    """
    system = System.of(chain, tuple(springs))
    Q = numeric("q", q)
    single = Q.ndim == 1
    Q = checked("q", np.atleast_2d(Q), (None, chain.nq))
    n = Q.shape[0]
    V = checked("v", np.atleast_2d(numeric("v", v)), (n, chain.nv))
    if not n:
        return np.zeros((0, chain.nv))
    given = _torque(chain, tau)
    T = checked("tau", np.broadcast_to(given, (n, chain.na)) if given.shape == (chain.na,) else given, (n, chain.na))
    point = system.manifold.at(Q)
    _require_consistent(system, point, V)
    applied = system.wrench_forces(point, checked_wrench(chain, external, n))
    applied[:, chain.actuated_index] += T
    a = system.accelerations(point, V, applied, system.manifold.rank_of(point))
    return np.asarray(a[0]) if single else a


@finite(open=("N",))
def simulate(
    chain: ClosedChain,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    tau: Torque = None,
    t: npt.ArrayLike | None = None,
    *,
    springs: Iterable[Spring | JointSpring] = (),
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
        springs: springs and dampers.
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
    integer("max_steps", max_steps, least=1)
    system = System.of(chain, tuple(springs))
    for frame in external or {}:
        check_frame(chain, frame)
    state = _initial_state(system, checked("q", q, (chain.nq,)), checked("v", v, (chain.nv,)), initial)
    inputs = Inputs(tau if callable(tau) else _torque(chain, tau), dict(external or {}))
    return run(system, inputs, state, times, rtol=rtol, atol=atol, max_steps=max_steps, progress=progress)


def _torque(chain: ClosedChain, tau: npt.ArrayLike | None) -> Array:
    """Return a constant torque as an array: zeros where none is given, one number as that of the only motor."""
    given = np.zeros(chain.na) if tau is None else numeric("tau", tau)
    return given.reshape(1) if given.ndim == 0 and chain.na == 1 else given


def _initial_state(system: System, q: Array, v: Array, initial: str) -> State:
    """Return the state brought to round-off, once it is consistent or asked to be made so."""
    manifold = system.manifold
    if initial == "check":
        _require_consistent(system, manifold.at(np.array(q[None])), v[None])
    point = manifold.project(q, 1e-12)
    rank = manifold.rank_of(point)
    if rank == system.chain.nv:
        raise InvalidInputError("mobility", 0, "must be at least one: the mechanism cannot move")
    return State(point, system.project_velocity(point, v, rank), rank)


def _require_consistent(system: System, point: Point, v: Array) -> None:
    loops, scale = system.manifold.loops, system.manifold.scale
    if not loops.m:
        return
    gap = np.abs(point.residual).max(axis=1)
    worst = int(np.argmax(gap))
    if gap[worst] > _CLOSED * max(1.0, loops.length):
        name, size = loops.worst(point.residual[worst])
        raise InvalidInputError(
            f"closure {name} at state {worst}",
            size,
            f"must be below {_CLOSED:g} m or rad",
            "Use assemble, or simulate(initial='project').",
        )
    u = v / scale
    rate = np.abs(point.s * np.einsum("nrk,nk->nr", point.Vt[:, : point.s.shape[1]], u)).max(axis=1)
    bound = _CLOSED * np.maximum(np.abs(u).max(axis=1), 1e-300)
    worst = int(np.argmax(rate - bound))
    if rate[worst] > bound[worst]:
        raise InvalidInputError(
            f"rate of the closures at state {worst}",
            float(rate[worst]),
            "must vanish: this velocity opens the loops",
            "Use v = complement(chain, q) @ v_actuated, or simulate(initial='project').",
        )
