"""The cones of one piece of material, from what is asked of it."""

from __future__ import annotations

import numpy as np

from fivebar_pin.balancing.moments import SPREAD, Moments
from fivebar_pin.balancing.pieces.solid import Solid
from fivebar_pin.balancing.solvers import Block
from fivebar_pin.balancing.variables.material import Bounds, Material

__all__ = ["material"]

_FAR = 100.0  # how far an elastic piece may stick out [of the region's least half extent]
_INSIDE = 1.0 - 1e-6  # share of a region that a piece to be made is solved for, lest round-off make it stick out


def material(body: int, sign: int, label: str, limits: Bounds, *, planar: bool, new: bool = False) -> Material:
    """Make the variables and cones of a piece of material."""
    shape, taken = limits.shape, limits.taken_from
    moments = Moments(
        planar=planar,
        center=None if shape is None else shape.center,
        spread=SPREAD if shape is None else SPREAD * shape.room,
        by_direction=limits.by_direction,
    )
    if taken is None:
        moments.physical(label)
    else:
        moments.taken_from(label, taken)
    if shape is not None:
        moments.cones.add(f"{label} stays in its region", "nonneg", shape.holds(moments), soft=True)
    overreach = None
    if limits.solid is not None:
        overreach = _makeable(moments, label, limits.solid, limits)
    elif limits.density is not None:
        moments.no_denser(label, limits.density.least)
    size, cones = moments.cones.count, moments.cones.blocks()
    if taken is not None:
        half = Block(f"{label} <= half its mass", "nonneg", -np.eye(1, size), 0.5 * taken[3:, 3])
        cones = (*cones, half)
    return Material(body, sign, planar, label, limits, size, cones, overreach, new)


def _makeable(moments: Moments, label: str, solid: Solid, limits: Bounds) -> int | None:
    """Ask for a piece that can be made and lies within its region as a whole; return its overreach."""
    cones, shape, overreach = moments.cones, limits.shape, None
    assert shape is not None
    text, w = f"{label} is {solid.word}", cones.variable(0.5 * shape.room)
    solid.require(moments, text, w, limits.radius, limits.point)
    if solid.across is not None:
        cones.add(f"{label} lies on its line", "zero", [moments.first(solid.across)], np.zeros(1))
    if limits.elastic:
        room = shape.room
        overreach = cones.count
        out = cones.variable(0.5 * room)
        cones.add(f"{label} sticks out", "nonneg", [out, _FAR * room * moments.m - out], np.array([1.0, 1.0]))
        w = w - out
    if limits.point is not None:
        if limits.stray is not None:
            cones.add(f"{label} stays near", "soc", [limits.stray * moments.m, *moments.off(limits.point)])
        shape = shape.shrunk(_INSIDE)
    shape.holds_round(moments, f"{label} lies in its region as a whole", w)
    return overreach
