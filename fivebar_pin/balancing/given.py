"""What a balancing problem was asked for, with what was computed once from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.conditions import BalanceConditions
from fivebar_pin.balancing.parameters import Space
from fivebar_pin.balancing.pieces.piece import Piece
from fivebar_pin.balancing.regions.region import Region
from fivebar_pin.balancing.regressors.measures import Rows
from fivebar_pin.balancing.setting import MassBounds
from fivebar_pin.chain import ClosedChain
from fivebar_pin.trajectory import Trajectory

__all__ = ["Given"]


@dataclass(frozen=True, slots=True, eq=False)
class Given(Immutable):
    """Arguments of `balance_problem`, checked, with the conditions and the quantities along the motions.

    Attributes:
        chain, kind, conditions: what is balanced.
        space: the parameters of the problem.
        mode: "add" or "redesign".
        objectives: names of the terms that are prepared.
        bodies, removable: indices of the bodies that may change, and that may lose material.
        region, masses, counterweight, limits: as for `balance`.
        density: of the material [kg/m3] and its thickness in the plane [m], or None for any.
        paths, rows: the motions and the quantities along them.
        near: configuration (nq,) of the one branch that is balanced, or None.
        solver: name of the solver.
    """

    chain: ClosedChain
    kind: str | None
    conditions: BalanceConditions | None
    space: Space
    mode: str
    objectives: tuple[str, ...]
    bodies: tuple[int, ...]
    removable: tuple[int, ...]
    region: Region | Mapping[str, Region] | None
    masses: MassBounds
    counterweight: Piece | Mapping[str, Piece] | None
    density: tuple[float, float] | None
    limits: Mapping[str, npt.ArrayLike]
    paths: tuple[Trajectory, ...] = field(repr=False)
    rows: Mapping[str, Rows] = field(repr=False)
    near: Array | None
    solver: str
