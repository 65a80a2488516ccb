"""What a design is judged by: atoms, one file each, of which objectives and limits are made.

An atom is a convex function of the bodies. It is found by its name, the words that `balance` takes for it: a class
with a quantity is registered once for all quantities along motions, `Rms` for "rms_torque" and the others.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, TypeVar

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array, Immutable, reals
from fivebar_pin.balancing.objectives.term import Term
from fivebar_pin.balancing.regressors.measures import Measurement
from fivebar_pin.balancing.regressors.regressor import MEASURES
from fivebar_pin.balancing.regressors.rows import Rows
from fivebar_pin.balancing.setting import Setting
from fivebar_pin.balancing.solvers import Block
from fivebar_pin.balancing.variables.part import Placed
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["AlongMotions", "Designs", "Objective", "Weighted", "known", "named", "positive_limit", "register"]

_PLAIN: list[type[Objective]] = []
_ALONG: list[type[AlongMotions]] = []
O = TypeVar("O", bound="type[Objective]")


@dataclass(frozen=True, slots=True, eq=False)
class Designs(Immutable):
    """All designs of a problem, as functions of its variables y (n,).

    Attributes:
        setting, measurement: the mechanism, and what its bodies are measured by.
        parts: what the variables are.
        E, X0: scaled parameters (nb * width,) = X0 + E y.
        full_E, pi0: the ten parameters of all bodies (10 nb,) = pi0 + full_E y, as far as motions feel them.
    """

    setting: Setting
    measurement: Measurement
    parts: tuple[Placed, ...]
    E: Array
    X0: Array
    full_E: Array
    pi0: Array

    @property
    def present(self) -> Array:
        """Return the present parameters (10 nb,)."""
        return self.setting.chain.inertial_parameters.reshape(-1)


class Objective(Immutable, ABC):
    """One atom of an objective.

    Attributes:
        word: what it is called, with the name of its quantity after it where it has one.
        squared: whether it is the square of its root, an atom that is a length.
        distance: whether it needs the parameters that distances are measured in.
        quantity: what it refers to along motions, or None.
    """

    __slots__ = ()

    word: ClassVar[str]
    squared: ClassVar[bool] = False
    distance: ClassVar[bool] = False
    quantity: str | None

    def __mul__(self, weight: float) -> Weighted:
        """Return it with a weight."""
        return Weighted({self: weight})

    __rmul__ = __mul__

    def __add__(self, other: Objective | Weighted) -> Weighted:
        """Return the sum with another atom, or with a sum."""
        return Weighted({self: 1.0}) + other

    @property
    def name(self) -> str:
        """Return the shorthand for it."""
        return self.word

    @property
    def root(self) -> Objective:
        """Return the atom whose epigraph it uses; itself, or what it is the square of."""
        return self

    @abstractmethod
    def term(self, designs: Designs) -> Term:
        """Return it as a function of the variables; of the root where it is a square."""

    @abstractmethod
    def value(self, measurement: Measurement, pi: Array) -> float:
        """Return it for bodies of parameters (nb, 10), in its unit."""

    def size(self, measurement: Measurement, pi: Array) -> float:
        """Return the sum of the sizes of what adds up to it, see `Loads.scale`; 0 when nothing cancels."""
        return 0.0

    def values(self, measurement: Measurement, X: Array) -> Array:
        """Return it for many designs (k, 10 nb)."""
        return np.array([self.value(measurement, x.reshape(-1, 10)) for x in X])

    def rms_rows(self, measurement: Measurement) -> Rows | None:
        """Return the rows whose rms it is, or the square of it; None where it is not."""
        return None

    def limits(self, designs: Designs, top: npt.ArrayLike) -> list[Block]:
        """Return the cones of an upper bound."""
        return self.root.term(designs).bounded(self.rooted(positive_limit(self.name, top)))

    def rooted(self, value: float) -> float:
        """Return the value of the root where this atom has a value."""
        return float(np.sqrt(value)) if self.squared else value


class Weighted(Mapping[Objective, float]):
    """A sum of atoms with weights: 2.0 * Rms("torque") + AddedMass()."""

    def __init__(self, weights: Mapping[Objective, float]) -> None:
        """Keep a copy of the weights."""
        self._weights = dict(weights)

    def __getitem__(self, atom: Objective) -> float:
        return self._weights[atom]

    def __iter__(self) -> Iterator[Objective]:
        return iter(self._weights)

    def __len__(self) -> int:
        return len(self._weights)

    def __repr__(self) -> str:
        return " + ".join(f"{weight:g} * {atom!r}" for atom, weight in self._weights.items())

    def __add__(self, other: Objective | Weighted) -> Weighted:
        """Return the sum with another atom, or with a sum."""
        total, more = dict(self._weights), {other: 1.0} if isinstance(other, Objective) else other
        for atom, weight in more.items():
            total[atom] = total.get(atom, 0.0) + weight
        return Weighted(total)

    def __mul__(self, weight: float) -> Weighted:
        """Return all weights times another."""
        return Weighted({atom: weight * own for atom, own in self._weights.items()})

    __rmul__ = __mul__


class AlongMotions(Objective):
    """An atom of a quantity along the motions.

    Attributes:
        quantity: one of `MEASURES`.
    """

    __slots__ = ()

    quantity: str

    def __post_init__(self) -> None:
        if self.quantity not in MEASURES:
            raise UnknownNameError("quantity", self.quantity, MEASURES)

    @property
    def name(self) -> str:
        """Return the word and the quantity."""
        return f"{self.word}_{self.quantity}"

    def rows(self, measurement: Measurement) -> Rows:
        """Return the quantity along the motions."""
        measurement.required(self.quantity)
        return measurement.rows[self.quantity]


def register(kind: O) -> O:
    """Let the word of a class stand for its atom, or for its atoms of all quantities."""
    if issubclass(kind, AlongMotions):
        _ALONG.append(kind)
    else:
        _PLAIN.append(kind)
    return kind


def known() -> dict[str, Objective]:
    """Return all atoms by their names."""
    atoms: list[Objective] = [kind() for kind in _PLAIN]
    atoms += [kind(quantity) for quantity in MEASURES for kind in _ALONG]  # type: ignore[call-arg]
    return {atom.name: atom for atom in atoms}


def named(given: str | Objective, what: str) -> Objective:
    """Return an atom, or the one that a name stands for.

    Args:
        given: the atom or its name.
        what: what it is asked for as, for the error.

    Raises:
        UnknownNameError: there is none of this name.
    """
    if isinstance(given, Objective):
        return given
    atoms = known()
    if given not in atoms:
        raise UnknownNameError(what, given, atoms)
    return atoms[given]


def positive_limit(name: str, limit: npt.ArrayLike) -> float:
    """Return a bound on a term as a number, checked."""
    value = reals(f"limit of {name}", limit)
    if value.ndim or not (np.isfinite(value) and value > 0.0):
        raise InvalidInputError(f"limit of {name}", limit, "must be one positive and finite number")
    return float(value)
