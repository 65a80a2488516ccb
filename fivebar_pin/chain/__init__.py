"""ClosedChain: the one immutable description of a mechanism."""

from fivebar_pin.chain.bodies import BarBody, LumpBody, PlateBody
from fivebar_pin.chain.closed_chain import ClosedChain
from fivebar_pin.chain.frames import find_frame, frames_by_name
from fivebar_pin.chain.parameters import Geometry, Placement
from fivebar_pin.chain.visual import Visual

__all__ = [
    "BarBody",
    "ClosedChain",
    "Geometry",
    "LumpBody",
    "Placement",
    "PlateBody",
    "Visual",
    "find_frame",
    "frames_by_name",
]
