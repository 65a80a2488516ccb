"""The errata of the paper, each with a number for the printed form and one for the repaired form, computed here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fivebar_pin._arrays import Immutable
from fivebar_pin.paper import evidence as ev
from fivebar_pin.paper.equations import HOLDS
from fivebar_pin.paper.solution import Solution

__all__ = ["Erratum", "errata"]


@dataclass(frozen=True, slots=True)
class Erratum(Immutable):
    """A slip of the paper and the evidence for it.

    Attributes:
        equation: where.
        printed: what stands there.
        repaired: what holds.
        measure: what the two errors are.
        printed_error: error of the printed form.
        repaired_error: error of the repaired form.
        tolerance: what the repaired error must stay below; round-off unless the paper's own digits limit it.
    """

    equation: str
    printed: str
    repaired: str
    measure: str
    printed_error: float
    repaired_error: float
    tolerance: float = HOLDS


def errata() -> tuple[Erratum, ...]:
    """Compute the table of errata, on case I with mass centres off the links, along `default_motion`."""
    s = ev.generic()
    return tuple(
        Erratum(equation, printed, repaired, measure, *errors(s), tolerance=tolerance)
        for equation, printed, repaired, measure, errors, tolerance in _TABLE
    )


_SLOPE = "relative error against the complex step of the function"
_RATE = "relative error against the complex step of (A11); repaired: of the rate of r_theta"
_TABLE: tuple[tuple[str, str, str, str, Callable[[Solution], tuple[float, float]], float], ...] = (
    (
        "(7)",
        "theta = arcsin(y / a2)",
        "theta = atan2(y, x), x and y from (3)",
        "error of theta [rad]",
        ev.arcsine,
        1e-12,
    ),
    (
        "(18a)",
        "+k4 sin(phi - psi) + k6 sin(gamma - psi)",
        "both terms negative",
        _SLOPE,
        ev.loop_slope("phi", 0),
        1e-12,
    ),
    ("(18c)", "-k2 sin(gamma - phi)", "+k2 sin(gamma - phi)", _SLOPE, ev.loop_slope("phi", 2), 1e-12),
    (
        "(17)",
        "r_phi from the printed (18)",
        "r_phi from the repaired (18)",
        "relative error",
        ev.ratio("phi"),
        1e-12,
    ),
    ("(A10b)", "+k3 sin(psi - gamma)", "-k3 sin(psi - gamma)", _SLOPE, ev.loop_slope("theta", 1), 1e-12),
    (
        "(A10c)",
        "-k2 sin(psi - theta) + k5 sin(gamma - theta)",
        "both with the other sign",
        _SLOPE,
        ev.loop_slope("theta", 2),
        1e-12,
    ),
    (
        "(A11)",
        "r_theta from the printed (A10)",
        "r_theta from the repaired (A10)",
        "relative error",
        ev.ratio("theta"),
        1e-12,
    ),
    ("(A15b)", "+k3 cos(psi - gamma), twice", "-k3 cos(psi - gamma)", _RATE, ev.ratio_slope("gamma"), 1e-12),
    (
        "(A15c)",
        "signs of k2, k5; a bracket closed early",
        "derivative of m / n by theta",
        _RATE,
        ev.ratio_slope("theta"),
        1e-12,
    ),
    (
        "(A15d)",
        "carries a factor psi''",
        "without it: (A13) multiplies by psi''",
        _RATE,
        ev.ratio_slope("psi'"),
        1e-12,
    ),
    (
        "(A15e)",
        "carries a factor gamma''",
        "without it; (A13) multiplies by gamma''",
        _RATE,
        ev.ratio_slope("gamma'"),
        1e-12,
    ),
    (
        "(34)",
        "A_{i,i-1} = [E b, 1]",
        "A_{i,i-1} = [-E b, -1], as in (36)",
        "residual of (33) over the speed",
        ev.neighbours,
        1e-12,
    ),
    ("(36)", "an identity block at link 3 in row 1", "zero there", "|A - B^T|", ev.first_row, 1e-15),
    (
        "(41)",
        "r_theta, r_phi in the column of psi, zeros in that of gamma",
        "d(theta, phi)/d(psi, gamma) in both",
        "|A u|",
        ev.complement,
        1e-14,
    ),
    (
        "(41), psi' = 0",
        "divides by psi'",
        "partial derivatives exist there",
        "|r_gamma|; repaired: |A u|",
        ev.at_rest,
        1e-14,
    ),
    (
        "(46)",
        "I(q) = u^T M u with the printed u",
        "with the repaired u",
        "relative error against the energy",
        ev.inertia,
        1e-12,
    ),
    (
        "(72)",
        "tau = u^T M t' with the printed u",
        "with the repaired u",
        "relative error against Newton-Euler",
        ev.torque,
        1e-12,
    ),
    (
        "(52)",
        "E is dropped",
        "E times (52); it vanishes for the same linkages",
        "relative error of the COM velocity",
        ev.dropped_turn,
        1e-12,
    ),
    (
        "(75)",
        "F = f01 + f40",
        "F = f40 - f01",
        "peak for the balanced linkage over unbalanced",
        ev.frame_force,
        1e-12,
    ),
    ("(80)", "seven numbers", "eight: four angles, four ratios", "numbers missing", ev.guess, 0.0),
    (
        "Table 1, |r_12|",
        "no row",
        "0.02 m, 0.035 m: the rods of I_1",
        "relative error of I_1 = m a^2 / 12",
        ev.crank,
        1e-3,
    ),
    (
        "Table 1, I balanced",
        "rho as printed",
        "the optimum of (77)",
        "residual of the conditions",
        ev.balanced("I", "printed"),
        1e-14,
    ),
    (
        "Table 1, II balanced",
        "rho, alpha as printed",
        "the optimum of (77)",
        "residual of the conditions",
        ev.balanced("II", "printed"),
        1e-14,
    ),
    (
        "Table 1, II balanced",
        "the same with m2 = 0.24, m3 = 0.31 kg",
        "the optimum of (77)",
        "residual of the conditions",
        ev.balanced("II", "corrected"),
        1e-14,
    ),
    (
        "Section 5",
        "torques become negligible",
        "the shaking force does; the torques grow",
        "peak of tau_1, repaired: of the force, over unbalanced",
        ev.negligible,
        1e-12,
    ),
)
