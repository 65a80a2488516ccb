"""Inverse dynamics by the natural orthogonal complement, body by body and compiled [Angeles and Lee 1988, (44)].

    tau = sum_i T_i^T (n_i, f_i) + N^T (armature, losses, springs),        t_i = T_i v_a

Newton and Euler are asked of every body in world axes; no line of it is Pinocchio's. Where the closures say more than
the passive coordinates take, or less, N is not theirs alone: the torques are then N^T of what the open tree needs.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from fivebar_pin._arrays import Array, require_finite, seal
from fivebar_pin.chain import ClosedChain, find_frame
from fivebar_pin.dynamics.elastic import undirected
from fivebar_pin.dynamics.loads import Loads
from fivebar_pin.engine.tables import BLOCK_SIZE, BLOCKS, BLOCKS_END, HEIGHT, NA, NV, WIDTH, Integers
from fivebar_pin.mechanism.links import links_of
from fivebar_pin.mechanism.per_chain import once_per_chain
from fivebar_pin.mechanism.prepared import Prepared, prepared_of
from fivebar_pin.trajectory import Trajectory

__all__ = ["Outside", "by_complement", "compact", "outside"]

Outside = tuple[Integers, Array, Array]
"""Forces from outside as the engine takes them: links (k,), points in their axes (k, 3), wrenches (n, k, 6)."""

_CHUNK = 4096  # samples that a thread works on at a time
_NONE: Outside = (np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros((1, 0, 6)))
seal(_NONE)


def by_complement(
    chain: ClosedChain, trajectory: Trajectory, about: Array, external: Mapping[str, Array], threads: int | None
) -> Loads:
    """Return the loads along a trajectory; see `inverse_dynamics`."""
    prepared, n = prepared_of(chain), len(trajectory)
    na, nv = int(prepared.I[NA]), int(prepared.I[NV])
    table = np.empty((n, na + 12 + nv))
    _fill(chain, prepared, trajectory, about, external, threads, table)
    if not _told_by_closures(chain):
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
    chain: ClosedChain,
    prepared: Prepared,
    path: Trajectory,
    about: Array,
    external: Mapping[str, Array],
    threads: int | None,
    table: Array,
) -> None:
    """Write the table of `engine.entries.loads`, piece by piece where it is long.

    Raises:
        SolverError: a spring whose ends meet has a force of no direction.
    """
    from fivebar_pin.engine.entries import loads

    q, v, a, N = (compact(x) for x in (path.q, path.v, path.a, path.N))
    links, points, wrenches = outside(chain, external) if external else _NONE
    n, I = table.shape[0], prepared.I

    def piece(start: int) -> int:
        k = slice(start, start + _CHUNK)
        given = wrenches[k] if external else wrenches
        return int(loads(I, prepared.memory(), q[k], v[k], a[k], N[k], about, links, points, given, table[k]))

    if n <= _CHUNK:
        lost = int(loads(I, prepared.memory(), q, v, a, N, about, links, points, wrenches, table))
    else:
        with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
            lost = max(pool.map(piece, range(0, n, _CHUNK)))
    if lost >= 0:
        raise undirected(chain.springs[lost].name)


def compact(rows: Array) -> Array:
    """Return an array row by row in memory, as the engine's compiled code was made for."""
    if not rows.flags.c_contiguous:
        rows = np.ascontiguousarray(rows)
        rows.setflags(write=False)
    return rows


def outside(chain: ClosedChain, external: Mapping[str, Array]) -> Outside:
    """Return wrenches (n, 6) by frame as the engine takes them."""
    links = {0: (0, np.eye(3))} | {x.joint: (j, x.axes) for j, x in enumerate(links_of(chain.model), start=1)}
    frames = [find_frame(chain.model, name) for name in external]
    carried = [links[int(f.parentJoint)] for f in frames]
    points = [axes.T @ f.placement.translation for (_, axes), f in zip(carried, frames, strict=True)]
    found = np.array([link for link, _ in carried], dtype=np.int64), np.array(points), np.stack([*external.values()], 1)
    seal(found)
    return found


@once_per_chain
def _told_by_closures(chain: ClosedChain) -> bool:
    """Tell whether there are as many independent closure rows as passive coordinates, so that N is what they say."""
    I = prepared_of(chain).I
    blocks = range(int(I[BLOCKS]), int(I[BLOCKS_END]), BLOCK_SIZE)
    square = all(I[g + HEIGHT] == I[g + WIDTH] for g in blocks)
    return bool(square and sum(int(I[g + WIDTH]) for g in blocks) == chain.nv - chain.na)
