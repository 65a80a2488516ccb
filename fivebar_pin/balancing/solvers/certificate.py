"""Proofs that a program has no solution, checked here.

There is no x with g + G x in K when some z in the dual cone has G^T z = 0 and g.z < 0 (Farkas).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.solvers.program import Program, outside
from fivebar_pin.errors import SolverError

__all__ = ["Certificate", "certificate_of", "polished"]

_LISTED = 8  # conflicts written out in a message


@dataclass(frozen=True, slots=True, eq=False)
class Certificate:
    """A proof that a set of conditions and bounds has no solution.

    Attributes:
        stationarity: largest entry of G^T z [-]; zero in exact arithmetic.
        violation: how far z is outside the dual cone [-]; zero in exact arithmetic.
        size: any solution would have to be larger than this many times the mechanism itself [-].
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


def certificate_of(program: Program, z: Array, g: Array, tolerance: float) -> Certificate:
    """Polish and check a dual ray; the solver's word is not taken for it.

    Raises:
        SolverError: it proves nothing.
    """
    z = polished(program, z, g)
    stationarity = float(np.abs(program.G.T @ z).max(initial=0.0))
    violation = 0.0
    for block, part in zip(program.blocks, program.slices, strict=True):
        if block.cone != "zero":
            violation = max(violation, outside(block.cone, z[part]))
    if not max(stationarity, violation) <= tolerance:
        raise SolverError(
            f"the conic solver reports infeasibility, but its certificate is off by {stationarity:.2g} and "
            f"{violation:.2g}, {tolerance:g} is needed",
            residual=max(stationarity, violation),
            tolerance=tolerance,
        )
    size = 1.0 / max(stationarity + violation, 1e-300)
    return Certificate(stationarity, violation, size, _conflict(program, z, g))


def polished(program: Program, z: Array, g: Array) -> Array:
    """Return a dual ray moved onto G^T z = 0, with g.z = -1."""
    z = z / -float(g @ z)
    z = z - _reach(program, z) @ (program.G.T @ z)
    return np.asarray(z / -float(g @ z))


def _reach(program: Program, z: Array) -> Array:
    """Return the weighted pseudo-inverse (rows, n) of G^T; rows that z uses are moved most."""
    weight = np.ones_like(z)
    for block, part in zip(program.blocks, program.slices, strict=True):
        if block.cone != "zero":
            weight[part] = np.minimum(1.0, np.linalg.norm(z[part]))
    W = weight[:, None] * program.G
    return np.asarray(weight[:, None] * np.linalg.pinv(W.T, rcond=1e-10))


def _conflict(program: Program, z: Array, g: Array) -> dict[str, float]:
    share: dict[str, float] = {}
    use: dict[str, float] = {}
    for block, part in zip(program.blocks, program.slices, strict=True):
        labels = (block.label,) * z[part].size if isinstance(block.label, str) else block.label
        for label, zi, gi in zip(labels, z[part], g[part], strict=True):
            share[label] = share.get(label, 0.0) - float(zi * gi)
            use[label] = max(use.get(label, 0.0), abs(float(zi)))
    largest = max(use.values(), default=0.0)
    kept = [label for label in use if use[label] > 1e-6 * largest]
    return {label: share[label] for label in sorted(kept, key=lambda k: -abs(share[k]))}
