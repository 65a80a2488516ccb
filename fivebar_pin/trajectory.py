"""Trajectory: the motion of the whole tree, whichever road computed it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable, numeric
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError

__all__ = ["Trajectory"]


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory(Immutable):
    """Consistent motion of all coordinates of a closed chain.

    Attributes:
        t: times (n,) [s].
        q: configurations (n, nq), Pinocchio's layout.
        v: velocities (n, nv) [rad/s or m/s].
        a: accelerations (n, nv).
        N: complement (n, nv, na): v = N @ v_actuated, J N = 0.
        closure_residual: largest closure residual of each sample (n,) [m or rad].
    """

    t: Array
    q: Array
    v: Array
    a: Array
    N: Array
    closure_residual: Array

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if not isinstance(value, np.ndarray) or value.dtype != np.float64 or value.flags.writeable:
                object.__setattr__(self, name, numeric(f"trajectory.{name}", value))

    def __len__(self) -> int:
        return int(self.t.size)

    def require_of(self, chain: ClosedChain) -> None:
        """Raise unless this trajectory can belong to the chain.

        Raises:
            InvalidInputError: another number of coordinates or motors.
        """
        n = len(self)
        if self.q.shape != (n, chain.nq) or self.N.shape != (n, chain.nv, chain.na):
            raise InvalidInputError(
                "trajectory",
                f"q {self.q.shape}, N {self.N.shape}",
                f"must belong to this chain: q ({n}, {chain.nq}), N ({n}, {chain.nv}, {chain.na})",
            )

    @property
    def worst_closure(self) -> float:
        """Largest closure residual over all samples [m or rad]."""
        return float(np.max(self.closure_residual))
