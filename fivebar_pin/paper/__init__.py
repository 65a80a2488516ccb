"""The paper's planar five-bar in closed form."""

from fivebar_pin.paper.linkage import AssemblyMode, FiveBar, default_motion, table_1
from fivebar_pin.paper.solution import Solution, solve, solve_states

__all__ = ["AssemblyMode", "FiveBar", "Solution", "default_motion", "solve", "solve_states", "table_1"]
