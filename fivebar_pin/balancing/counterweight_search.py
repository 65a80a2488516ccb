"""Counterweights as a whole: discs and bars that fit, the arms that carry them, and the bound on what is possible.

Which outer radius a piece gets from its mass and inertia is not convex. Bounded from below (`pieces`), the problem is
convex and its dual bounds every design from below. Bounded from above about the size and place of the last design, it
is convex too, and its answer can be made; since the bound is exact there, the next answer is no worse. Where the two
meet the design is optimal; else the gap is stated. The arms follow the pieces in the same steps.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable, frozen
from fivebar_pin.balancing.change import Change, change_of
from fivebar_pin.balancing.design import PROVED, Design
from fivebar_pin.balancing.parameters import Space, plane_axes
from fivebar_pin.balancing.pieces.materials import density_of
from fivebar_pin.balancing.pieces.piece import Piece
from fivebar_pin.balancing.pieces.trial import Size, Trial
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import SolverError

__all__ = ["CounterweightSearch", "arm_of", "outer_radius"]

_STEPS = 60  # designs tried until size and place of the pieces stay
_SETTLED = 1e-6  # change of the objective from design to design [of its size]
_STILL = 1e-5  # change of the arms from design to design [chain lengths]
_MADE = 1e-4  # gap between an arm and the rim of its piece with which it can be made [chain lengths]
_THIN = 1e-3  # least radius that bounds a piece from above: smaller ones only make the problem ill scaled [room]
_GUESSED = 0.2  # the same where there was no piece [room]
_FITS = 30  # designs tried until their pieces no longer stick out of their regions
_PARTS = (1.0, 0.5, 0.25, 0.1, 0.02)  # shares of the way to new arms that are tried [-]
_EAGER = 6  # steps that try the whole way; later ones go half of it until little is left, lest they go to and fro
_FREE = 20  # steps after which pieces must stay ever nearer to where they were, so that they come to rest
_STRAY, _TIGHTER = 0.3, 0.65  # how far they may stray then [room], and what each step leaves of it [-]
_TRIED = 3  # bodies that are tried without a counterweight
_NEAR = 1e-4  # change of the arms that is little [chain lengths]
_GUESSES = (1.0, 0.5, 0.25, 0.75, 0.1)  # first sizes tried, between the solid piece and all the room there is [-]


@dataclass(frozen=True, slots=True, eq=False)
class CounterweightSearch(Immutable):
    """Looks for a design that can be made.

    Attributes:
        chain, space: the mechanism and its parameters.
        pieces: what the material added to a body is made as, by its index.
        rooms: largest radius of a piece, by the index of its body [m].
        solve: gives the optimum for what is tried and parameters (nb, 10) of arms; where pieces are elastic, the
            design whose pieces stick out of their regions least.
        unit: typical size of the objective.
        without: bodies that get nothing.
    """

    chain: ClosedChain
    space: Space
    pieces: Mapping[int, Piece]
    rooms: Mapping[int, float]
    solve: Callable[[Trial, Array], Design]
    unit: float
    without: frozenset[int] = frozenset()

    def search(self) -> Design:
        """Return the best design found, with the bound on all of them, or the proof that there is none.

        An arm has its weight however small its counterweight is, which is not convex: bodies whose counterweights weigh
        less than their arms are tried without.

        Raises:
            SolverError: neither a design nor a proof.
        """
        best, last, failure = self._one()
        if best is not None and not best.feasible:
            return best
        for b in self._light(last)[:_TRIED]:
            if len(self.without) + 1 < len(self.pieces):
                other, _, _ = replace(self, without=self.without | {b})._one()
                if other is not None and other.feasible and (best is None or other.objective < best.objective):
                    return replace(self, without=self.without | {b}).search()
        if best is None:
            raise failure
        return best

    def _one(self) -> tuple[Design | None, Design | None, SolverError]:
        """Return the design for these bodies or the proof, the last one tried, and why there is none of both."""
        last, failure = None, SolverError("no counterweights were tried")
        try:
            bound = self.solve(Trial({}, self.without), np.zeros((len(self.chain.joints), 10)))
            if not bound.feasible:
                return bound, None, failure
            last, settled = self._settle(self._first(bound))
            if settled:
                return self._stated(last), last, failure
            failure = SolverError(
                f"size and place of the counterweights do not settle in {_STEPS} steps. The problem that bounds them "
                f"from below has an optimum of {bound.objective:.6g}. Allow more reach, another material, more "
                "thickness or thinner arms."
            )
        except SolverError as error:
            failure = error
        return None, last, failure

    def _light(self, design: Design | None) -> list[int]:
        """Return the bodies whose arms outweigh their counterweights, the lightest of these first."""
        if design is None:
            return []
        mass = {c.body: c.mass for c in design.added}
        light = sorted((mass[a.body], a.body) for a in design.arms if mass[a.body] < a.mass)
        return [self.chain.joints.index(name) for _, name in light]

    def _first(self, bound: Design) -> Design:
        """Return a design that can be made, arms apart."""
        nothing, problem = np.zeros((len(self.chain.joints), 10)), ""
        for guess in _GUESSES:
            try:
                return self._next(self._sizes(bound, guess), nothing)
            except SolverError as error:
                problem = str(error)
        found = self._fitted(bound)
        if found is not None:
            return found
        raise SolverError(
            f"no counterweights of this kind were found, nor a proof that there are none ({problem}). The problem "
            f"that bounds them from below has an optimum of {bound.objective:.6g}. Allow more reach, another "
            "material or more thickness."
        )

    def _fitted(self, bound: Design) -> Design | None:
        """Return a design that can be made, arms apart, found by letting pieces stick out ever less; None if it is not.

        Size and place of pieces that stick out are those that the next ones are bounded about.
        """
        nothing, design = np.zeros((len(self.chain.joints), 10)), bound
        for _ in range(_FITS):
            try:
                design = self.solve(Trial(self._sizes(design, None), self.without, elastic=True), nothing)
                if not design.feasible:
                    return None
                return self._next(self._sizes(design, None), nothing)
            except SolverError:
                continue
        return None

    def _settle(self, design: Design) -> tuple[Design, bool]:
        """Follow size, place and arms until they stay; return the last design and whether it can be made."""
        carried, kept = np.zeros((len(self.chain.joints), 10)), None
        for step in range(_STEPS):
            arms = self.arms(design)
            whole_way = step < _EAGER or self._moved(arms, design.arms) < _NEAR * self.chain.length
            stray = None if step < _FREE else _STRAY * _TIGHTER ** (step - _FREE)
            try:
                parts = _PARTS if whole_way else _PARTS[1:]
                following, carried = self._toward(design, carried, arms, parts, stray)
            except SolverError:
                break
            moved = self._moved(self.arms(following), arms)
            size = max(abs(following.objective), self.unit)
            settled = abs(design.objective - following.objective) <= _SETTLED * size
            design = replace(following, arms=arms)
            if np.array_equal(carried, self._parameters(arms)) and moved <= _MADE * self.chain.length:
                kept = design
                if settled and moved <= _STILL * self.chain.length:
                    return design, True
        return (design, False) if kept is None else (kept, True)  # its gap says how much better another might be

    def _toward(
        self, design: Design, now: Array, arms: Sequence[Change], parts: Sequence[float], stray: float | None
    ) -> tuple[Design, Array]:
        """Return the next design with the arms asked for, or as far on the way there as there is a design."""
        sizes, wanted, problem = self._sizes(design, None, stray), self._parameters(arms), ""
        for part in parts:
            carried = wanted if part == 1.0 else now + part * (wanted - now)
            try:
                return self._next(sizes, carried), carried
            except SolverError as error:
                problem = str(error)
        raise SolverError(f"the arms of the counterweights leave no design ({problem})")

    def _next(self, sizes: Mapping[int, Size], carried: Array) -> Design:
        design = self.solve(Trial(sizes, self.without), carried)
        if not design.feasible:
            raise SolverError("the counterweights do not fit about the size and place tried")
        return design

    def _stated(self, design: Design) -> Design:
        """Return the design with the bound on all designs with these arms, and what it can claim."""
        bound = self.solve(Trial({}, self.without), self._parameters(design.arms))
        below = bound.dual_bound if bound.feasible else design.dual_bound
        scale = max(abs(design.objective), self.unit)
        met = design.objective - below <= PROVED * scale
        return replace(design, dual_bound=below, status="optimal" if met else "feasible")

    def _sizes(self, design: Design, guess: float | None, stray: float | None = None) -> dict[int, Size]:
        """Return sizes and places of a design's pieces; with a guess, within the room that there is."""
        out = {}
        by_name = {c.body: c for c in design.added}
        for b, piece in self.pieces.items():
            if b in self.without:
                continue
            change, axes, L = by_name[self.chain.joints[b]], self.space.axes[b], self.space.length
            room = self.rooms[b]
            r = outer_radius(piece, change, axes)
            if guess is not None:
                solid = outer_radius(piece, replace(change, inertia=np.zeros((3, 3))), axes)
                r = min(r, solid + guess * max(0.0, room - solid))
            r = max(r, _THIN * room) if change.mass > 0.0 else _GUESSED * room
            rows = np.array(axes)[:2] if self.space.planar else np.eye(3)
            out[b] = Size(r / L, frozen(rows @ change.place / L), None if stray is None else stray * room / L)
        return out

    def arms(self, design: Design) -> tuple[Change, ...]:
        """Return the arms of a design's pieces, from the joint to the rim."""
        by_name = {c.body: c for c in design.added}
        out = []
        for b, piece in self.pieces.items():
            if b in self.without:
                continue
            change = by_name[self.chain.joints[b]]
            arm = arm_of(piece, change, np.array(self.space.axes[b]), self.space.planar)
            if arm is not None:
                out.append(arm)
        return tuple(out)

    def _parameters(self, arms: Sequence[Change]) -> Array:
        total = np.zeros((len(self.chain.joints), 10))
        for arm in arms:
            total[self.chain.joints.index(arm.body)] += arm.parameters
        return total

    def _moved(self, new: Sequence[Change], old: Sequence[Change]) -> float:
        """Return how far the ends of the arms have moved [m]."""
        ends = [{c.body: 2.0 * c.place for c in arms} for arms in (new, old)]
        names = {*ends[0], *ends[1]}
        zero = np.zeros(3)
        return max((float(np.abs(ends[0].get(n, zero) - ends[1].get(n, zero)).max()) for n in names), default=0.0)


