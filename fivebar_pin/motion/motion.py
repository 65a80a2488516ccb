"""Motion of the actuated coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable, checked, finite, number
from fivebar_pin.errors import InvalidInputError

__all__ = ["Motion", "combine"]


@dataclass(frozen=True, slots=True, eq=False)
class Motion(Immutable):
    """Sampled motion of the actuated coordinates.

    Attributes:
        t: times, strictly increasing (n,) [s].
        q: coordinates (n, na) [rad or m]; the columns follow `ClosedChain.actuated`.
        v: velocities (n, na).
        a: accelerations (n, na).

    Raises:
        InvalidInputError: shapes that do not fit, values that are not finite, times that do not increase.
    """

    t: Array
    q: Array
    v: Array
    a: Array

    def __post_init__(self) -> None:
        t = checked("motion.t", self.t, (None,))
        if t.size == 0:
            raise InvalidInputError("motion.t", [], "must hold at least one sample")
        q = checked("motion.q", self.q, (t.size, None))
        v = checked("motion.v", self.v, q.shape)
        a = checked("motion.a", self.a, q.shape)
        late = np.flatnonzero(np.diff(t) <= 0.0)
        if late.size:
            k = int(late[0]) + 1
            raise InvalidInputError(f"motion.t[{k}]", float(t[k]), f"times must increase (t[{k - 1}] = {t[k - 1]})")
        for name, array in (("t", t), ("q", q), ("v", v), ("a", a)):
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        return int(self.t.size)

    @property
    def na(self) -> int:
        """Number of actuated coordinates."""
        return int(self.q.shape[1])

    @finite()
    def scaled(self, speed: float) -> Motion:
        """Return the same path run `speed` times as fast."""
        k = number("speed", speed, positive=True)
        return Motion(self.t / k, self.q, self.v * k, self.a * k**2)


def combine(*motions: Motion) -> Motion:
    """Put motions over the same times side by side, one column after the other."""
    if not motions:
        raise InvalidInputError("motions", [], "must hold at least one motion")
    t = motions[0].t
    for k, m in enumerate(motions):
        if m.t.shape != t.shape or not np.array_equal(m.t, t):
            raise InvalidInputError(f"motions[{k}].t", m.t.shape, "must equal the times of motions[0]")
    return Motion(t, *(np.concatenate([getattr(m, x) for m in motions], axis=1) for x in ("q", "v", "a")))
