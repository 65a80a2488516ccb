"""Many designs of one mechanism along the same motion."""

from fivebar_pin.sweeps.result import Status, Sweep
from fivebar_pin.sweeps.run import sweep

__all__ = ["Status", "Sweep", "sweep"]
