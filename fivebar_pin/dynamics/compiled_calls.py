"""Calling what is compiled: trajectories and forces from outside as it takes them, piece by piece in threads."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from fivebar_pin._arrays import Array, seal
from fivebar_pin.chain import ClosedChain, find_frame
from fivebar_pin.dynamics.elastic import undirected
from fivebar_pin.engine.tables import BLOCK_SIZE, BLOCKS, BLOCKS_END, HEIGHT, WIDTH, Integers
from fivebar_pin.engine.threads import each, threads_of
from fivebar_pin.mechanism.links import bodies_of, links_of
from fivebar_pin.mechanism.per_chain import once_per_chain
from fivebar_pin.mechanism.prepared import prepared_of

__all__ = ["CHUNK", "Outside", "in_pieces", "outside", "told_by_closures"]

Outside = tuple[Integers, Array, Array]
"""Forces from outside as the engine takes them: links (k,), points in their axes (k, 3), wrenches (n, k, 6)."""

CHUNK = 4096
"""Samples that a thread works on at a time."""


def in_pieces(chain: ClosedChain, n: int, threads: int | None, work: Callable[[slice], int]) -> None:
    """Do some work for n samples, piece by piece where they are many; it tells a spring without direction, or -1.

    Raises:
        SolverError: a spring whose ends meet has a force of no direction.
    """
    lost: list[int] = []
    if n <= CHUNK:
        lost.append(work(slice(0, n)))
    else:
        each(lambda i: lost.append(work(slice(i * CHUNK, (i + 1) * CHUNK))), -(-n // CHUNK), threads_of(threads))
    found = [spring for spring in lost if spring >= 0]
    if found:
        raise undirected(chain.springs[min(found)].name)


def outside(chain: ClosedChain, external: Mapping[str, Array], n: int) -> Outside:
    """Return wrenches (n, 6) by frame as the engine takes them."""
    if not external:
        return _NO_LINKS, _NO_POINTS, np.empty((n, 0, 6))
    bodies = bodies_of(links_of(chain.model))
    frames = [find_frame(chain.model, name) for name in external]
    carried = [bodies[int(f.parentJoint)] for f in frames]
    points = np.array([axes.T @ f.placement.translation for (_, axes), f in zip(carried, frames, strict=True)])
    found = np.array([link for link, _ in carried], dtype=np.int64), points
    seal(found)
    return *found, np.stack([*external.values()], axis=1)


_NO_LINKS, _NO_POINTS = np.zeros(0, dtype=np.int64), np.zeros((0, 3))
seal((_NO_LINKS, _NO_POINTS))


@once_per_chain
def told_by_closures(chain: ClosedChain) -> bool:
    """Tell whether there are as many independent closure rows as passive coordinates, so that N is what they say."""
    I = prepared_of(chain).I
    blocks = range(int(I[BLOCKS]), int(I[BLOCKS_END]), BLOCK_SIZE)
    square = all(I[g + HEIGHT] == I[g + WIDTH] for g in blocks)
    return bool(square and sum(int(I[g + WIDTH]) for g in blocks) == chain.nv - chain.na)
