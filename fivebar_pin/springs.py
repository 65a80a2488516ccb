"""Springs and dampers, between frames or on joints: what they are."""

from __future__ import annotations

from dataclasses import dataclass

from fivebar_pin._arrays import Immutable, number
from fivebar_pin.errors import InvalidInputError

__all__ = ["JointSpring", "Spring"]


@dataclass(frozen=True, slots=True)
class Spring(Immutable):
    """A spring with a damper beside it, between the origins of two frames.

    Attributes:
        frame1, frame2: names of frames of the model; one may be fixed to the ground (`universe`).
        stiffness: k [N/m].
        length: free length l [m].
        damping: c, of the change of length [N s/m].
    """

    frame1: str
    frame2: str
    stiffness: float
    length: float
    damping: float = 0.0

    def __post_init__(self) -> None:
        _check_numbers(f"spring {self.name}", self.stiffness, self.length, self.damping)
        if self.length < 0.0:
            raise InvalidInputError(f"length of spring {self.name}", self.length, "must be >= 0 [m]")
        if self.frame1 == self.frame2:
            raise InvalidInputError("spring frames", (self.frame1, self.frame2), "must differ")

    @property
    def name(self) -> str:
        """What messages and reports call it."""
        return f"{self.frame1}~{self.frame2}"


@dataclass(frozen=True, slots=True)
class JointSpring(Immutable):
    """A spring with a damper beside it, on a joint of one degree of freedom.

    Attributes:
        joint: name of the joint. On a continuous joint the deflection is taken within half a turn; one that
            a coupling ties counts its turns, and so does its spring.
        stiffness: k [N m/rad or N/m].
        rest: coordinate at which it is relaxed [rad or m].
        damping: b [N m s/rad or N s/m].
    """

    joint: str
    stiffness: float
    rest: float
    damping: float = 0.0

    def __post_init__(self) -> None:
        _check_numbers(f"spring {self.name}", self.stiffness, self.rest, self.damping)

    @property
    def name(self) -> str:
        """What messages and reports call it."""
        return f"on {self.joint}"


def _check_numbers(name: str, stiffness: float, length: float, damping: float) -> None:
    for what, value in (("stiffness", stiffness), ("rest", length), ("damping", damping)):
        number(f"{what} of {name}", value)
        if what != "rest" and value < 0.0:
            raise InvalidInputError(f"{what} of {name}", value, "must be >= 0")
