"""Whether conditions that were found before are those of a mechanism: what must be the same, and what may differ."""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.chain import ClosedChain
from fivebar_pin.closures import Anchored
from fivebar_pin.mechanism.loops import loops_of

__all__ = ["ALIKE", "alike", "same_gravity", "same_mechanism"]

ALIKE = 1e-9  # difference up to which directions [-], points, placements and configurations are the same [m, rad]


def alike(a: Array | None, b: Array | None) -> bool:
    """Whether two arrays are the same, or both missing."""
    if a is None or b is None:
        return a is b
    return bool(np.abs(a - b).max(initial=0.0) <= ALIKE)


def same_gravity(a: Array | None, b: Array | None, *, sized: bool) -> bool:
    """Whether two accelerations have the same direction, and the same size where it matters."""
    if a is None or b is None:
        return a is b
    one, two = float(np.linalg.norm(a)), float(np.linalg.norm(b))
    return alike(a / one, b / two) and (not sized or abs(one - two) <= ALIKE * one)


def same_mechanism(a: ClosedChain, b: ClosedChain) -> bool:
    """Whether two chains differ in nothing but masses, motors and names."""
    if a is b:
        return True
    one, two = a.model, b.model
    if a.joints != b.joints or a.nq != b.nq or len(a.closures) != len(b.closures):
        return False
    tree = list(one.parents) == list(two.parents) and all(
        M.isApprox(W, ALIKE) and j == k
        for M, W, j, k in zip(one.jointPlacements, two.jointPlacements, one.joints, two.joints, strict=True)
    )
    pairs = zip(loops_of(a).anchored, loops_of(b).anchored, strict=True)
    return tree and all(_same_closure(c, d) for c, d in pairs)


def _same_closure(c: Anchored, d: Anchored) -> bool:
    return c.closure.kind == d.closure.kind and c.tied == d.tied and alike(c.numbers(), d.numbers())
