"""Mechanisms from files and to files: URDF with a sidecar, MJCF, and the ones that ship."""

from fivebar_pin.io._load import load
from fivebar_pin.io._save import save

__all__ = ["load", "save"]
