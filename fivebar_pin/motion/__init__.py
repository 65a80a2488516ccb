"""Motion of the actuated coordinates, and the motion laws that make one."""

from fivebar_pin.motion.laws import constant, cycloidal, harmonic, polynomial, spline
from fivebar_pin.motion.motion import Motion, combine
from fivebar_pin.motion.tables import from_file, to_file

__all__ = [
    "Motion",
    "combine",
    "constant",
    "cycloidal",
    "from_file",
    "harmonic",
    "polynomial",
    "spline",
    "to_file",
]
