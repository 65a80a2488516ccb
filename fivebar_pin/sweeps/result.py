"""What came out of a sweep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, figures
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["Status", "Sweep"]


class Status(IntEnum):
    """How the motion of a design ended."""

    OK = 0
    """It went through."""
    OPEN = 1
    """The loops cannot be closed at the first sample, on the assembly mode of the chain that was given."""
    SINGULAR = 2
    """The way is blocked at a sample: out of reach beyond it, or a type 2 singularity; or a spring's ends meet."""
    LIMITS = 3
    """A joint passes its limits."""
    UNLIKE = 4
    """Its closures act in other directions than those of the chain: it leaves the plane. It needs its own chain."""
    UNREAL = 5
    """A body is none: a bar without length, corners on a line, cut down to less than nothing."""


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Immutable):
    """Values for n designs, nan where there are none.

    Attributes:
        status: a `Status` for every design (n,).
        reached: number of samples that it went through (n,).
        values: by the name that was asked for, (n,) or (n, samples, k).
        parameters: the designs, named lengths and placements (n,).
    """

    status: npt.NDArray[np.int8]
    reached: npt.NDArray[np.int64]
    values: Mapping[str, Array]
    parameters: Mapping[str, Array]

    def __getitem__(self, name: str) -> Array:
        if name not in self.values:
            raise UnknownNameError("quantity of this sweep", name, self.values)
        return self.values[name]

    def __len__(self) -> int:
        return int(self.status.size)

    def __repr__(self) -> str:
        ends = [f"{np.count_nonzero(self.status == s)} {s.name.lower()}" for s in Status if np.any(self.status == s)]
        least = [
            f"{k} from {figures(float(np.nanmin(x)))}" for k, x in self.values.items() if x.ndim == 1 and self.ok.any()
        ]
        return f"Sweep({len(self)} designs: {', '.join(ends) or 'none'}{'; ' if least else ''}{', '.join(least)})"

    @property
    def ok(self) -> npt.NDArray[np.bool_]:
        """Which designs went through (n,)."""
        return np.asarray(self.status == Status.OK)

    def best(self, name: str) -> int:
        """Return the number of the design with the smallest value.

        Raises:
            UnknownNameError: a quantity that was not asked for.
            InvalidInputError: a series, or no design went through.
        """
        x = self[name]
        if x.ndim != 1:
            raise InvalidInputError("name", name, "must be of one number a design", "Ask for its peak or rms.")
        if not self.ok.any():
            raise InvalidInputError("designs that went through", 0, "must be one at least")
        return int(np.nanargmin(x))
