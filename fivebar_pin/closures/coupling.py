"""coupling: joint coordinates tied by numbers, sum_k c_k q_k = offset: gears, belts, planetary trains, mimic joints."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, all_of, number
from fivebar_pin.closures.anchored import Anchored, Segment
from fivebar_pin.closures.closure import Closure, Entry
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["Coupling"]


@dataclass(frozen=True, eq=False, repr=False)
class Coupling(Closure, word="coupling"):
    """Coordinates of joints tied to each other, sum_k c_k q_k = offset. One row.

        Coupling({"wheel": 1.0, "crank": 3.7})                the wheel turns -3.7 times for each turn of the crank
        Coupling({"sun": 1.0, "planet": 2.5})                 both joints on the carrier: ratios are relative to it
        Coupling({"rack": 1.0, "pinion": -0.02})              metres and radians together

    A ratio is relative to what carries the joints, as their coordinates are. Joints of a coupling count their turns:
    `ClosedChain` stores a joint whose coordinates are a cosine and a sine as an ordinary revolute joint without
    limits. The multiplier lambda acts as a motor in every joint at once, with the torque c_k lambda; there is no force
    between bodies besides.

    Attributes:
        ratios: c_k by the name of the joint; one degree of freedom each, none zero.
        offset: what the sum is [unit of c_k q_k].
    """

    ratios: Mapping[str, float]
    offset: float = 0.0

    row_names: ClassVar[tuple[str, ...]] = ("ratio",)
    joined: ClassVar[int | None] = None
    entries: ClassVar[tuple[Entry, ...]] = (
        Entry("ratio", 0, "a coupling needs the ratio of each of its joints, e.g. [1, 3.7]"),
        Entry("offset", None),
    )

    def __post_init__(self) -> None:
        given = self.ratios
        if not isinstance(given, Mapping):
            raise InvalidInputError(
                "ratios of a coupling", given, "must map joint names to numbers, as {'wheel': 1.0, 'crank': 3.7}"
            )
        if not given:
            raise InvalidInputError("ratios of a coupling", dict(given), "must name one joint at least")
        names = all_of("joints of a coupling", given, str)
        if not all(names):
            raise InvalidInputError("joints of a coupling", names, "must have names")
        ratios = {name: number(f"ratio of joint {name}", c) for name, c in given.items()}
        for name, c in ratios.items():
            if c == 0.0:
                raise InvalidInputError(f"ratio of joint {name}", c, "must not be zero", "Leave the joint out.")
        self._settle(ratios=MappingProxyType(ratios), offset=number("offset of a coupling", self.offset))

    def __repr__(self) -> str:
        return f"Coupling({dict(self.ratios)}, {self.offset}, name={self.name!r})"

    @property
    def joins(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(self.ratios)

    @property
    def counted(self) -> tuple[str, ...]:
        """Names of the joints, which must count their turns."""
        return self.joins

    @property
    def tie(self) -> tuple[tuple[float, ...], float]:
        """Ratios of the joints and the offset."""
        return tuple(self.ratios.values()), self.offset

    def check(self, model: pin.Model, frames: Mapping[str, pin.Frame]) -> None:
        """Raise where a joint does not exist or has several degrees of freedom."""
        places = {name: j for j, name in enumerate(model.names) if j}
        for name in self.joins:
            if name not in places:
                raise UnknownNameError(f"joint of closure {self.name}", name, places)
            nv = model.nvs[places[name]]
            if nv != 1:
                raise InvalidInputError(
                    f"joint {name} of closure {self.name}", f"nv = {nv}", "must have one degree of freedom"
                )

    def anchor(
        self, model: pin.Model, frames: Mapping[str, pin.Frame], support: npt.NDArray[np.bool_], start: int
    ) -> _Coupled:
        """Find the coordinates of the joints."""
        by_column = sorted((int(model.idx_vs[j]), j, c) for j, c in self._found(model))
        joints = tuple(j for _, j, _ in by_column)
        return _Coupled(
            self,
            slice(start, start + 1),
            (0, 0),
            joints,
            np.array([k for k, _, _ in by_column], dtype=np.intp),
            np.array([c for _, _, c in by_column]),
        )

    def _found(self, model: pin.Model) -> list[tuple[int, float]]:
        return [(int(model.getJointId(name)), c) for name, c in self.ratios.items()]

    def values(self) -> dict[str, float | list[float]]:
        """Return ratio and, where it is not zero, offset."""
        offset: dict[str, float | list[float]] = {"offset": self.offset} if self.offset else {}
        return {"ratio": list(self.ratios.values()), **offset}

    @classmethod
    def of_entry(cls, joins: Iterable[str], values: Mapping[str, Any], name: str) -> Coupling:
        """Make one from the joints and their ratios, in the same order."""
        joints = all_of("joints of a coupling", joins, str)
        if len(set(joints)) != len(joints):
            raise InvalidInputError("joints of a coupling", joints, "must differ", "Add the ratios of one joint.")
        ratio = values.get("ratio")
        given: list[Any] = list(ratio) if isinstance(ratio, Iterable) and not isinstance(ratio, str) else [ratio]
        if len(given) != len(joints):
            raise InvalidInputError(
                "ratio of a coupling", ratio, f"must hold {len(joints)} numbers, one for each joint"
            )
        return cls(dict(zip(joints, given, strict=True)), values.get("offset", 0.0), name=name)


@dataclass(frozen=True, slots=True, eq=False)
class _Coupled(Anchored):
    """A coupling with its coordinates found: ratios in the order of the columns. It acts in the joints alone."""

    closure: Coupling
    ratios: Array

    def row_scale(self, length: float, column_scale: Array) -> Array:
        """Make the largest scaled ratio one, whatever factor the row is multiplied by."""
        return np.array([1.0 / np.abs(self.ratios * column_scale[self.columns]).max()])

    def numbers(self) -> Array:
        return np.append(self.ratios, self.closure.offset)

    def segments(self) -> tuple[Segment, ...]:
        """Return the lines between the axes of the joints, one after the other."""
        zero = np.zeros(3)
        return tuple(Segment(pair, (zero, zero), rod=False) for pair in zip(self.tied, self.tied[1:], strict=False))
