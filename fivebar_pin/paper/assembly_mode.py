"""The two ways in which the loop of the five-bar closes."""

from __future__ import annotations

from enum import Enum

from fivebar_pin.errors import UnknownNameError

__all__ = ["AssemblyMode"]


class AssemblyMode(Enum):
    """Which of the two solutions of the loop closure (6): O3 to the left or right of the ray from O2 to O4."""

    LEFT = "left"
    RIGHT = "right"

    @property
    def sign(self) -> float:
        """+1 for LEFT, -1 for RIGHT."""
        return 1.0 if self is AssemblyMode.LEFT else -1.0

    @classmethod
    def parse(cls, value: object) -> AssemblyMode:
        """Return the mode given as such or by its word.

        Raises:
            UnknownNameError: neither "left" nor "right".
        """
        if isinstance(value, cls):
            return value
        try:
            return cls(str(value).strip().lower())
        except ValueError:
            raise UnknownNameError("assembly mode", value, [m.value for m in cls]) from None
