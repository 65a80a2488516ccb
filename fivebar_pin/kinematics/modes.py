"""Assembly modes: the distinct ways of closing the loops."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, finite
from fivebar_pin.chain import ClosedChain
from fivebar_pin.kinematics.assemble import checked_search, closed_from_starts
from fivebar_pin.mechanism.closing import CLOSED
from fivebar_pin.mechanism.idle import at_rest
from fivebar_pin.mechanism.loops import Loops
from fivebar_pin.mechanism.tree import Poses

__all__ = ["assembly_modes"]


_SAME = 1e-6  # difference of poses up to which two closed configurations are one [rad, or chain lengths]


@finite()
def assembly_modes(
    chain: ClosedChain,
    q_actuated: npt.ArrayLike,
    *,
    starts: int = 128,
    seed: int = 0,
    tolerance: float = CLOSED,
) -> Array:
    """List the distinct closed configurations found for given actuated coordinates.

    A random search: it finds what its starts lead to, which for the usual planar linkages is every mode.

    Returns:
        Configurations (k, nq), ordered by their coordinates; a five-bar has two. Empty when nothing closes.
    """
    chain = at_rest(chain)
    loops = checked_search(chain, starts, seed, tolerance)
    x = checked("q_actuated", q_actuated, (chain.na,))
    q, _ = closed_from_starts(chain, loops, x, starts, seed, tolerance)
    modes: list[Array] = []
    for candidate in q:
        poses = loops.tree.poses(candidate[None])
        if not any(_same_pose(loops, poses, mode) for mode in modes):
            modes.append(candidate)
    modes.sort(key=lambda c: np.round(c, 9).tolist())
    return np.stack(modes) if modes else np.zeros((0, chain.nq))


def _same_pose(loops: Loops, poses: Poses, other: Array) -> bool:
    """Whether two configurations place every body alike (angles that differ by whole turns do)."""
    b = loops.tree.poses(other[None])
    return all(np.abs(r - s).max() < _SAME for r, s in zip(poses.R, b.R, strict=True)) and all(
        np.abs(r - s).max() < _SAME * loops.length for r, s in zip(poses.p, b.p, strict=True)
    )
