"""Inverse dynamics by the natural orthogonal complement, body by body and compiled [Angeles and Lee 1988, (44)].

    tau = sum_i T_i^T (n_i, f_i) + N^T (armature, losses, springs),        t_i = T_i v_a

Newton and Euler are asked of every body in world axes; no line of it is Pinocchio's. Where the closures say more than
the passive coordinates take, or less, N is not theirs alone: the torques are then N^T of what the open tree needs.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fivebar_pin._arrays import Array, require_finite
from fivebar_pin.chain import ClosedChain
from fivebar_pin.dynamics.compiled_calls import in_pieces, outside, told_by_closures
from fivebar_pin.dynamics.loads import Loads
from fivebar_pin.engine.tables import NA, NV, unwritten
from fivebar_pin.mechanism.prepared import Prepared, prepared_of
from fivebar_pin.trajectory import Trajectory

__all__ = ["by_complement"]


def by_complement(
    chain: ClosedChain, trajectory: Trajectory, about: Array, external: Mapping[str, Array], threads: int | None
) -> Loads:
    """Return the loads along a trajectory; see `inverse_dynamics`."""
    prepared = prepared_of(chain)
    na, nv = int(prepared.I[NA]), int(prepared.I[NV])
    table = np.empty((len(trajectory), na + 12 + nv))
    _fill(chain, prepared, trajectory, about, external, threads, table)
    if not told_by_closures(chain):
        table[:, :na] = np.matmul(np.swapaxes(trajectory.N, 1, 2), table[:, na + 12 :, None])[..., 0]
    finite = np.isfinite(table).all()
    table.setflags(write=False)
    found = Loads(
        torque=table[:, :na],
        shaking_force=table[:, na : na + 3],
        shaking_moment=table[:, na + 3 : na + 6],
        frame_force=table[:, na + 6 : na + 9],
        frame_moment=table[:, na + 9 : na + 12],
        about=about,
        chain=chain,
        trajectory=trajectory,
        tree_torque=table[:, na + 12 :],
        external=external,
    )
    if not finite:
        require_finite("inverse_dynamics", found, ("N", "torque"))
    return found


def _fill(
    chain: ClosedChain, prepared: Prepared, path: Trajectory, about: Array, external: Mapping[str, Array],
    threads: int | None, table: Array,
) -> None:  # fmt: skip
    """Write the table of `engine.entries.loads`."""
    from fivebar_pin.engine.entries import loads

    q, v, a, N = (unwritten(x) for x in (path.q, path.v, path.a, path.N))
    links, points, wrenches = outside(chain, external, len(table))

    def work(k: slice) -> int:
        motion = prepared.I, prepared.memory(), q[k], v[k], a[k], N[k]
        return loads(*motion, about, links, points, wrenches[k], table[k])

    in_pieces(chain, len(table), threads, work)