def outer_radius(piece: Piece, change: Change, axes: Array) -> float:
    """Return the outer radius [m] of the piece with the mass and inertia of a change; 0 without mass."""
    return piece.outer_radius(change.mass, change.inertia, axes) if change.mass > 0.0 else 0.0


def arm_of(piece: Piece, change: Change, axes: Array, planar: bool) -> Change | None:
    """Return the arm from the joint to the rim of a piece: a bar of its material, or None where none is needed."""
    radius = outer_radius(piece, change, axes)
    width = piece.arm_width(radius)
    flat = change.place - axes[2] * float(axes[2] @ change.place) if planar else change.place
    distance = float(np.linalg.norm(flat))
    reach = distance - radius
    if width == 0.0 or change.mass <= 0.0 or reach <= 0.0:
        return None
    mass = density_of(piece.density) * width**2 * reach
    x = flat / distance
    z = axes[2] if planar else plane_axes(x)[0]
    turn = np.column_stack([x, np.cross(z, x), z])
    squares = np.array([reach, width, width]) ** 2
    own = turn @ np.diag(mass / 12.0 * (squares.sum() - squares)) @ turn.T
    place = 0.5 * reach * x + (change.place - flat)
    return change_of(change.body, np.array(pin.Inertia(mass, place, own).toDynamicParameters()))
