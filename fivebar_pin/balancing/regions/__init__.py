"""Where material may lie: ball, box or ellipsoid in the axes of a body or of one of its frames; one file each.

A mass distribution with given mass, first and second moments (m, h, S) fits into an ellipsoid with centre c and
semi-axes a_i along d_i if and only if its pseudo-inertia is positive semidefinite and

    sum_i (d_i.S d_i - 2 (d_i.c) (d_i.h) + (d_i.c)^2 m) / a_i^2 <= m             [Wensing, Kim, Slotine 2018]

A box asks the same of every axis by itself, d_i.S d_i - ... <= a_i^2 m, and that products of two of its half-spaces
have non-negative mean. For a planar mechanism this is exact too; in space the box conditions are necessary ones.

A new region is a `Region`, what the user says, with its `Shape`, what it is in the space of one body.
"""

from __future__ import annotations

from fivebar_pin.balancing.regions.ball import Ball
from fivebar_pin.balancing.regions.box import Box
from fivebar_pin.balancing.regions.ellipsoid import Ellipsoid
from fivebar_pin.balancing.regions.region import Region
from fivebar_pin.balancing.regions.shape import Shape

__all__ = ["Ball", "Box", "Ellipsoid", "Region", "Shape"]
