"""Designs as counterweights that can be made, measured on the bodies that they consist of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fivebar_pin._arrays import Array, Immutable, figures, frozen
from fivebar_pin.balancing.counterweight_visuals import visuals, with_frames
from fivebar_pin.balancing.counterweights import SAME, Counterweight, made_for
from fivebar_pin.balancing.design import Design
from fivebar_pin.balancing.pieces.piece import Piece
from fivebar_pin.balancing.pieces.stated import piece_of
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError

__all__ = ["Realisation", "realise"]

_ROUND_OFF = 1e-12  # difference of terms that is none, whatever their size [their unit]
_FITS = 2e-5  # length that a piece may stick out of its region, for round-off [chain lengths]
_EXACT = 1e-9  # residual of the conditions that counts as balanced [of the moving mass]


@dataclass(frozen=True, eq=False, repr=False)
class Realisation(Immutable):
    """Counterweights for a design, and the mechanism that carries them.

    Attributes:
        design: what they were made for; solved in pieces of their kind.
        weights: one for each body that gets material.
    """

    design: Design
    weights: tuple[Counterweight, ...]

    def __repr__(self) -> str:
        return f"Realisation({len(self.weights)} counterweights on {self.design.original.name!r})"

    def __str__(self) -> str:
        lines = [repr(self), *(f"  {w}" for w in self.weights)]
        lines += [f"  {name}: {x} promised, {y} realised" for name, (x, y) in self.figures.items()]
        return "\n".join([*lines, f"  {self.claim}"])

    @property
    def deviation(self) -> Array:
        """Largest deviations over all pieces (3,) [kg, kg m, kg m2]."""
        return frozen(np.max([w.deviation for w in self.weights], axis=0) if self.weights else np.zeros(3))

    @property
    def parameters(self) -> Array:
        """Inertial parameters (nb, 10) of the bodies with what was made, summed piece by piece."""
        original = self.design.original
        pi = np.array(original.inertial_parameters)
        for removed in self.design.removed:
            pi[original.joints.index(removed.body)] -= removed.parameters
        for w in self.weights:
            b = original.joints.index(w.body)
            pi[b] += w.parameters + (0.0 if w.arm is None else w.arm.parameters)
        return frozen(pi)

    @cached_property
    def promised(self) -> dict[str, float]:
        """Terms of the objective, and rms and peaks along the motions, of the design."""
        return {**self.design.terms, **self.design.after}

    @cached_property
    def terms(self) -> dict[str, float]:
        """The same, measured on the bodies that were made."""
        return {name: self.design.value(name, self.parameters) for name in self.promised}

    @property
    def figures(self) -> dict[str, tuple[str, str]]:
        """What is promised and what is realised, for people to read: round-off is written as 0."""
        scale = self.design.scale
        return {
            name: (figures(x, scale(name), digits=6), figures(self.terms[name], scale(name), digits=6))
            for name, x in self.promised.items()
        }

    @cached_property
    def residual(self) -> float:
        """Largest residual of the conditions of what was made, over the moving mass [-]."""
        conditions = self.design.conditions
        if conditions is None or not conditions.rank:
            return 0.0
        return float(np.abs(conditions.residual(self.parameters)).max() / (self.chain.mass or 1.0))

    @property
    def attained(self) -> bool:
        """Whether what was made is balanced, lies in its regions, and has the terms that the design promises."""
        before = {**self.design.terms, **self.design.before}
        same = all(
            abs(self.terms[k] - x) <= SAME * max(abs(x), abs(before.get(k, 0.0))) + _ROUND_OFF
            for k, x in self.promised.items()
        )
        reach = self.design.original.length
        return same and self.residual <= _EXACT and all(w.overhang <= _FITS * reach for w in self.weights)

    @property
    def claim(self) -> str:
        """What can be said of it, in words."""
        d = self.design
        if not self.attained:
            return "the pieces do not have what the design asks for: take the realised figures"
        kind = "of this kind, on these bodies and with these arms," if d.arms else "of this kind"
        if d.status == "optimal":
            return f"optimal: no counterweights {kind} are better than {d.dual_bound:.9g}"
        best = f"none {kind} is better than {d.dual_bound:.9g}"
        return f"not proved optimal: objective {d.objective_text(digits=9)}, {best}"

    @cached_property
    def chain(self) -> ClosedChain:
        """The mechanism with its counterweights and their arms, drawn in a colour of their own."""
        original = self.design.original
        chain = with_frames(original, [w.body for w in self.weights]).with_inertial_parameters(self.parameters)
        drawn = [visual for w in self.weights for visual in visuals(chain, w)]
        return replace(chain, visuals=(*chain.visuals, *drawn))


def realise(
    design: Design,
    *,
    shape: str | None = None,
    material: str | float | None = None,
    thickness: float | None = None,
    arm: float | None = None,
) -> Realisation:
    """Turn added material into counterweights.

    A design that was solved in pieces is made of them. Any other is solved again in pieces of the kind asked for, so
    that what is made is the best that can be made, and not the nearest to something that cannot.

    Args:
        design: of `balance` in mode "add".
        shape: "disc" or "bar" for planar mechanisms, "ball" for any; a ball has the inertia that it has. A disc, or
            in space a ball, unless given.
        material: one of `MATERIALS`, or a density [kg/m3]; steel unless given.
        thickness: along the normal of the plane [m]; a fifth of the chain's characteristic length unless given.
        arm: side of the square arms [m]; a fifth of the outer radius of the counterweight unless given, 0 for none.

    Raises:
        UnknownNameError: a shape or material that is not known.
        InvalidInputError: a redesign (nothing is added), a flat piece on a spatial mechanism, a bad thickness.
        InfeasibleError: there is no design, or none in such pieces.
        SolverError: neither counterweights of this kind nor a proof that there are none.
    """
    _ = design.chain  # raises when infeasible
    if design.mode != "add":
        raise InvalidInputError("design", design.mode, "must be of mode 'add' to be made by counterweights")
    asked = (shape, material, thickness, arm) != (None, None, None, None)
    if asked or not all(c.body in design.pieces for c in design.added):
        word = shape or ("disc" if design.space.planar else "ball")
        piece = piece_of(design.original, word, material, thickness, arm)
        wanted = {c.body: piece if asked else design.pieces.get(c.body, piece) for c in design.added}
        if not all(body in design.pieces and piece.alike(design.pieces[body]) for body, piece in wanted.items()):
            design = _solved_in(design, wanted)
            _ = design.chain
    made = [made_for(design, c) for c in design.added if c.mass > 0.0]
    return Realisation(design, tuple(made))


def _solved_in(design: Design, pieces: Mapping[str, Piece]) -> Design:
    asked = design.asked
    if asked is None:
        raise InvalidInputError("design", design.status, "must come from balance, to be solved again in pieces")
    solved = asked.problem.in_pieces(pieces).solve(asked.minimise, limits=asked.limits)
    return replace(solved, alternatives=design.alternatives)
