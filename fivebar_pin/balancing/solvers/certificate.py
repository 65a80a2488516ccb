"""Proofs that a program has no solution, checked here.

There is no x with g + G x in K when some z in the dual cone has G^T z = 0 and g.z < 0 (Farkas). In floating point
G^T z is not quite zero; what that leaves open is compared with the bounds on the variables (see `bound`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.solvers.bound import reach, stationary
from fivebar_pin.balancing.solvers.cones import outside
from fivebar_pin.balancing.solvers.program import Program
from fivebar_pin.errors import SolverError

__all__ = ["Certificate", "certificate_of", "polished"]

_PLAYS_A_PART = 1e-6  # multiplier of a row that is named as in conflict [of the largest]
_LISTED = 8  # conflicts written out in a message
_POLISHED = 4  # times a ray is moved onto G^T z = 0 and back into the dual cone
_PROVES = 1e-2  # what a proof may leave open [-]; anything below one proves, the rest is for errors of the data
_UNSIZED = 1e-8  # largest entry of G^T z of a proof where the variables have no bounds [-]
_LEAST = 1e-15  # nothing is proved better than this [-]


@dataclass(frozen=True, slots=True, eq=False)
class Certificate(Immutable):
    """A proof that a set of conditions and bounds has no solution.

    Attributes:
        stationarity: largest entry of G^T z [-]; zero in exact arithmetic.
        violation: how far z is outside the dual cone [-]; round-off.
        size: any solution would have to be larger than this many times the bounds on the variables that follow from
            the problem: masses by their bounds (ten moving masses where there is none), moments by the regions [-].
        conflict: the conditions and bounds that take part, with their share of the contradiction g.z = -1.
    """

    stationarity: float
    violation: float
    size: float
    conflict: dict[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        names = list(self.conflict)
        listed = "; ".join(names[:_LISTED]) + (f"; and {len(names) - _LISTED} more" if len(names) > _LISTED else "")
        return (
            f"no solution (Farkas certificate checked: |G^T z| = {self.stationarity:.1e}, outside the dual cone by "
            f"{self.violation:.1e}); in conflict: {listed}"
        )


def certificate_of(program: Program, z: Array, g: Array) -> Certificate:
    """Polish and check a dual ray; the solver's word is not taken for it.

    Raises:
        SolverError: it proves nothing.
    """
    best, least = z, float("inf")
    if float(g @ z) < 0.0 and np.isfinite(z).all():
        for _ in range(_POLISHED):
            z = program.projected(polished(program, z, g))
            if not float(g @ z) < 0.0:
                break
            z = z / -float(g @ z)
            left = _left(program, z, g)
            if left < least:
                best, least = z, left
    if not least <= _PROVES:
        raise SolverError(
            f"the conic solver reports infeasibility, but its certificate leaves room for solutions of "
            f"{1.0 / least:.2g} times the bounds on the variables, {1.0 / _PROVES:g} is needed",
            residual=least,
            tolerance=_PROVES,
        )
    stationarity = float(np.abs(program.G.T @ best).max(initial=0.0))
    return Certificate(stationarity, _violation(program, best), 1.0 / least, _conflict(program, best, g))


def _left(program: Program, z: Array, g: Array) -> float:
    """Return what a ray leaves open: its share of a contradiction that the bounds on the variables could undo."""
    if np.isfinite(program.sizes).all():
        return max(reach(program, z, g), _LEAST)
    return max(float(np.abs(program.G.T @ z).max(initial=0.0)), _LEAST) * _PROVES / _UNSIZED


def _violation(program: Program, z: Array) -> float:
    cones = [(b.cone, z[part]) for b, part in zip(program.blocks, program.slices, strict=True) if b.cone != "zero"]
    return max((outside(cone, part) for cone, part in cones), default=0.0)


def polished(program: Program, z: Array, g: Array) -> Array:
    """Return a dual ray moved onto G^T z = 0, with g.z = -1; zero where nothing of it is left."""
    z = stationary(program, z / -float(g @ z), np.zeros(program.n))
    against = -float(g @ z)
    return np.asarray(z / against) if against else np.zeros_like(z)


def _conflict(program: Program, z: Array, g: Array) -> dict[str, float]:
    share: dict[str, float] = {}
    use: dict[str, float] = {}
    for block, part in zip(program.blocks, program.slices, strict=True):
        labels = (block.label,) * z[part].size if isinstance(block.label, str) else block.label
        for label, zi, gi in zip(labels, z[part], g[part], strict=True):
            share[label] = share.get(label, 0.0) - float(zi * gi)
            use[label] = max(use.get(label, 0.0), abs(float(zi)))
    largest = max(use.values(), default=0.0)
    kept = [label for label in use if use[label] > _PLAYS_A_PART * largest]
    return {label: share[label] for label in sorted(kept, key=lambda k: -abs(share[k]))}
