"""One pair of frames on its way to a proposal: where they meet, and which kinds of closure suit them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Closure, ClosureKind
from fivebar_pin.diagnosis._ends import COINCIDE, End, Evidence, Pair, Sight, place_of
from fivebar_pin.diagnosis._posed import is_planar

__all__ = ["Candidate"]


_ALIGNED = 2e-3
"""Angle up to which axes of coinciding frames count as parallel: rounding in files [rad]."""


class Candidate:
    """A pair on its way to a proposal: the kinds it may have, the strongest first, and what became of it."""

    def __init__(
        self, chain: ClosedChain, pair: Pair, starts: list[Array], kind: ClosureKind | None, others: Sequence[Pair] = ()
    ) -> None:
        self.pair, self.chosen, self.reason = pair, False, ""
        self.others = [end for other in others if other is not pair for end in other.ends]
        self.is_planar = is_planar(chain, (pair.ends[0].joint, pair.ends[1].joint))
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
        if any(self._ends_on_its_hinge(end) for end in self.pair.ends):  # it has its hinge already
            return [WELD, POINT]
        if self.is_planar:
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

    def _ends_on_its_hinge(self, end: End) -> bool:
        """Whether a body ends at its own hinge: one that goes on to another loop is a third bar on that pin."""
        goes_on = any(o.joint == end.joint and place_of(o) != place_of(end) for o in self.others)
        return end.is_leaf and end.hinge is not None and not goes_on

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
