"""The mechanisms that ship, as functions, and the building blocks that they are made of."""

from fivebar_pin.shipped.bars import Mechanism
from fivebar_pin.shipped.mechanisms import MECHANISMS, save_mechanisms

__all__ = [
    "MECHANISMS",
    "Mechanism",
    "save_mechanisms",
]
