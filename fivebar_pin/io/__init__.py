"""Mechanisms from files and to files: URDF and SDF with a sidecar, MJCF, and the ones that ship.

`fivebar_pin.shipped` holds the functions that make the shipped mechanisms, and the legs of the Solo robot.
"""

from fivebar_pin.io._load import load
from fivebar_pin.io._save import save
from fivebar_pin.io._shipped import shipped, shipped_path

__all__ = ["load", "save", "shipped", "shipped_path"]
