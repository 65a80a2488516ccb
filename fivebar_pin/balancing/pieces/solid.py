"""What a piece that can be made asks of its moments, in scaled parameters."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.forms import fixed_form
from fivebar_pin.balancing.moments import FIVE_THIRDS, TWO, Moments

__all__ = ["FlatSolid", "RoundSolid", "Solid"]


@dataclass(frozen=True, slots=True, eq=False)
class Solid(Immutable, ABC):
    """Scaled bounds of a piece.

    Attributes:
        word: "a disc", "a bar" or "a ball".
        least: factor of the least inertia or second moment.
        across: normal (2,) of the line that the centre must lie on, or None.
    """

    word: str
    least: float
    across: Array | None = None

    @abstractmethod
    def require(self, moments: Moments, text: str, w: Array, radius: float | None, point: Array | None) -> None:
        """Ask for a piece that can be made, whose outer radius r has m r <= w.

        Args:
            moments: of the piece.
            text: label of the cones.
            w: form.
            radius: the r_0 for which the outer radius is bounded from above; from below where it is None.
            point: the centre (2,) or (3,) that goes with it.
        """

    @abstractmethod
    def polar(self, mass: float) -> float:
        """Return the inertia of the most compact piece about its own centre, in the plane."""

    def second_moment(self, mass: float) -> float | None:
        """Return that of the piece in every direction of space; None where mass does not say it."""
        return None


@dataclass(frozen=True, slots=True, eq=False)
class FlatSolid(Solid):
    """I_c >= least m^2 and w^2 = alpha m I_c + beta m^3, w = m r.

    Attributes:
        alpha, beta: factors of the outer radius.
    """

    alpha: float = 1.0
    beta: float = 0.0

    def require(self, moments: Moments, text: str, w: Array, radius: float | None, point: Array | None) -> None:
        """Bound the outer radius from below, and about a chosen radius and place from above too."""
        u = moments.own_inertia(text, self.least, TWO)
        k = float(np.sqrt(self.alpha * self.least + self.beta))
        moments.cones.mean(text, float(np.sqrt(k)) * moments.m, [w, w, fixed_form(1.0), moments.m])
        if radius is not None and point is not None:
            about = moments.inertia_about(point)  # >= I_c, equal for the centre
            square = self.alpha * about + self.beta / self.least * u
            outer = 0.5 * (radius * moments.m + square / radius)
            moments.cones.add(f"{text} of bounded size", "nonneg", [w - outer], np.ones(1))

    def polar(self, mass: float) -> float:
        """Return least m^2."""
        return float(self.least * mass**TWO)


@dataclass(frozen=True, slots=True, eq=False)
class RoundSolid(Solid):
    """A ball: second moments about the centre >= least m^(5/3) and w >= beta m^(4/3)."""

    beta: float = 0.0

    def require(self, moments: Moments, text: str, w: Array, radius: float | None, point: Array | None) -> None:
        """Ask for S_c >= least m^(5/3) in every direction and w >= beta m^(4/3)."""
        if moments.planar:
            moments.own_inertia(text, 2.0 * self.least, FIVE_THIRDS)
        else:
            moments.own_second_moments(text, self.least)
        moments.cones.mean(text, self.beta**0.75 * moments.m, [w, w, w, fixed_form(1.0)])

    def polar(self, mass: float) -> float:
        """Return 2 least m^(5/3)."""
        return float(2.0 * self.least * mass**FIVE_THIRDS)

    def second_moment(self, mass: float) -> float | None:
        """Return least m^(5/3)."""
        return float(self.least * mass**FIVE_THIRDS)
