"""Pieces from the words of `realise`."""

from __future__ import annotations

from fivebar_pin.balancing.pieces.materials import density_of, thickness_of
from fivebar_pin.balancing.pieces.piece import SHAPES, Piece
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import UnknownNameError

__all__ = ["piece_of"]


def piece_of(
    chain: ClosedChain,
    shape: str,
    material: str | float | None,
    thickness: float | None,
    arm: float | None,
) -> Piece:
    """Return the kind of piece that these words stand for; arguments as for `realise`."""
    if shape not in SHAPES:
        raise UnknownNameError("shape", shape, SHAPES)
    stuff = "steel" if material is None else material
    return SHAPES[shape].of(density_of(stuff), thickness_of(thickness, chain.length), arm)
