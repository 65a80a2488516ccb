"""What is computed sample by sample, compiled: kinematics of the tree, closing the loops, equations of motion.

Tables of numbers in, tables of numbers out. The functions read as the textbook and run uncompiled as well
(`NUMBA_DISABLE_JIT=1`), for stepping through them.
"""

from fivebar_pin.engine.tables import Integers

__all__ = ["Integers"]
