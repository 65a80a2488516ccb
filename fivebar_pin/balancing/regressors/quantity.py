"""What a quantity along a motion is: how its matrix is built, and how terms of an objective see it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.regressors.rows import Rows
from fivebar_pin.chain import ClosedChain
from fivebar_pin.trajectory import Trajectory

__all__ = ["Builder", "Grouping", "Quantity", "by_motor", "deviation", "one_vector"]

Builder = Callable[[ClosedChain, Trajectory, Array], tuple[Array, Array]]  # chain, path, about -> matrix, offset
Grouping = Callable[[str, ClosedChain, Array, Array], Rows]  # name, chain, F, f of all motions -> rows


def one_vector(name: str, chain: ClosedChain, F: Array, f: Array) -> Rows:
    """Take all rows of a sample as one vector."""
    return Rows(name, F, f, (slice(0, F.shape[1]),), (name,))


def by_motor(name: str, chain: ClosedChain, F: Array, f: Array) -> Rows:
    """Take each row of a sample by itself, one for every motor."""
    return Rows(name, F, f, tuple(slice(k, k + 1) for k in range(chain.na)), chain.actuated)


def deviation(build: Builder) -> Builder:
    """Return the builder of what a quantity deviates by from its mean over a motion."""

    def built(chain: ClosedChain, trajectory: Trajectory, about: Array) -> tuple[Array, Array]:
        F, f = (np.array(part) for part in build(chain, trajectory, about))
        return F - F.mean(axis=0), f - f.mean(axis=0)

    return built


@dataclass(frozen=True, slots=True, eq=False)
class Quantity:
    """One entry of the table of quantities.

    Attributes:
        build: gives matrix (n, rows, 10 nb) and offset (n, rows); None where it is no regressor of its own.
        judged: what terms of an objective refer to, where it is not that; None where they do not refer to it.
        grouped: which rows are one vector.
    """

    build: Builder | None
    judged: Builder | None = None
    grouped: Grouping = one_vector
