"""Planar linkages in their own words: points, bars, pivots, slides, springs, masses, motors."""

from fivebar_pin.planar.linkage import ALUMINIUM, Linkage

__all__ = ["ALUMINIUM", "Linkage"]
