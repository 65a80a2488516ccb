"""Which candidates make a well-posed mechanism together, and why the others do not."""

from __future__ import annotations

from dataclasses import replace

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Closure
from fivebar_pin.diagnosis._candidate import Candidate
from fivebar_pin.diagnosis._ends import Evidence
from fivebar_pin.diagnosis._posed import Posed, judge

__all__ = ["choose"]


_FEW = 2
"""Freedoms up to which two open ends may be meant to be one joint: a loop leaves few, two arms many [-]."""
_STATED = (Evidence.GIVEN, Evidence.NAMED, Evidence.POINT)
"""Evidence that an author left on purpose: such closures belong together and are looked at together."""


def choose(chain: ClosedChain, candidates: list[Candidate], starts: list[Array]) -> list[Candidate]:
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
        posed.append((judge(chain, (*chain.closures, *closures), starts), closures))
        if not posed[-1][0].problems:
            return _take(chain, candidates, *posed[-1])
    over = [one for one in posed if one[0].only_over]
    if over:
        return _take(chain, candidates, *over[-1])
    if evidence is not Evidence.GIVEN and (evidence is Evidence.POINT or any(one.mobility >= 0 for one, _ in posed)):
        return _one_by_one(chain, candidates, starts)
    return _take(chain, candidates, *min(posed, key=lambda one: (one[0].gap, len(one[0].problems))))


def _choose_the_only(chain: ClosedChain, candidates: list[Candidate], starts: list[Array]) -> list[Candidate]:
    """Choose the only two open ends, if joining them makes a mechanism of few freedoms; never one pair of several."""
    if len(candidates) > 1:
        for c in candidates:
            c.reason = f"one of {len(candidates)} pairs of open ends; nothing says which belong together"
        return []
    (c,) = candidates
    posed = judge(chain, (*chain.closures, c.closure), starts)
    if not posed.problems and posed.mobility > _FEW:
        c.reason = f"the only two open ends, but {posed.mobility} freedoms would be left: two arms rather than a loop"
        return []
    return _one_by_one(chain, candidates, starts)


def _take(chain: ClosedChain, candidates: list[Candidate], posed: Posed, closures: list[Closure]) -> list[Candidate]:
    """Choose all candidates; what an author has named is a loop even where the tree as read cannot close it."""
    for k, (c, closure) in enumerate(zip(candidates, closures, strict=True), len(chain.closures)):
        c.closure, c.chosen, c.reason = closure, True, "; ".join(filter(None, (_why(c), posed.problems.get(k, ""))))
    return candidates


def _one_by_one(chain: ClosedChain, candidates: list[Candidate], starts: list[Array]) -> list[Candidate]:
    base = chain
    chosen: list[Candidate] = []
    for c in candidates:
        spent = {end for other in chosen for end in other.places} & c.places
        if spent and not c.is_planar and c.pair.evidence not in _STATED:  # in a plane a pin may hold three bars
            c.reason = "one of its ends is joined already"
            continue
        for kind in c.kinds:
            (closure,) = _named_apart(base, [c.of_kind(kind)])
            posed = judge(base, (*base.closures, closure), starts)
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
        name = closure.name if closure.name not in taken else f"{closure.joins[0]}~{closure.joins[1]}"
        taken.add(name)
        out.append(replace(closure, name=name))
    return out


def _why(c: Candidate) -> str:
    where = "they meet already" if c.meets else "open as the tree stands"
    return f"{c.pair.evidence.value}; {where}"
