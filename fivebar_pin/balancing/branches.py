"""Branches of mechanisms with special lengths, on which fewer conditions hold.

The configurations of a parallelogram form two curves that cross where it lies flat: the parallelogram proper and the
antiparallelogram. Momentum may vanish along one without vanishing along the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import TINY, Array, Immutable, frozen
from fivebar_pin.balancing.conditions import BalanceConditions, balance_conditions
from fivebar_pin.balancing.regressors.measures import Motions
from fivebar_pin.balancing.sampling import SpaceName, closed_at, random_samples
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import FiveBarPinError
from fivebar_pin.mechanism.loops import loops_of
from fivebar_pin.trajectory import Trajectory

__all__ = ["Branch", "branches", "configurations_meant"]

_ROUGH = 1e-2  # part of a condition outside another row space that tells branches apart [-]


@dataclass(frozen=True, slots=True, eq=False)
class Branch(Immutable):
    """What can be reached from one configuration without passing a singularity.

    Attributes:
        near: the configuration (nq,), closed.
        conditions: on the inertial parameters, on this branch.
        named: whether it was asked for.
    """

    near: Array
    conditions: BalanceConditions
    named: bool


def branches(
    chain: ClosedChain,
    together: BalanceConditions,
    *,
    named: Sequence[Array] = (),
    gravity: npt.ArrayLike | Literal["any", "model"] = "any",
    about: npt.ArrayLike = (0.0, 0.0, 0.0),
    tries: int = 4,
    seed: int = 0,
) -> tuple[Branch, ...]:
    """Return the branches found that have fewer conditions than all assembly modes together.

    Those of the named configurations come first, the others with the fewest conditions first.

    Args:
        chain: the mechanism.
        together: its conditions on all assembly modes.
        named: closed configurations (nq,) whose branches are asked for.
        gravity, about: as for `balance_conditions`, those of `together`.
        tries: number of random configurations to start from.
        seed: of the configurations.
    """
    found: list[Branch] = []
    space: SpaceName = "planar" if together.space.planar else "spatial"
    starts = [*named, *random_samples(chain, tries, seed=seed).q]
    for k, q in enumerate(starts):
        try:
            own = balance_conditions(chain, together.kind, gravity=gravity, about=about, near=q, space=space, seed=seed)
        except FiveBarPinError:
            continue  # a stretch too short to decide a rank: nothing to be gained there
        if _asked(own) < _asked(together) and not any(_alike(own, b.conditions) for b in found):
            found.append(Branch(frozen(q), own, k < len(named)))
    return tuple(sorted(found, key=lambda b: (not b.named, b.conditions.rank)))


def configurations_meant(chain: ClosedChain, motions: Motions) -> tuple[Array, ...]:
    """Return where given trajectories start, else the model's reference configurations that close the loops (nq,)."""
    given = motions if isinstance(motions, Sequence) else (motions,)
    starts = tuple(path.q[0] for path in given if isinstance(path, Trajectory))
    return starts or tuple(q for q in chain.references.values() if closed_at(loops_of(chain), q))


def _asked(conditions: BalanceConditions) -> tuple[bool, int]:
    """Return what tells how much conditions ask: whether the impossible, and how many there are."""
    return bool(conditions.unheld), conditions.rank


def _alike(a: BalanceConditions, b: BalanceConditions) -> bool:
    if _asked(a) != _asked(b):
        return False
    outside = a.basis - (a.basis @ b.basis.T) @ b.basis
    constants = a.offset - a.basis @ b.basis.T @ b.offset
    size = max(float(np.abs(a.offset).max(initial=0.0)), TINY)
    return bool(np.abs(outside).max(initial=0.0) < _ROUGH and np.abs(constants).max(initial=0.0) < _ROUGH * size)
