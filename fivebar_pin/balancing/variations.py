"""Random mass distributions about a mechanism's own, every one of them physical.

A body's pseudo-inertia P is positive semidefinite, and so is A P A^T for any A. With

    A = [[1 + s R, s L r], [0, 1 + s u]],    R, r, u random in [-1, 1], L the chain's length,

material is stretched, sheared, moved and made heavier or lighter by shares of about s.
"""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import Array, frozen, integer, number, require_memory
from fivebar_pin.balancing.parameters import from_pseudo_inertia, pseudo_inertia
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError

__all__ = ["variations"]

_BLOCK = 50_000  # designs at a time
_BEYOND = 10**15  # designs that no machine holds
_COPIES = 4  # of all designs that drawing, freezing and scoring them may hold at once


def variations(chain: ClosedChain, count: int, *, spread: float = 0.2, seed: int = 0) -> Array:
    """Return random designs for `score`: inertial parameters (count, nb, 10), the chain's own first.

    Args:
        chain: the mechanism; its bodies must be physical.
        count: number of designs, at least 1.
        spread: typical relative change s, between 0 and 0.9 [-].
        seed: of the draw.
    """
    count = integer("count", count, least=1)
    if not 0.0 <= number("spread", spread) <= 0.9:
        raise InvalidInputError("spread", spread, "must lie between 0 and 0.9")
    require_memory("count", count, _COPIES * min(count, _BEYOND) * chain.inertial_parameters.nbytes)
    rng = np.random.default_rng(integer("seed", seed))
    own = np.array(chain.inertial_parameters)
    P = pseudo_inertia(own)  # (nb, 4, 4)
    out = np.empty((count, *own.shape))
    for start in range(0, count, _BLOCK):
        part = out[start : start + _BLOCK]
        A = spread * rng.uniform(-1.0, 1.0, (*part.shape[:2], 4, 4))
        A[..., 3, :3] = 0.0
        A[..., :3, 3] *= chain.length
        A += np.eye(4)
        part[:] = from_pseudo_inertia(A @ P @ np.swapaxes(A, -1, -2))
    out[0] = own
    return frozen(out)
