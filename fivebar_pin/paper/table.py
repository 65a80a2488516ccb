"""The paper's example: Table 1 and a motion of the kind that it names."""

from __future__ import annotations

import numpy as np

from fivebar_pin import motion as laws
from fivebar_pin._arrays import integer, number
from fivebar_pin.errors import UnknownNameError
from fivebar_pin.motion import Motion
from fivebar_pin.paper.linkage import FiveBar

__all__ = ["default_motion", "table_1"]

# Table 1 of the paper: |r_12|, |r_23|, |r_34|, |r_40|, |r_01|; masses; inertias; rho; alpha. The paper has no row for
# |r_12|: the unbalanced inertias are those of uniform rods, I = m a^2 / 12, which gives 0.02 m and 0.035 m.
_TABLE_1: dict[str, dict[str, tuple[tuple[float, ...], ...]]] = {
    "I": {
        "unbalanced": (
            (0.02, 0.1, 0.1, 0.04, 0.04),
            (0.03, 0.15, 0.15, 0.06),
            (1e-6, 1.25e-4, 1.25e-4, 8e-6),
            (0.5, 0.5, 0.5, 0.5),
            (0.0, 0.0, 0.0, 0.0),
        ),
        "balanced": (
            (0.02, 0.1, 0.1, 0.04, 0.04),
            (0.04, 0.14, 0.14, 0.08),
            (1.333e-6, 2.1666e-4, 1.6166e-4, 1.066e-5),
            (0.22, 0.8372, 0.5872, 1.64),
            (0.0, 0.0, 0.0, 0.0),
        ),
    },
    "II": {
        "unbalanced": (
            (0.035, 0.08, 0.1, 0.03, 0.05),
            (0.02, 0.2, 0.25, 0.05),
            (2.041e-6, 1.06e-4, 2.08e-4, 3.75e-6),
            (0.5, 0.5, 0.5, 0.5),
            (0.0, 0.0, 0.0, 0.0),
        ),
        "balanced": (
            (0.035, 0.08, 0.1, 0.03, 0.05),
            (0.03, 0.024, 0.031, 0.075),
            (1.6e-5, 1.69e-4, 3.6e-4, 1.72e-5),
            (0.16, 0.0753, 0.0627, 1.373),
            (0.0, 0.012, 0.065, 0.0),
        ),
    },
}
_CORRECTED_MASSES = (0.03, 0.24, 0.31, 0.075)  # case II balanced, if 0.024 and 0.031 are slips


def table_1(case: str, column: str, *, reading: str = "printed") -> FiveBar:
    """Return a column of the paper's Table 1, with |r_12| supplied (the table has no row for it).

    The printed "balanced" columns do not satisfy the balancing conditions; see `audit_table_1`.

    Args:
        case: "I" or "II".
        column: "unbalanced" or "balanced".
        reading: "printed", or "corrected": m2 = 0.24 and m3 = 0.31 kg in place of 0.024 and 0.031 in the balanced
            column of case II. The other columns read the same either way.

    Raises:
        UnknownNameError: a case, column or reading that does not exist.
    """
    for kind, name, known in (
        ("case", case, tuple(_TABLE_1)),
        ("column", column, tuple(_TABLE_1["I"])),
        ("reading", reading, ("printed", "corrected")),
    ):
        if name not in known:
            raise UnknownNameError(kind, name, known)
    lengths, masses, inertias, rho, alpha = _TABLE_1[case][column]
    if (case, column, reading) == ("II", "balanced", "corrected"):
        masses = _CORRECTED_MASSES
    return FiveBar(lengths, masses, inertias, rho, alpha)


def default_motion(*, samples: int = 201, period: float = 1.0) -> Motion:
    """Return the motion used where none is given: link 1 turns once, link 4 swings.

    psi runs from 0 to 2 pi along a cycloid and gamma = pi/3 + (pi/6)(1 - cos(2 pi t / period)). The paper names the
    two laws but its curves are lost; these values are this library's.

    Args:
        samples: number of instants over [0, period], both ends included.
        period: duration [s].
    """
    samples = integer("samples", samples, least=2, most=10**8)
    number("period", period, positive=True, unit="s")
    t = np.linspace(0.0, period, samples)
    psi = laws.cycloidal(t, 0.0, 2.0 * np.pi, duration=period)
    return laws.combine(psi, laws.harmonic(t, np.pi / 2.0, -np.pi / 6.0, period=period))
