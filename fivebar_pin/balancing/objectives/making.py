"""Objectives and upper bounds of a balancing problem, from their names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, reals
from fivebar_pin.balancing.objectives.term import (
    LINEAR,
    Term,
    base,
    check_terms,
    linear_term,
    measure_of,
    positive_limit,
    rows_term,
    torque_limits,
)
from fivebar_pin.balancing.regressors.measures import Rows, reflected_inertia
from fivebar_pin.balancing.setting import Setup
from fivebar_pin.balancing.solvers import Block
from fivebar_pin.balancing.variables.material import Material
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError
from fivebar_pin.trajectory import Trajectory

__all__ = ["OVERREACH", "TermMaker", "overreach", "weights_of"]

OVERREACH = "overreach"  # of counterweights that may stick out of their regions, on the way to some that do not
_HEAVIEST = 1e30  # weight of a term: products with it do not overflow [-]


@dataclass(frozen=True, slots=True, eq=False)
class TermMaker(Immutable):
    """Builds terms and limits over designs X = X0 + E y (scaled) and pi = pi0 + full_E y."""

    chain: ClosedChain
    setup: Setup
    rows: dict[str, Rows]
    paths: tuple[Trajectory, ...]
    E: Array
    X0: Array
    full_E: Array
    pi0: Array

    def make(self, name: str) -> Term:
        """Return a term by its base name."""
        present = self.chain.inertial_parameters.reshape(-1)
        if name in LINEAR:
            weight = np.zeros(present.size)
            weight[::10] = 1.0
            if name == "inertia":
                if not self.paths:
                    raise InvalidInputError("motions", [], "must hold at least one motion for inertia")
                weight = reflected_inertia(self.chain, self.paths)
            now = float(weight @ present)
            constant = float(weight @ self.pi0) - (now if name == "added_mass" else 0.0)
            measured = partial(_weighed, weight, now if name == "added_mass" else 0.0)
            return linear_term(name, weight @ self.full_E, constant, abs(now) or 1.0, measured)
        if name == "distance":
            X = self.setup.space.of(self.chain.inertial_parameters).reshape(-1) / self.setup.unit
            return Term(name, ((self.E, self.X0 - X),), False, 1.0, partial(_distance, self.setup))
        quantity = measure_of(name)
        assert quantity is not None
        return rows_term(name, self.rows[quantity], self.full_E, self.pi0, present)

    def limits(self, limits: Mapping[str, npt.ArrayLike]) -> list[Block]:
        """Return the cones of all upper bounds."""
        blocks: list[Block] = []
        for name, top in limits.items():
            if name == "peak_torque":
                blocks += torque_limits(top, self.rows["torque"], self.full_E, self.pi0)
            else:
                limit = positive_limit(name, top)
                root = np.sqrt(limit) if name.startswith("mean_square_") else limit
                blocks += self.make(base(name)).bounded(float(root))
        return blocks


def _weighed(weight: Array, now: float, pi: Array) -> float:
    return float(weight @ pi.reshape(-1)) - now


def _distance(setup: Setup, pi: Array) -> float:
    away = setup.space.of(pi - setup.chain.inertial_parameters).reshape(-1) / setup.unit
    return float(np.linalg.norm(away))


def overreach(materials: Sequence[Material], n: int) -> Term:
    """Return how far all elastic pieces stick out of their regions together, times their masses, scaled.

    It is no property of the bodies, and counts as nothing once they are made.
    """
    row = np.zeros(n)
    row[[m.start + m.overreach for m in materials if m.overreach is not None]] = 1.0
    return linear_term(OVERREACH, row, 0.0, 1.0, lambda pi: 0.0)


def weights_of(minimise: str | Mapping[str, float] | None, mode: str) -> dict[str, float]:
    """Return the terms and their weights, checked."""
    if minimise is None:
        minimise = "distance" if mode == "redesign" else "added_mass"
    given = {minimise: 1.0} if isinstance(minimise, str) else minimise
    if not isinstance(given, Mapping) or not given:
        raise InvalidInputError("minimise", minimise, "must be a term, or terms with their weights {term: weight}")
    check_terms(given, "objective")
    weights = {}
    for name, weight in given.items():
        value = reals(f"weight of {name}", weight)
        if value.ndim or not (0.0 <= value <= _HEAVIEST):
            raise InvalidInputError(f"weight of {name}", weight, f"must be one finite number from 0 to {_HEAVIEST:g}")
        weights[name] = float(value)
    if not any(weights.values()):
        raise InvalidInputError("minimise", weights, "must have a positive weight")
    return weights
