"""What closures about an axis share: the axis, and the two rows that keep the axes of both frames parallel.

With the axis n (the same coordinates in both frames), t_1, t_2 that complete it to an orthonormal triad, and
Q = R_1^T R_2, the tilts t_k . Q n vanish where the axes are parallel; they also do where the axes point against each
other, which is a false solution.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, checked, frozen, seal
from fivebar_pin.closures.anchored import FramePair
from fivebar_pin.closures.closure import Entry, Mark
from fivebar_pin.closures.frame_closure import FrameClosure
from fivebar_pin.errors import InvalidInputError

__all__ = ["AxisClosure", "Triad"]

_LEAST_AXIS = 1e-9  # largest component below which an axis has no direction [-]
_HUGE = 1e100  # component above which the square of the axis's length would overflow [-]

Triad = tuple[Array, Array]


@dataclass(frozen=True, eq=False)
class AxisClosure(FrameClosure):
    """A closure about an axis; abstract.

    Attributes:
        axis: unit, in the axes of either frame (3,).
    """

    axis: npt.ArrayLike = (0.0, 0.0, 1.0)

    entries: ClassVar[tuple[Entry, ...]]
    may_oppose: ClassVar[bool] = True

    def __post_init__(self) -> None:
        axis = checked("closure axis", self.axis, (3,))
        longest = float(np.abs(axis).max())
        if longest < _LEAST_AXIS:
            raise InvalidInputError("closure axis", axis.tolist(), "must not be zero")
        axis = axis / longest if longest > _HUGE else axis
        object.__setattr__(self, "axis", frozen(axis / np.linalg.norm(axis)))
        FrameClosure.__post_init__(self)

    @property
    def mark(self) -> Mark:
        """A pin along the axis."""
        return Mark("pin", np.asarray(self.axis))

    @cached_property
    def triad(self) -> Triad:
        """The axis n (3,) and the two rows t_k (2, 3) that complete it."""
        n = np.asarray(self.axis, dtype=np.float64)
        t1 = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))])
        t1 /= np.linalg.norm(t1)
        across = np.stack([t1, np.cross(n, t1)])
        seal(across)
        return n, across

    def opposed(self, pair: FramePair) -> npt.NDArray[np.bool_]:
        """Return where the two axes point against each other (a false solution)."""
        n, _ = self.triad
        return np.asarray(self.seen_axis(pair) @ n < 0.0)

    def seen_axis(self, pair: FramePair) -> Array:
        """Return the axis of frame 2 in the axes of frame 1, Q n (..., 3)."""
        return np.asarray(np.matmul(np.matmul(np.swapaxes(pair.R1, -1, -2), pair.R2), self.triad[0]))
