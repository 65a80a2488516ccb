"""The mechanisms that ship, as functions, and the building blocks that they are made of."""

from fivebar_pin.shipped.mechanisms import MECHANISMS, save_mechanisms
from fivebar_pin.shipped.tree_builder import TreeBuilder

__all__ = [
    "MECHANISMS",
    "TreeBuilder",
    "save_mechanisms",
]
