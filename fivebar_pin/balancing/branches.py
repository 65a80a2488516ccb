"""Branches of mechanisms with special lengths, on which fewer conditions hold.

The configurations of a parallelogram form two curves that cross where it lies flat: the parallelogram proper and the
antiparallelogram. Momentum may vanish along one without vanishing along the other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from fivebar_pin._arrays import Array, frozen
from fivebar_pin.balancing._sampling import SpaceName, random_samples
from fivebar_pin.balancing.conditions import BalanceConditions, balance_conditions
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import FiveBarPinError

__all__ = ["Branch", "branches"]

_ROUGH = 1e-2  # part of a condition outside another row space that tells branches apart [-]


@dataclass(frozen=True, slots=True, eq=False)
class Branch:
    """A closed configuration (nq,) and the conditions on what can be reached from it."""

    near: Array
    conditions: BalanceConditions


def branches(
    chain: ClosedChain, together: BalanceConditions, *, tries: int = 4, seed: int = 0, **options: Any
) -> tuple[Branch, ...]:
    """Return the branches found that have fewer conditions than all assembly modes together, fewest first.

    Args:
        chain: the mechanism.
        together: its conditions on all assembly modes.
        tries: number of random configurations to start from.
        seed: of the configurations.
        **options: gravity, about, as for `balance_conditions`.
    """
    found: list[Branch] = []
    space: SpaceName = "planar" if together.space.planar else "spatial"
    for q in random_samples(chain, 10, seed=seed).q[:tries]:
        try:
            own = balance_conditions(chain, together.kind, near=q, space=space, seed=seed, **options)
        except FiveBarPinError:
            continue  # a stretch too short to decide a rank: nothing to be gained there
        if own.rank < together.rank and not any(_alike(own, b.conditions) for b in found):
            found.append(Branch(frozen(q), own))
    return tuple(sorted(found, key=lambda b: b.conditions.rank))


def _alike(a: BalanceConditions, b: BalanceConditions) -> bool:
    if a.rank != b.rank:
        return False
    outside = a.basis - (a.basis @ b.basis.T) @ b.basis
    return bool(np.abs(outside).max(initial=0.0) < _ROUGH)
