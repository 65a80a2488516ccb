"""Counterweights that can be made, as bounds on their moments: discs, bars and balls of one material.

A flat piece of density d and thickness t, mass m, polar inertia I_c about its own centre and outer radius r has

    disc with a bore or without:   I_c >= m^2 / (2 pi d t),    r^2 =   I_c / m + m / (2 pi d t)
    bar, square or longer:         I_c >= m^2 / (6 d t),       r^2 = 3 I_c / m        (half its diagonal)

and equality on the left is the solid disc, the square bar. With w = m r both read w^2 = alpha m I_c + beta m^3, so

    w >= sqrt(alpha least + beta) m^(3/2)              every piece (convex: a bound from below on what can be made)
    w >= (r_0 m + (alpha I_c + beta m^2) / r_0) / 2    enough for a chosen r_0 (linear, exact where r = r_0)

and the piece lies within a ball of radius R about c when |m c' - m c| + w <= R m. A ball of density d has the radius
(3 m / (4 pi d))^(1/3) and the second moments k m^(5/3) in every direction, k = (3 / (4 pi d))^(2/3) / 5; of all bodies
no denser than d it is the one with the smallest det(second moments), so det(S_c)^(1/3) >= k m^(5/3) for any of them.
"""

from __future__ import annotations

from fivebar_pin.balancing.pieces.bar import Bar
from fivebar_pin.balancing.pieces.disc import Disc
from fivebar_pin.balancing.pieces.materials import MATERIALS
from fivebar_pin.balancing.pieces.piece import SHAPES, Piece
from fivebar_pin.balancing.pieces.sphere import Sphere
from fivebar_pin.balancing.pieces.stated import piece_of

__all__ = ["MATERIALS", "SHAPES", "Bar", "Disc", "Piece", "Sphere", "piece_of"]
