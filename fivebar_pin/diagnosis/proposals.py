"""Proposals: which closures and motors an open tree was meant to have, and why these.

A file that holds a tree only has lost its loops, but not without a trace: frames are named for them, or coincide.
Candidates are taken in the order of what speaks for them, and are proposed as long as what comes out can be closed
and moves; for the others it is said why not.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, checked
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Closure, ClosureKind
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
    named_pairs,
    point_pairs,
)
from fivebar_pin.diagnosis._posed import Posed, is_planar, pose
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["Evidence", "Proposal", "propose_closures"]


_ALIGNED = 2e-3
"""Angle up to which axes of coinciding frames count as parallel: rounding in files [rad]."""
_MOST_JUDGED = 40
"""Candidates without a name that are closed and looked at, the most telling first; each takes a search [-]."""

_FEW = 2
"""Freedoms up to which two open ends may be meant to be one joint: a loop leaves few, two arms many [-]."""
_STATED = (Evidence.GIVEN, Evidence.NAMED, Evidence.POINT)
"""Evidence that an author left on purpose: such closures belong together and are looked at together."""


@dataclass(frozen=True, slots=True, eq=False)
class Proposal(Immutable):
    """A closure that a tree may have been meant to have.

    Attributes:
        closure: frames, kind and axis.
        evidence: what speaks for it.
        gap: distance of the two origins where they are closest among the configurations looked at [m].
        angle: angle between the closure's axis (z unless it is a hinge about another) in the two frames there [rad].
        sure: "sure", "likely" or "possible".
        chosen: whether it belongs to the set that is proposed.
        reason: why it is chosen, or why not.
    """

    closure: Closure
    evidence: Evidence
    gap: float
    angle: float
    sure: str
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
    the tree, then, in a plane, the only two open ends. The closures proposed can be closed together, each takes
    freedom away, none stops its loop, and none needs exact dimensions to be closed at all.

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
    tried: list[_Candidate] = []
    for found in [given] if given else _in_order(chain, ends, starts):
        held = {frozenset(c.frames) for c in (*chain.closures, *(one.closure for one in tried))}
        fresh = [_Candidate(chain, pair, starts, wanted) for pair in found if _names(pair) not in held]
        chosen = _choose(chain, fresh, starts)
        tried += fresh
        if chosen:
            break
    return tuple(c.proposal for c in sorted(tried, key=lambda c: not c.chosen))


def _starts(chain: ClosedChain, q: npt.ArrayLike | None) -> list[Array]:
    """Return the configurations to look at."""
    if q is not None:
        return [np.array(pin.normalize(chain.model, np.array(checked("q", q, (chain.nq,)))))]
    return [np.array(pin.neutral(chain.model)), *(np.array(r) for r in chain.references.values())]


def _given(ends: dict[str, End], pair: tuple[str, str]) -> Pair:
    for name in pair:
        if name not in ends:
            raise UnknownNameError("frame", name, ends)
    one, other = (ends[name] for name in pair)
    if one.joint == other.joint:
        raise InvalidInputError("pair of frames", list(pair), "must be on two bodies; these are on one")
    return Pair((one, other), Evidence.GIVEN)


def _in_order(chain: ClosedChain, ends: dict[str, End], starts: list[Array]) -> Iterable[list[Pair]]:
    """Yield the candidates by evidence; the next ones are asked for when none of these is chosen."""
    yield [*named_pairs(ends.values()), *point_pairs(ends.values())]
    yield coinciding_pairs(chain, ends.values(), starts)[:_MOST_JUDGED]
    yield lone_pairs(ends.values())
    yield coinciding_pairs(chain, ends.values(), starts, within=NEAR)[:_MOST_JUDGED]


def _joints(pair: Pair) -> tuple[int, int]:
    return pair.ends[0].joint, pair.ends[1].joint


def _names(pair: Pair) -> frozenset[str]:
    return frozenset(end.name for end in pair.ends)


class _Candidate:
    """A pair on its way to a proposal: the kinds it may have, the strongest first, and what became of it."""

    def __init__(self, chain: ClosedChain, pair: Pair, starts: list[Array], kind: ClosureKind | None) -> None:
        self.pair, self.chosen, self.reason = pair, False, ""
        M = Sight(chain, pair.ends, starts).M
        gaps = np.linalg.norm(M[0, :, :3, 3] - M[1, :, :3, 3], axis=-1)
        k = int(np.argmin(gaps))
        self.gap, self.Q = float(gaps[k]), M[0, k, :3, :3].T @ M[1, k, :3, :3]
        self.meets = self.gap <= COINCIDE * chain.length
        self.axis = _own_axis(pair)
        self.kinds = [kind] if kind is not None else self._kinds(chain)
        self.closure = self.of_kind(self.kinds[0])

    def _kinds(self, chain: ClosedChain) -> list[ClosureKind]:
        """Return the kinds that suit the loop, the strongest first."""
        POINT, WELD, REVOLUTE = ClosureKind.POINT, ClosureKind.WELD, ClosureKind.REVOLUTE
        said = _said(self.pair)
        if said is not None:
            return [said]
        if any(end.is_leaf and end.hinge is not None for end in self.pair.ends):  # it has its hinge already
            return [WELD, POINT]
        if is_planar(chain, _joints(self.pair)):
            return [POINT]
        halves = all(end.is_leaf and chain.model.inertias[end.joint].mass > 0.0 for end in self.pair.ends)
        turned = float(np.linalg.norm(pin.log3(self.Q)))
        if self.meets and turned <= _ALIGNED and halves:
            return [WELD, REVOLUTE, POINT]
        if self.meets and self.angle <= _ALIGNED:
            return [REVOLUTE, POINT]
        if not self.meets and halves and self.pair.evidence is Evidence.NAMED:
            return [WELD, POINT]
        return [POINT]

    @property
    def places(self) -> set[tuple[float, ...]]:
        """Where its ends are on their bodies."""
        return {(end.joint, *end.placement[:3, 3].tolist()) for end in self.pair.ends}

    @property
    def angle(self) -> float:
        """Angle between the axis in the two frames where they are closest [rad]."""
        return float(np.arccos(np.clip(self.axis @ self.Q @ self.axis, -1.0, 1.0)))

    def of_kind(self, kind: ClosureKind) -> Closure:
        """Return the closure it would be."""
        one, other = self.pair.ends
        return Closure((one.name, other.name), kind, self.axis, self.pair.label)

    def kinds_from(self, step: int) -> ClosureKind:
        """Return the kind at a step of weakening, the last one from there on."""
        return self.kinds[min(step, len(self.kinds) - 1)]

    @property
    def proposal(self) -> Proposal:
        """What is told of it."""
        certain = self.pair.evidence in (Evidence.GIVEN, Evidence.NAMED) or (
            self.pair.evidence is Evidence.POINT and self.meets
        )
        likely = self.pair.evidence in (Evidence.POINT, Evidence.COINCIDE)
        sure = "sure" if certain else "likely" if likely else "possible"
        return Proposal(self.closure, self.pair.evidence, self.gap, self.angle, sure, self.chosen, self.reason)


def _said(pair: Pair) -> ClosureKind | None:
    """Return the kind that the names of the frames state."""
    for word in ("3d", "6d"):
        if all(word in end.name.lower() for end in pair.ends):
            return ClosureKind.parse(word)
    return None


def _own_axis(pair: Pair) -> Array:
    """Return the axis that two hinges at these frames share, in the axes of both; z where they do not."""
    one, other = (end.hinge for end in pair.ends)
    return one if one is not None and other is not None and np.array_equal(one, other) else np.array([0.0, 0.0, 1.0])


def _choose(chain: ClosedChain, candidates: list[_Candidate], starts: list[Array]) -> list[_Candidate]:
    """Mark the candidates that make a well-posed mechanism: all at once if they do, else one after the other."""
    if not candidates:
        return []
    evidence = candidates[0].pair.evidence
    if evidence is Evidence.ENDS:
        return _choose_the_only(chain, candidates, starts)
    if not candidates[0].meets and evidence not in _STATED:
        for c in candidates:
            c.reason = (
                f"they come within {c.gap:.2g} m only; move a frame, or state the pair if the joints can close it"
            )
        return []
    if evidence not in _STATED:
        return _one_by_one(chain, candidates, starts)
    posed = []
    for step in range(max(len(c.kinds) for c in candidates)):
        closures = _named_apart(chain, [c.of_kind(c.kinds_from(step)) for c in candidates])
        posed.append((pose(chain, (*chain.closures, *closures), starts), closures))
        if not posed[-1][0].problems:
            return _take(chain, candidates, *posed[-1])
    over = [one for one in posed if one[0].only_over]
    if over:
        return _take(chain, candidates, *over[-1])
    if evidence is Evidence.POINT or any(one.mobility >= 0 for one, _ in posed):
        return _one_by_one(chain, candidates, starts)
    return _take(chain, candidates, *min(posed, key=lambda one: one[0].gap))


def _choose_the_only(chain: ClosedChain, candidates: list[_Candidate], starts: list[Array]) -> list[_Candidate]:
    """Choose the only two open ends, if joining them makes a mechanism of few freedoms; never one pair of several."""
    if len(candidates) > 1:
        for c in candidates:
            c.reason = f"one of {len(candidates)} pairs of open ends; nothing says which belong together"
        return []
    (c,) = candidates
    posed = pose(chain, (*chain.closures, c.closure), starts)
    if not posed.problems and posed.mobility > _FEW:
        c.reason = f"the only two open ends, but {posed.mobility} freedoms would be left: two arms rather than a loop"
        return []
    return _one_by_one(chain, candidates, starts)


def _take(chain: ClosedChain, candidates: list[_Candidate], posed: Posed, closures: list[Closure]) -> list[_Candidate]:
    """Choose all candidates; what an author has named is a loop even where the tree as read cannot close it."""
    for k, (c, closure) in enumerate(zip(candidates, closures, strict=True), len(chain.closures)):
        c.closure, c.chosen, c.reason = closure, True, "; ".join(filter(None, (_why(c), posed.problems.get(k, ""))))
    return candidates


def _one_by_one(chain: ClosedChain, candidates: list[_Candidate], starts: list[Array]) -> list[_Candidate]:
    base = chain
    chosen: list[_Candidate] = []
    for c in candidates:
        spent = {end for other in chosen for end in other.places} & c.places
        if spent and c.pair.evidence not in _STATED:
            c.reason = "one of its ends is joined already"
            continue
        for kind in c.kinds:
            (closure,) = _named_apart(base, [c.of_kind(kind)])
            posed = pose(base, (*base.closures, closure), starts)
            c.closure, c.reason = closure, posed.problems.get(len(base.closures), _first(posed.problems))
            if not posed.problems:
                c.chosen, c.reason = True, _why(c)
                base, starts = replace(base, closures=(*base.closures, closure)), [posed.q, *starts]
                chosen.append(c)
                break
    return chosen


def _first(problems: dict[int, str]) -> str:
    return f"with it, another closure would fail: {next(iter(problems.values()))}" if problems else ""


def _named_apart(chain: ClosedChain, closures: list[Closure]) -> list[Closure]:
    """Return closures that no two of have one name."""
    taken, out = {c.name for c in chain.closures}, []
    for closure in closures:
        name = closure.name if closure.name not in taken else f"{closure.frames[0]}~{closure.frames[1]}"
        taken.add(name)
        out.append(replace(closure, name=name))
    return out


def _why(c: _Candidate) -> str:
    where = "they meet already" if c.meets else "open as the tree stands"
    return f"{c.pair.evidence.value}; {where}"
