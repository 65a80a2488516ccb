"""Proposals for motors: joints that together determine a closed mechanism, those likely to have a motor first."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, checked
from fivebar_pin.chain import ClosedChain
from fivebar_pin.diagnosis.findings import STILL
from fivebar_pin.mechanism import mobility
from fivebar_pin.mechanism.closing import CLOSED
from fivebar_pin.mechanism.configurations import Configurations
from fivebar_pin.mechanism.loops import Loops, loops_of

__all__ = ["MotorProposal", "propose_motors"]


_WELL, _BARELY = 0.1, 1e-6
"""Least share of the freedom still undetermined that a joint must have of its own: first choice, and at all [-]."""
_NO_LIMIT = 1e30
"""Effort limit from which on there is none [N m or N]."""

_DRIVEN = re.compile(r"mot(?![a-z])|motor|act(?![a-z])|actuat|driv|servo|crank|input", re.IGNORECASE)
_FREE = re.compile(r"free|passive|spherical|ball|universal|ujoint|cardan|closed?_?loop|closing", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class MotorProposal(Immutable):
    """A joint that may have a motor.

    Attributes:
        joint: its name.
        reason: what speaks for it.
    """

    joint: str
    reason: str


def propose_motors(chain: ClosedChain, q: npt.ArrayLike | None = None) -> tuple[MotorProposal, ...]:
    """Propose joints to drive: as many as there are freedoms, determining the motion near a closed configuration.

    Sets of joints that determine the motion are the bases of a matroid, so taking the most likely joint that adds
    something, again and again, gives the best set. A name like motor or drive speaks most for a joint, a name like
    free or ball against it, then a finite effort limit where others have none, a body with a mass, and the ground
    being near. A joint that no closure feels, as a pin that spins at its own place, gets no motor.

    Args:
        chain: with its closures; what it drives already is passed over.
        q: configuration (nq,) to start from; one that closes the loops is looked for unless given.

    Returns:
        The joints in the order of the tree; fewer than there are freedoms where the rest turns idly.

    Raises:
        InvalidInputError: q of the wrong shape or not finite.
    """
    chain = replace(chain, actuated=())
    loops = loops_of(chain)
    q = mobility.first_closed(chain, 0, CLOSED)[0] if q is None else checked("q", q, (chain.nq,))
    site = mobility.generic_site(chain, mobility.site_at(loops, np.array(q)), 0, CLOSED)
    single = [j for j in range(1, chain.model.njoints) if chain.model.nvs[j] == 1]
    idle = _idle(loops, site)
    order = sorted((j for j in single if chain.model.idx_vs[j] not in idle), key=lambda j: _unlikely(chain, j))
    chosen = sorted(_basis(chain, site.free[0], order))
    return tuple(MotorProposal(str(chain.model.names[j]), _reason(chain, j)) for j in chosen)


def _basis(chain: ClosedChain, free: Array, order: list[int]) -> list[int]:
    """Take joints in order while each determines something that those before it leave free."""
    basis, chosen = np.array(free), []
    for least in (_WELL, _BARELY):
        for j in order:
            row = basis[chain.model.idx_vs[j]]
            size = float(np.linalg.norm(row))
            if j not in chosen and size > least * float(np.linalg.norm(free[chain.model.idx_vs[j]])) > 0.0:
                basis = basis - np.outer(basis @ row, row) / size**2
                chosen.append(j)
            if len(chosen) == free.shape[1]:
                return chosen
    return chosen


def _idle(loops: Loops, site: Configurations) -> set[int]:
    """Return the coordinates inside a loop that no closure feels in general."""
    inside = {int(k) for c in loops.anchored for k in c.columns}
    felt = np.abs(site.J[0]).max(axis=0, initial=0.0) > STILL
    return {k for k in inside if not felt[k]}


def _unlikely(chain: ClosedChain, j: int) -> tuple[int, int, int, int]:
    """Return a key that sorts joints, those likely to have a motor first."""
    name = str(chain.model.names[j])
    driven, free = bool(_DRIVEN.search(name)), bool(_FREE.search(name))
    word = 0 if driven and not free else 2 if free and not driven else 1
    return word, not _has_effort(chain, j), not _has_body(chain, j), _depth(chain, j)


def _has_effort(chain: ClosedChain, j: int) -> bool:
    limit = float(np.array(chain.model.upperEffortLimit)[chain.model.idx_vs[j]])
    return 0.0 < limit < _NO_LIMIT


def _has_body(chain: ClosedChain, j: int) -> bool:
    """Whether a joint moves a body of its own, not the cross of a universal joint or the first of three slides."""
    parent = chain.model.parents[j]
    return bool(chain.model.inertias[j].mass > 0.0 and (not parent or chain.model.inertias[parent].mass > 0.0))


def _depth(chain: ClosedChain, j: int) -> int:
    depth = 0
    while j:
        depth, j = depth + 1, int(chain.model.parents[j])
    return depth


def _reason(chain: ClosedChain, j: int) -> str:
    name = str(chain.model.names[j])
    named = bool(_DRIVEN.search(name))
    if (_FREE.search(name) and not named) or (not _has_body(chain, j) and chain.mass > 0.0):
        return "nothing else determines what is left; hold it where it is"
    words = []
    if named:
        words.append("its name")
    if _has_effort(chain, j) and not all(_has_effort(chain, k) for k in range(1, chain.model.njoints)):
        words.append("an effort limit")
    depth = _depth(chain, j)
    words.append("on the ground" if depth == 1 else f"{depth} joints from the ground")
    return ", ".join(words)
