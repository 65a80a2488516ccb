"""Assembly modes: the distinct ways of closing the loops."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, finite
from fivebar_pin.chain import ClosedChain
from fivebar_pin.kinematics.assemble import checked_search, closed_from_starts
from fivebar_pin.mechanism.closing import CLOSED, most_open, residual_of
from fivebar_pin.mechanism.idle import at_rest
from fivebar_pin.mechanism.loops import Loops

__all__ = ["assembly_modes"]


_SAME = 1e-6  # difference up to which two closed configurations are one [rad, or chain lengths]
_BETWEEN = (0.25, 0.5, 0.75)  # places on the way from one to the other
_TOLD = 10.0  # residual there, in closure tolerances, up to which they are not told apart [-]


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
        if not modes or not _among(loops, np.array(modes), candidate, most_open(loops, tolerance)):
            modes.append(candidate)
    modes.sort(key=lambda c: np.round(c, 9).tolist())
    return np.stack(modes) if modes else np.zeros((0, chain.nq))


def _among(loops: Loops, modes: Array, q: Array, most: float) -> bool:
    """Whether a configuration (nq,) is one of some (k, nq): the straight way to it is closed all along.

    Whole turns count for nothing. Where two configurations are folded so far that the residual does not tell them
    apart, they are one; so are those between which something only spins that moves nothing else.
    """
    away = loops.tree.difference(modes, np.broadcast_to(q, modes.shape))
    angles = [k for k in range(loops.tree.nv) if loops.tree.is_angle(k)]
    away[:, angles] -= 2.0 * np.pi * np.round(away[:, angles] / (2.0 * np.pi))
    open_by = [residual_of(loops, loops.tree.integrate(modes, s * away)) for s in _BETWEEN]
    sizes = np.abs(np.array(open_by) * loops.unit).max(axis=(0, 2), initial=0.0)
    near = np.abs(away / loops.column_scale).max(axis=1, initial=0.0) < _SAME
    return bool(np.any(near | (sizes <= _TOLD * most)))
