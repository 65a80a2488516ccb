"""The equations of motion in the actuated coordinates, for control: mass matrix and bias.

    M_bar a_a + b = tau,     M_bar = N^T M N,     b = N^T (M a_0 + h)               [Angeles and Lee 1988, (46)]

a_0 being the accelerations of all joints at those velocities when the actuated ones have none, and h all that the open
tree needs besides: Coriolis and centrifugal forces, weight, losses and springs.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, finite, numeric
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.forward import CLOSED, require_closed
from fivebar_pin.dynamics.inverse import inverse_dynamics
from fivebar_pin.dynamics.mass import depth_first, mass_matrix
from fivebar_pin.dynamics.motor_equations import motor_equations
from fivebar_pin.mechanism.complement import rates_of, require_regular
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.idle import at_rest
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.trajectory import Trajectory

__all__ = ["reduced_dynamics"]


@finite()
def reduced_dynamics(chain: ClosedChain, q: npt.ArrayLike, v_actuated: npt.ArrayLike) -> tuple[Array, Array]:
    """Return mass matrix and bias of the mechanism in its actuated coordinates.

    The torques of `inverse_dynamics` along any motion through these states are M_bar a_actuated + bias. Gravity,
    armature, viscous damping and dry friction are taken from the chain's model.

    Args:
        chain: the mechanism, its motion determined by its actuated joints.
        q: closed configuration (nq,) or (n, nq).
        v_actuated: velocity of the actuated joints (na,) or (n, na) [rad/s or m/s].

    Returns:
        M_bar (na, na) or (n, na, na), symmetric, and bias (na,) or (n, na) [N m or N]; order of `chain.actuated`.

    Raises:
        SingularityError: the actuated joints do not determine the motion at q.
        InvalidInputError: wrong shapes, or q not closed.
    """
    chain = at_rest(chain)
    loops, Q = loops_of(chain), numeric("q", q)
    loops.require_determined()
    single = Q.ndim == 1
    Q = checked("q", np.atleast_2d(Q), (None, chain.nq))
    va = checked("v_actuated", np.atleast_2d(numeric("v_actuated", v_actuated)), (Q.shape[0], chain.na))
    v = np.zeros((Q.shape[0], chain.nv))
    v[:, chain.actuated_index] = va
    found = motor_equations(chain, Q, v, {}, CLOSED, driven=True)
    M, bias = _by_all_coordinates(chain, Q, va) if found is None else (found.inertia, found.bias)
    return (np.asarray(M[0]), np.asarray(bias[0])) if single else (M, np.asarray(bias))


def _by_all_coordinates(chain: ClosedChain, q: Array, va: Array) -> tuple[Array, Array]:
    """Return the same through the mass matrix and the inverse dynamics of the open tree."""
    here = Configurations(loops_of(chain), q)
    require_closed(here)
    require_regular(here.passive.sigma)
    v, a, N = rates_of(here, va, np.zeros_like(va))
    states = Trajectory(np.arange(float(len(q))), here.q, v, a, N, here.gap)
    bias = inverse_dynamics(chain, states).torque
    M = np.matmul(np.swapaxes(N, 1, 2), np.matmul(_mass_matrices(chain, here.q), N))
    M = 0.5 * (M + np.swapaxes(M, 1, 2))  # round-off would leave it unsymmetric, which factorisations mind
    return M, bias


def _mass_matrices(chain: ClosedChain, q: Array) -> Array:
    """Return the mass matrices of the open tree, armature included (n, nv, nv)."""
    model, data, ordered = chain.model, chain.model.createData(), depth_first(chain.model)
    M = np.empty((q.shape[0], chain.nv, chain.nv))
    for i in range(q.shape[0]):
        M[i] = mass_matrix(model, data, q[i], ordered=ordered)
    return M
