"""The paper's planar five-bar in closed form."""

from fivebar_pin.paper.linkage import AssemblyMode, FiveBar, default_motion, table_1

__all__ = ["AssemblyMode", "FiveBar", "default_motion", "table_1"]
