"""ClosedChain: the one immutable description of a mechanism."""

from fivebar_pin.chain.closed_chain import ClosedChain
from fivebar_pin.chain.frames import find_frame, frames_by_name
from fivebar_pin.chain.visual import Visual

__all__ = [
    "ClosedChain",
    "Visual",
    "find_frame",
    "frames_by_name",
]
