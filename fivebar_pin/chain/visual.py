"""Shapes to draw."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fivebar_pin._arrays import Array, Immutable, checked
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["Visual"]


@dataclass(frozen=True, slots=True, eq=False)
class Visual(Immutable):
    """A shape drawn on a frame of the tree; it has no mass.

    Attributes:
        frame: name of the frame it moves with.
        shape: "box", "cylinder", "capsule", "sphere" or "mesh".
        size: box (x, y, z); cylinder and capsule (radius, length along z); sphere (radius,); mesh (scale x, y, z) [m].
        placement: pose of the shape in the frame, homogeneous (4, 4).
        rgba: colour, each in [0, 1].
        mesh: file of a mesh, else "".
    """

    frame: str
    shape: str
    size: tuple[float, ...]
    placement: Array = field(default_factory=lambda: np.eye(4))
    rgba: tuple[float, float, float, float] = (0.6, 0.6, 0.65, 1.0)
    mesh: str = ""

    def __post_init__(self) -> None:
        lengths = {"box": 3, "cylinder": 2, "capsule": 2, "sphere": 1, "mesh": 3}
        if self.shape not in lengths:
            raise UnknownNameError("visual shape", self.shape, lengths)
        name = f"size of {self.shape} on {self.frame}"
        size = checked(name, self.size, (lengths[self.shape],))
        if self.shape == "mesh" and not size.all():
            raise InvalidInputError(name, size.tolist(), "must be scales other than zero")
        if self.shape != "mesh" and size.min() < 0.0:
            raise InvalidInputError(name, size.tolist(), "must not be negative [m]")
        object.__setattr__(self, "size", tuple(float(s) for s in size))
        object.__setattr__(self, "placement", checked("visual placement", self.placement, (4, 4)))
        object.__setattr__(self, "rgba", tuple(float(c) for c in checked("rgba", self.rgba, (4,))))
