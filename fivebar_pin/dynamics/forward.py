"""Forward dynamics of any closed chain, driven, under-driven or free.

Where the motors determine the motion, accelerations come from theirs; elsewhere from the null space of the closure
Jacobian, so that every mobility is handled.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import TINY, Array, checked, finite, numeric
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.equations import EquationsOfMotion
from fivebar_pin.dynamics.motor_equations import motor_equations
from fivebar_pin.dynamics.wrenches import checked_wrenches
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.mechanism.closing import closed_enough
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.rank import raised

__all__ = ["CLOSED", "constant_torque", "forward_dynamics", "require_closed", "require_consistent"]


_LIGHT = 1e-5  # diagonal of the factor of the reduced inertia, of unit diagonal, that is far from singular [-]
CLOSED = 1e-8
"""Closure residual and velocity mismatch that a given state may have [-]."""


@finite()
def forward_dynamics(
    chain: ClosedChain,
    q: npt.ArrayLike,
    v: npt.ArrayLike,
    tau: npt.ArrayLike | None = None,
    *,
    external: Mapping[str, npt.ArrayLike] | None = None,
) -> Array:
    """Compute the joint accelerations of the closed chain, a = N w + a_c with (N^T M N) w = N^T (...).

    Gravity, armature, viscous damping, dry friction and springs are taken from the chain; dry friction is -f sign(v),
    none at rest, as in `inverse_dynamics` (`simulate` lets joints stick). The mechanism may have any number of motors:
    where they do not determine the motion, the tangent space of the closures is used in place of their coordinates.

    Args:
        chain: the mechanism.
        q: closed configuration (nq,) or (n, nq).
        v: velocity that keeps it closed (nv,) or (n, nv).
        tau: torque of the actuated joints (na,) or (n, na), one number where there is one motor [N m or N]; no torque
            unless given.
        external: forces from outside: frame name -> wrench (6,) or (n, 6), force [N] and moment [N m] in world axes at
            the frame's origin.

    Returns:
        Accelerations (nv,) or (n, nv) [rad/s2 or m/s2].

    Raises:
        InvalidInputError: wrong shapes; q not closed or v not consistent with the closures; a motion without inertia.
        SingularityError: q is a bifurcation, where the motion is not determined.
        SolverError: a spring whose ends meet has a force of no direction.
    """
    Q = numeric("q", q)
    single = Q.ndim == 1
    Q = checked("q", np.atleast_2d(Q), (None, chain.nq))
    n = Q.shape[0]
    V = checked("v", np.atleast_2d(numeric("v", v)), (n, chain.nv))
    if not n:
        return np.zeros((0, chain.nv))
    given = constant_torque(chain, tau)
    T = checked("tau", np.broadcast_to(given, (n, chain.na)) if given.shape == (chain.na,) else given, (n, chain.na))
    acting = checked_wrenches(chain, external, n)
    a = _by_motors(chain, Q, V, T, acting)
    if a is None:
        a = _by_tangent_space(chain, Q, V, T, acting)
    return np.asarray(a[0]) if single else a


def _by_motors(chain: ClosedChain, q: Array, v: Array, tau: Array, external: Mapping[str, Array]) -> Array | None:
    """Return accelerations from those of the motors; None where they do not determine the motion, or hardly."""
    found = motor_equations(chain, q, v, external, CLOSED)
    if found is None:
        return None
    size = np.sqrt(np.maximum(np.einsum("nii->ni", found.inertia), 0.0))
    if not np.all(size > 0.0):
        return None
    unit = found.inertia / (size[:, :, None] * size[:, None, :])
    try:
        L = np.linalg.cholesky(unit)
    except np.linalg.LinAlgError:
        return None
    if not np.all(np.einsum("nii->ni", L) > _LIGHT):
        return None
    free = np.linalg.solve(unit, ((tau - found.bias) / size)[..., None])[..., 0] / size
    return np.asarray(found.rest + np.matmul(found.N, free[..., None])[..., 0])


def _by_tangent_space(chain: ClosedChain, q: Array, v: Array, tau: Array, external: Mapping[str, Array]) -> Array:
    """Return accelerations from the tangent space of the closures, whatever is driven."""
    system = EquationsOfMotion.of(chain)
    point = system.manifold.at(q)
    require_consistent(point, v)
    applied = system.wrench_forces(point, external)
    applied[:, chain.actuated_index] += tau
    return system.accelerations(point, v, applied, system.manifold.rank_of(point))


def constant_torque(chain: ClosedChain, tau: npt.ArrayLike | None) -> Array:
    """Return a constant torque as an array: zeros where none is given, one number as that of the only motor."""
    given = np.zeros(chain.na) if tau is None else numeric("tau", tau)
    return given.reshape(1) if given.ndim == 0 and chain.na == 1 else given


def require_consistent(point: Configurations, v: Array) -> None:
    """Raise unless configurations are closed and velocities v (n, nv) keep them so.

    Raises:
        InvalidInputError: names the closure, or the rate, and the state.
    """
    loops = point.loops
    if not loops.m:
        return
    require_closed(point)
    u = v / loops.column_scale
    rate = point.independent.rate(u)
    bound = raised(CLOSED, loops.misfit) * np.maximum(np.abs(u).max(axis=1), TINY)
    worst = int(np.argmax(rate - bound))
    if rate[worst] > bound[worst]:
        raise InvalidInputError(
            f"rate of the closures at state {worst}",
            float(rate[worst]),
            "must vanish: this velocity opens the loops",
            "Use v = complement(chain, q) @ v_actuated, or simulate(initial='project').",
        )


def require_closed(point: Configurations) -> None:
    """Raise unless configurations are closed.

    Raises:
        InvalidInputError: names the closure and the state.
    """
    loops = point.loops
    worst = int(np.argmax(point.gap)) if point.gap.size else 0
    if loops.m and point.gap.size and not closed_enough(loops, point.gap, CLOSED)[worst]:
        name, size = loops.worst(point.residual[worst])
        raise InvalidInputError(
            f"closure {name} at state {worst}",
            size,
            f"must be below {CLOSED:g} m or rad",
            "Use assemble, or simulate(initial='project').",
        )
