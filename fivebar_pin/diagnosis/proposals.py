"""Proposals: which closures an open tree was meant to have, and why these.

A file that holds a tree only has lost its loops, but not without a trace: frames are named for them, or coincide.
Candidates are taken in the order of what speaks for them, and are proposed as long as what comes out can be closed
and moves; for the others it is said why not.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, all_of, checked
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Closure, ClosureKind
from fivebar_pin.diagnosis._candidate import Candidate
from fivebar_pin.diagnosis._choosing import choose
from fivebar_pin.diagnosis._ends import (
    COINCIDE,
    NEAR,
    End,
    Evidence,
    Pair,
    Sight,
    coinciding_pairs,
    ends_of,
    lone_pairs,
)
from fivebar_pin.diagnosis._names import named_pairs, point_pairs
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["Evidence", "Proposal", "propose_closures"]


_MOST_JUDGED = 40
"""Candidates without a name that are closed and looked at, the most telling first; each takes a search [-]."""


@dataclass(frozen=True, slots=True, eq=False)
class Proposal(Immutable):
    """A closure that a tree may have been meant to have.

    Attributes:
        closure: frames, kind and axis.
        evidence: what speaks for it.
        gap: distance of the two origins where they are closest among the configurations looked at [m].
        angle: angle between the closure's axis (z unless it is a hinge about another) in the two frames there [rad].
        sure: how sure it is.
        chosen: whether it belongs to the set that is proposed.
        reason: why it is chosen, or why not.
    """

    closure: Closure
    evidence: Evidence
    gap: float
    angle: float
    sure: Literal["sure", "likely", "possible"]
    chosen: bool
    reason: str


def propose_closures(
    chain: ClosedChain,
    q: npt.ArrayLike | None = None,
    *,
    pairs: Iterable[tuple[str, str]] = (),
    kind: ClosureKind | str | None = None,
) -> tuple[Proposal, ...]:
    """Propose closures for an open tree, or further ones for a chain.

    Frames named for a loop (closedloop1_A and closedloop1_B, closing_knee_1 and closing_knee_2) come first, then one
    point named on two bodies (B_coupler and B_rocker), then frames that coincide where one of the bodies is an end of
    the tree, then the only two open ends, if joining them leaves few freedoms. The closures proposed can be closed
    together, each takes freedom away and none stops its loop. Only what is named for a loop, or given, is proposed
    even if the tree as read cannot close it, or needs exact dimensions to; the reason says so then.

    Args:
        chain: the tree.
        q: configuration (nq,) at which frames may coincide; the neutral and the reference configurations unless given.
        pairs: frames to join instead of what would be found.
        kind: of all closures, instead of the one that suits each loop: a point in planar loops, a weld where frames
            coincide or the two halves of one body meet, a hinge where axes coincide, else a point.

    Returns:
        All candidates: the chosen ones first, then the others with the reason.

    Raises:
        InvalidInputError: q of the wrong shape, or a pair on one body.
        UnknownNameError: a frame or a kind that there is not.
    """
    starts = _starts(chain, q)
    ends = ends_of(chain)
    wanted = None if kind is None else ClosureKind.parse(kind)
    given = [_given(ends, pair) for pair in pairs]
    tried: list[Candidate] = []
    for found in [given] if given else _in_order(chain, ends, starts):
        held = {frozenset(c.joins) for c in (*chain.closures, *(one.closure for one in tried))}
        fresh = [Candidate(chain, pair, starts, wanted, found) for pair in found if _names(pair) not in held]
        chosen = choose(chain, fresh, starts)
        tried += fresh
        if chosen:
            break
    return tuple(_proposal(c) for c in sorted(tried, key=lambda c: not c.chosen))


def _starts(chain: ClosedChain, q: npt.ArrayLike | None) -> list[Array]:
    """Return the configurations to look at."""
    if q is not None:
        return [np.array(pin.normalize(chain.model, np.array(checked("q", q, (chain.nq,)))))]
    return [np.array(pin.neutral(chain.model)), *(np.array(r) for r in chain.references.values())]


def _given(ends: dict[str, End], pair: tuple[str, str]) -> Pair:
    names = all_of("pair of frames", pair, str)
    if isinstance(pair, str) or len(names) != 2:
        raise InvalidInputError("pair of frames", pair, "must be two frame names")
    for name in names:
        if name not in ends:
            raise UnknownNameError("frame", name, ends)
    one, other = (ends[name] for name in names)
    if one.joint == other.joint:
        raise InvalidInputError("pair of frames", list(names), "must be on two bodies; these are on one")
    return Pair((one, other), Evidence.GIVEN)


def _in_order(chain: ClosedChain, ends: dict[str, End], starts: list[Array]) -> Iterable[list[Pair]]:
    """Yield the candidates by evidence; the next ones are asked for when none of these is chosen."""

    def meet(one: End, other: End) -> bool:
        sight = Sight(chain, (one, other), starts)
        return bool(sight.gaps(0, np.array([1])).min() <= COINCIDE * chain.length)

    yield [*named_pairs(ends.values()), *point_pairs(ends.values(), meet)]
    yield coinciding_pairs(chain, ends.values(), starts)[:_MOST_JUDGED]
    yield lone_pairs(ends.values())
    yield coinciding_pairs(chain, ends.values(), starts, within=NEAR)[:_MOST_JUDGED]


def _names(pair: Pair) -> frozenset[str]:
    return frozenset(end.name for end in pair.ends)


def _proposal(c: Candidate) -> Proposal:
    return Proposal(c.closure, c.pair.evidence, c.gap, c.angle, _sure(c), c.chosen, c.reason)


def _sure(c: Candidate) -> Literal["sure", "likely", "possible"]:
    evidence = c.pair.evidence
    if evidence in (Evidence.GIVEN, Evidence.NAMED) or (evidence is Evidence.POINT and c.meets):
        return "sure"
    return "likely" if evidence in (Evidence.POINT, Evidence.COINCIDE) else "possible"
