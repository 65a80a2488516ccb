"""What counterweights are made as: discs, bars and balls of one material."""

from __future__ import annotations

from fivebar_pin.balancing.pieces.piece import MATERIALS, Bar, Disc, Piece, Sphere

__all__ = ["MATERIALS", "Bar", "Disc", "Piece", "Sphere"]
