"""A quantity along motions as rows that are linear in the inertial parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, Immutable

__all__ = ["Rows", "root_mean_square"]


@dataclass(frozen=True, slots=True, eq=False)
class Rows(Immutable):
    """A quantity along motions: values = F pi + f.

    Attributes:
        name: of the quantity, one of `MEASURES`.
        F: (n, rows, 10 nb).
        f: (n, rows).
        groups: rows that belong to one vector: a peak is the largest length of such a vector.
        labels: name of each group.
    """

    name: str
    F: Array
    f: Array
    groups: tuple[slice, ...]
    labels: tuple[str, ...]

    @property
    def single(self) -> bool:
        """Whether every group is one number."""
        return all(g.stop - g.start == 1 for g in self.groups)

    def values(self, pi: Array) -> Array:
        """Return the values (n, rows) at parameters (nb, 10)."""
        return np.asarray(self.F @ pi.reshape(-1) + self.f)

    def sizes(self, pi: Array) -> Array:
        """Return the sum of the sizes of what adds up to each value (n, rows), see `Loads.scale`."""
        return np.asarray(np.abs(self.F) @ np.abs(pi.reshape(-1)) + np.abs(self.f))

    def rms(self, pi: Array) -> float:
        """Return the root of the mean square over samples, all rows summed."""
        return root_mean_square(self.values(pi))

    def peak(self, pi: Array) -> float:
        """Return the largest length of a group over all samples."""
        return self.longest(self.values(pi))

    def longest(self, values: Array) -> float:
        """Return the largest length of a group of values (n, rows)."""
        return max((float(np.linalg.norm(values[:, g], axis=1).max()) for g in self.groups), default=0.0)


def root_mean_square(values: Array) -> float:
    """Return the root of the mean over samples of the sum of squares of values (n, rows)."""
    return float(np.sqrt(np.mean(np.sum(values**2, axis=1))))
