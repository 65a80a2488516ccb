"""The balancing conditions (60)-(63), (68)-(71), as linear functions of mu_i rho_i e^{i alpha_i} and mu_i.

Together they say mu1 l1 + mu2 = mu2 l2 = mu3 l3 - mu3 = mu4 l4 - mu4 - mu3 with l_i = rho_i e^{i alpha_i}.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable, finite, frozen
from fivebar_pin.paper.linkage import FiveBar

__all__ = ["EQUATIONS", "HOLDS", "Conditions", "conditions"]

EQUATIONS = ("(60)", "(61)", "(62)", "(63)", "(68)", "(69)", "(70)")
HOLDS = 1e-12  # residual of an equation that holds: round-off of numbers of size one [-]

# Residual = ROWS @ (mu rho cos alpha, mu rho sin alpha, mu) - RIGHT, left side minus right side as the paper has them.
ROWS = np.zeros((7, 12))
ROWS[0, [1, 2, 10]] = 1.0, -1.0, 1.0
ROWS[1, [1, 3, 10, 11]] = 1.0, -1.0, 1.0, 1.0
ROWS[2, [5, 6]] = 1.0, -1.0
ROWS[3, [5, 7]] = 1.0, -1.0
ROWS[4, [1, 0, 9]] = 1.0, -1.0, -1.0
ROWS[5, [5, 4]] = 1.0, -1.0
ROWS[6, 8:] = 1.0
ROWS.setflags(write=False)
RIGHT = frozen([0.0] * 6 + [1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Conditions(Immutable):
    """How far a linkage is from force balance.

    Attributes:
        equations: the equation numbers of the residuals.
        residuals: left side minus right side, in mass ratios (7,) [-].
        mass_residuals: the same times the total mass (7,) [kg].
        ratios: mu_1 .. mu_4 (4,) [-], which (71) wants positive.
    """

    equations: tuple[str, ...]
    residuals: Array
    mass_residuals: Array
    ratios: Array

    @property
    def worst(self) -> float:
        """Largest residual [-]."""
        return float(np.abs(self.residuals).max())

    def hold(self, *, tolerance: float = HOLDS) -> bool:
        """Whether every equation holds within the tolerance [-] and every inequality strictly."""
        return self.worst <= tolerance and bool(np.all(self.ratios > 0.0))

    def __str__(self) -> str:
        rows = [f"{name:>5} {r: .3e}  ({k: .3e} kg)" for name, r, k in zip(*self._columns, strict=True)]
        return "\n".join([*rows, f" (71) mu = {np.array2string(self.ratios, precision=4)}"])

    @property
    def _columns(self) -> tuple[tuple[str, ...], list[float], list[float]]:
        return self.equations, self.residuals.tolist(), self.mass_residuals.tolist()


@finite()
def conditions(linkage: FiveBar) -> Conditions:
    """Return the residuals of (60)-(63), (68), (69), (70) and the ratios of (71)."""
    mu, mass = linkage.mass_ratios, float(linkage.masses.sum())
    moments = mu * linkage.kappa
    residuals = ROWS @ np.concatenate([moments.real, moments.imag, mu]) - RIGHT
    return Conditions(EQUATIONS, frozen(residuals), frozen(residuals * mass), frozen(mu))
