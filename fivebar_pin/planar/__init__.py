"""Planar linkages in their own words: points, bars, pivots, slides, gears, springs, masses, motors; and as files."""

from fivebar_pin.planar._reading import load
from fivebar_pin.planar.linkage import Linkage

__all__ = ["Linkage", "load"]
