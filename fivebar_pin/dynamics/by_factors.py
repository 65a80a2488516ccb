"""Reactions by the factors of the passive columns, compiled, and what structural redundancy leaves open of them.

Rows that say nothing anywhere, such as the one out of the plane of a planar loop, are constant combinations of rows of
one closure; where the others are as many as the passive coordinates take, the closure forces of least norm are those
in the others. What the closures can strain each other with besides is a force or a moment of constant direction in the
axes of frame 1, and the joints of their loop feel it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures.frame_closure import AnchoredFrames
from fivebar_pin.closures.rows import Row
from fivebar_pin.dynamics.compiled_calls import in_pieces, outside, told_by_closures
from fivebar_pin.engine.tables import BLOCK_SIZE, BLOCKS, BLOCKS_END, LINK_SIZE, LINKS, MIX, Integers, unwritten
from fivebar_pin.mechanism.links import bodies_of, links_of
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.mechanism.per_chain import once_per_chain
from fivebar_pin.mechanism.prepared import prepared_of
from fivebar_pin.trajectory import Trajectory

__all__ = ["Structure", "carried_by_factors", "seen_by_structure", "structure_of"]

_WEAK = 1e-6  # scaled pivot below which the rank of the closures is decided by their singular values [-]


@dataclass(frozen=True, eq=False)
class Structure(Immutable):
    """What is constant about the reactions of a chain.

    Attributes:
        bodies: records of the links that carry the bodies (nb,).
        axes: of these links in those of their joints, matrix after matrix (9 nb,).
        free: closures that can be strained, and whether by a moment, else by a force (k, 2).
        directions: of the unit strain, in the axes of frame 1; of a moment, in chain lengths (k, 3) [- or m].
        reach: whether a joint or closure feels it (nb + closures, k).
    """

    bodies: Integers
    axes: Array
    free: Integers
    directions: Array
    reach: Integers


@once_per_chain
def structure_of(chain: ClosedChain) -> Structure | None:
    """Return what is constant about the reactions; None where the closures are to be decomposed at every sample."""
    prepared, loops = prepared_of(chain), loops_of(chain)
    I, blocks = prepared.I, range(int(prepared.I[BLOCKS]), int(prepared.I[BLOCKS_END]), BLOCK_SIZE)
    strains = [_strain(chain, weights) for weights in prepared.vanishing]
    known = [strain for strain in strains if strain is not None]
    if not told_by_closures(chain) or any(I[g + MIX] >= 0 for g in blocks) or len(known) < len(strains):
        return None
    carriers = bodies_of(links_of(chain.model))
    bodies, count = range(1, chain.model.njoints), len(loops.anchored)
    reach = np.zeros((len(bodies) + count, len(known)), dtype=np.int64)
    for k, (c, _, _) in enumerate(known):
        one, two = (_ancestors(chain, j) for j in loops.anchored[c].joints)
        reach[[j - 1 for j in one ^ two], k], reach[len(bodies) + c, k] = 1, 1
    return Structure(
        np.array([I[LINKS] + LINK_SIZE * carriers[j][0] for j in bodies], dtype=np.int64),
        np.array([carriers[j][1].T for j in bodies]).ravel(),
        np.array([(c, moment) for c, moment, _ in known], dtype=np.int64).reshape(len(known), 2),
        np.array([direction for *_, direction in known]).reshape(len(known), 3),
        reach,
    )


def _ancestors(chain: ClosedChain, j: int) -> set[int]:
    """Return a joint and those that carry it, without the ground."""
    found = set()
    while j:
        found.add(j)
        j = int(chain.model.parents[j])
    return found


def _strain(chain: ClosedChain, weights: Array) -> tuple[int, bool, Array] | None:
    """Return closure, whether it is a moment, and direction in frame 1 of what vanishing rows stand for.

    None where the direction is not constant.
    """
    loops = loops_of(chain)
    c = next(k for k, anchored in enumerate(loops.anchored) if np.any(weights[anchored.rows]))
    anchored = loops.anchored[c]
    if not isinstance(anchored, AnchoredFrames):
        return None
    rows, own = anchored.closure.rows, weights[anchored.rows]
    direction = np.sum([w * row.direction for w, row in zip(own, rows, strict=True)], axis=0)
    (sort,) = {row.sort for w, row in zip(own, rows, strict=True) if w}
    if sort == "along":
        return c, False, direction
    if sort == "turned":
        return c, True, loops.length * direction
    axis = _axis(rows) if sort == "tilt" else None
    return None if axis is None else (c, True, loops.length * np.cross(axis, direction))


def _axis(rows: Sequence[Row]) -> Array | None:
    """Return the vector of frame 2 of two tilts, in the axes of frame 1 where the closure is met; None for one tilt."""
    tilts = [row for row in rows if row.sort == "tilt"]
    if len(tilts) != 2 or any(row.number for row in tilts) or np.any(tilts[0].other != tilts[1].other):
        return None
    normal = np.cross(tilts[0].direction, tilts[1].direction)
    return np.asarray(normal / np.linalg.norm(normal))


def carried_by_factors(
    chain: ClosedChain, structure: Structure, trajectory: Trajectory, external: Mapping[str, Array]
) -> tuple[Array, Array, Array] | None:
    """Return multipliers (n, m), wrenches in joints and closures at their points and what is left in the joints.

    Wrenches (n, nb + closures, 6) are in world axes; left (n, nv) are the torques of the motors. None where a
    configuration is singular, or nearly so.
    """
    from fivebar_pin.engine.reactions import reactions

    prepared, n = prepared_of(chain), len(trajectory)
    q, v, a = (unwritten(x) for x in (trajectory.q, trajectory.v, trajectory.a))
    links, points, wrenches = outside(chain, external, n)
    forces, carried = np.empty((n, len(prepared.mixed))), np.empty((n, 6 * len(structure.reach)))
    left, weakest = np.empty((n, chain.nv)), np.empty(n)

    def work(k: slice) -> int:
        motion = prepared.I, prepared.memory(), q[k], v[k], a[k], structure.bodies
        return reactions(*motion, links, points, wrenches[k], forces[k], carried[k], left[k], weakest[k])

    in_pieces(chain, n, None, work)
    if not np.all(weakest > _WEAK):
        return None
    multipliers = (forces @ prepared.mixed) * loops_of(chain).row_scale
    return multipliers, carried.reshape(n, -1, 6), left


def seen_by_structure(
    chain: ClosedChain, structure: Structure, q: Array, carried: Array, bounds: tuple[float, float], *, turned: bool
) -> Array:
    """Return wrenches as they are seen, nan where more than the bounds of a unit strain is felt.

    Args:
        chain, structure: the mechanism.
        q: configurations (n, nq).
        carried: wrenches of joints and closures at their points, world axes (n, nb + closures, 6).
        bounds: for forces and for moments [- and m].
        turned: in the axes of the joint or of frame 1 of the closure, else in those of the world.
    """
    from fivebar_pin.engine.reactions import marks

    prepared, q, s = prepared_of(chain), unwritten(q), structure
    given = unwritten(carried.reshape(len(q), -1))
    seen, limits = np.empty(given.shape), np.square(bounds)

    def work(k: slice) -> int:
        places = np.empty(12 * len(s.reach))
        strain = s.bodies, s.axes, s.free, s.directions, s.reach, limits, int(turned), places
        marks(prepared.I, prepared.memory(), q[k], *strain, given[k], seen[k])
        return -1

    in_pieces(chain, len(q), None, work)
    return seen.reshape(carried.shape)
