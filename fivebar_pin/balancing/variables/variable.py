"""What the optimiser may change, as the user states it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, TypeVar

from fivebar_pin._arrays import Immutable
from fivebar_pin.balancing.pieces.piece import Piece
from fivebar_pin.balancing.pieces.trial import Trial
from fivebar_pin.balancing.regions.region import Region
from fivebar_pin.balancing.regions.shape import Shape
from fivebar_pin.balancing.setting import Setting
from fivebar_pin.balancing.variables.part import Part

__all__ = ["MODES", "MassBounds", "Stated", "Variable", "register"]

MassBounds = tuple[float, float] | Mapping[str, tuple[float, float]] | None
MODES: dict[str, type[Variable]] = {}  # by the word that stands for them in `balance`
V = TypeVar("V", bound="type[Variable]")


@dataclass(frozen=True, slots=True, eq=False)
class Stated(Immutable):
    """What `balance` is told about the bodies that may change; see there.

    Attributes:
        bodies, region, masses, counterweight, remove: as for `balance`.
        density: of the material [kg/m3] and its thickness in the plane [m], or None for any.
    """

    bodies: Sequence[str] | None = None
    region: Region | Mapping[str, Region] | None = None
    masses: MassBounds = None
    counterweight: Piece | Mapping[str, Piece] | None = None
    remove: Sequence[str] = ()
    density: tuple[float, float] | None = None


class Variable(Immutable, ABC):
    """Something that may change.

    Attributes:
        aim: what is minimised unless said otherwise.
    """

    __slots__ = ()

    aim: ClassVar[str] = "added_mass"

    @classmethod
    def of(cls, stated: Stated) -> Variable:
        """Return it from the arguments of `balance`, for a class that is registered as a mode."""
        return cls()

    @abstractmethod
    def parts(self, setting: Setting) -> list[Part]:
        """Return its variables on a mechanism."""

    def pieces(self, setting: Setting) -> dict[int, Piece]:
        """Return what the material added to a body is made as, by its index; nothing where it may be anything."""
        return {}

    def in_pieces(self, pieces: Mapping[str, Piece]) -> Variable:
        """Return it with counterweights of stated kinds, by joint; itself where it adds no material."""
        return self

    def shape(self, setting: Setting, b: int) -> Shape | None:
        """Return where material that it adds to a body may lie, in chain lengths; None where it adds none."""
        return None

    def tried(self, trial: Trial) -> Variable:
        """Return it for one step of the search for counterweights; itself where it has none."""
        return self


def register(mode: str) -> Callable[[V], V]:
    """Let a word stand for a class of variables as the `mode` of `balance`."""

    def add(kind: V) -> V:
        MODES[mode] = kind
        return kind

    return add
