"""Where material may lie."""

from __future__ import annotations

from fivebar_pin.balancing.regions.region import Ball, Box, Ellipsoid, Region, Shape, resolve

__all__ = ["Ball", "Box", "Ellipsoid", "Region", "Shape", "resolve"]
