"""What is minimised: atoms and their weights, from the words of `balance`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fivebar_pin._arrays import reals
from fivebar_pin.balancing.objectives.objective import Objective, named
from fivebar_pin.errors import InvalidInputError

__all__ = ["Minimised", "weights_of"]

Minimised = str | Objective | Mapping[Any, float]  # keys are names or atoms
_HEAVIEST = 1e30  # weight of a term: products with it do not overflow [-]


def weights_of(minimise: Minimised) -> dict[Objective, float]:
    """Return the atoms and their weights, checked.

    Raises:
        UnknownNameError: an atom that does not exist.
        InvalidInputError: nothing to minimise, or weights that are none.
    """
    given: Mapping[Any, float] = {minimise: 1.0} if isinstance(minimise, (str, Objective)) else minimise
    if not isinstance(given, Mapping) or not given:
        raise InvalidInputError("minimise", minimise, "must be a term, or terms with their weights {term: weight}")
    atoms = {name: named(name, "objective") for name in given}
    weights: dict[Objective, float] = {}
    for name, weight in given.items():
        value = reals(f"weight of {atoms[name].name}", weight)
        if value.ndim or not (0.0 <= value <= _HEAVIEST):
            rule = f"must be one finite number from 0 to {_HEAVIEST:g}"
            raise InvalidInputError(f"weight of {atoms[name].name}", weight, rule)
        weights[atoms[name]] = weights.get(atoms[name], 0.0) + float(value)
    if not any(weights.values()):
        raise InvalidInputError("minimise", {a.name: w for a, w in weights.items()}, "must have a positive weight")
    return weights
