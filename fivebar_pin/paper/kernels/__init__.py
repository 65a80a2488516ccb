"""The closed form of the paper, compiled: its loop, the motion of its links, its loads.

Tables of numbers in, tables of numbers out, nothing allocated. The functions run uncompiled as well
(`NUMBA_DISABLE_JIT=1`), for stepping through them.
"""

from fivebar_pin.paper.kernels.loads import Linkage, Loads, load
from fivebar_pin.paper.kernels.loop import close_loops, next_doubtful, unwind
from fivebar_pin.paper.kernels.movement import Movement, move

__all__ = ["Linkage", "Loads", "Movement", "close_loops", "load", "move", "next_doubtful", "unwind"]
