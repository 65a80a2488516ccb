"""Constrained inverse dynamics, by two roads that share nothing but the trajectory.

With the open tree's inverse dynamics tau_t = M a + h and the complement N,

    tau = N^T tau_t                                  the closure forces do no work           [Angeles and Lee 1988]
    J^T lambda = tau_t - S^T tau                     closure forces from the passive rows
    F = -dp/dt,        M_O = -dH_O/dt                shaking force and moment: inertia alone
    F + m g + f_e,     M_O + c x m g + m_e           frame force and moment: weight and applied forces besides

Frame force and moment are all that the mechanism exerts on the frame; motors and springs are internal to it.

    pinocchio     Pinocchio's recursive Newton-Euler on the open tree, over a batch
    complement    body by body, by the natural orthogonal complement, sample by sample
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import TINY, Array, checked, finite, frozen, integer
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.by_complement import by_complement
from fivebar_pin.dynamics.by_pinocchio import by_pinocchio
from fivebar_pin.dynamics.loads import Loads
from fivebar_pin.dynamics.wrenches import checked_wrenches
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.trajectory import Trajectory

__all__ = ["ROADS", "inverse_dynamics", "roads_apart"]

Road = Callable[[ClosedChain, Trajectory, Array, Mapping[str, Array], int | None], Loads]

ROADS: Mapping[str, Road] = {"pinocchio": by_pinocchio, "complement": by_complement}

_FEW = 100  # samples up to which what Pinocchio's road costs a call is more than what it costs for the samples
_ORIGIN = (0.0, 0.0, 0.0)
_AT_ORIGIN = frozen(_ORIGIN)


def inverse_dynamics(
    chain: ClosedChain,
    trajectory: Trajectory,
    *,
    about: npt.ArrayLike = _ORIGIN,
    external: Mapping[str, npt.ArrayLike] | None = None,
    road: str | None = None,
    threads: int | None = None,
) -> Loads:
    """Compute the actuated torques, what shakes the frame and what it carries along a trajectory.

    Gravity, armature, viscous damping, dry friction and springs are taken from the chain. Springs belong to the
    mechanism: what one that is anchored in the ground pulls there is part of the force on the frame, which is
    -dp/dt + m g with springs as without; they change the torques and the reactions.

    Args:
        chain: the mechanism.
        trajectory: consistent motion, from `drive` or `simulate`.
        about: point (3,) that shaking and frame moment refer to [m], world.
        external: forces applied from outside: frame name -> wrench (n, 6) or (6,), force [N] and moment [N m] in
            world axes at the frame's origin.
        road: "pinocchio" or "complement", which agree to round-off; unless given, the first for many samples and the
            second for few.
        threads: most threads for long trajectories; as many as there are processors unless given. No result depends on
            their number.

    Returns:
        The loads; reactions, energies and centre of mass are computed when asked for.

    Raises:
        InvalidInputError: a trajectory of another mechanism, wrong shapes.
        UnknownNameError: an external force on a frame that does not exist, or another road.
        SolverError: a spring whose ends meet has a force of no direction.
    """
    trajectory.require_of(chain)
    if road is None:
        road = "complement" if len(trajectory) <= _FEW else "pinocchio"
    elif road not in ROADS:
        raise UnknownNameError("road", road, ROADS)
    if threads is not None:
        integer("threads", threads, least=1)
    point = _AT_ORIGIN if about is _ORIGIN else checked("about", about, (3,))
    applied = checked_wrenches(chain, external, len(trajectory))
    return ROADS[road](chain, trajectory, point, applied, threads)


@finite()
def roads_apart(chain: ClosedChain, trajectory: Trajectory) -> float:
    """Return the largest difference of the torques by the two roads, in parts of what adds up to a torque [-]."""
    one, two = (inverse_dynamics(chain, trajectory, road=road) for road in ROADS)
    return float(np.abs(one.torque - two.torque).max(initial=0.0)) / max(one.scale("torque"), TINY)
