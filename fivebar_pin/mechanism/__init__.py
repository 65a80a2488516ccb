"""What is decided about a mechanism, each in one place: the tree, the loops, rank, closing, charts."""

from fivebar_pin.mechanism.loops import Loops, loops_of
from fivebar_pin.mechanism.manifold import Manifold, manifold_of

__all__ = ["Loops", "Manifold", "loops_of", "manifold_of"]
