"""The family of loop closures: what every kind of closure tells of itself, and how a kind is found by its word.

A kind is one class in one file. Defining it registers it under its sidecar word; everything else (residual, Jacobian,
reactions, diagnosis, files, drawing) asks the closure and knows no kinds.
"""

from __future__ import annotations

import inspect
from abc import ABCMeta
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.errors import InvalidInputError, UnknownNameError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from fivebar_pin.closures.anchored import Anchored

__all__ = ["Closure", "ClosureKind", "Entry", "Mark"]


class ClosureKind(str):
    """The word of a closure kind, as sidecars write it: `ClosureKind.POINT == "3d"`. One object for each word."""

    POINT: ClassVar[ClosureKind]
    WELD: ClassVar[ClosureKind]
    REVOLUTE: ClassVar[ClosureKind]
    CYLINDRICAL: ClassVar[ClosureKind]
    DISTANCE: ClassVar[ClosureKind]
    COUPLING: ClassVar[ClosureKind]

    __slots__ = ()

    @property
    def value(self) -> str:
        """The word as plain text."""
        return str(self)

    @property
    def rows(self) -> int:
        """Number of constraint rows."""
        return len(Closure.family[self].row_names)

    @classmethod
    def parse(cls, text: object) -> ClosureKind:
        """Return the kind written in a sidecar, in any letter case.

        Raises:
            UnknownNameError: no such kind; lists the known ones.
        """
        return Closure.of_kind(text).kind

    def __reduce__(self) -> tuple[Any, ...]:
        return ClosureKind.parse, (str(self),)


@dataclass(frozen=True, slots=True)
class Entry:
    """What the sidecar states of a closure besides what it joins, under a key with one value for each closure.

    Attributes:
        key: of the sidecar; the attribute of the closure has the same name.
        size: number of values; 0: as many as it joins; None: one number, without brackets.
        needed: why it must be there, with an example; "" when it may be left out.
    """

    key: str
    size: int | None
    needed: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Mark:
    """How both frames of a closure are drawn: a ball, a box, or a pin along an axis of the frame (3,).

    Attributes:
        shape: a ball is drawn as a pin across the plane where the mechanism is planar.
        axis: of a pin, unit.
        stretch: how much longer than usual a pin is.
    """

    shape: Literal["ball", "box", "pin"]
    axis: Array | None = None
    stretch: float = 1.0


class _Family(ABCMeta):
    """Makes `Closure(frames, kind, ...)` the member of the family that goes by that word."""

    def __call__(cls, *args: Any, **named: Any) -> Any:
        return _shorthand(*args, **named) if cls is Closure else super().__call__(*args, **named)

    @property
    def __signature__(cls) -> inspect.Signature:
        """What `help` shows: the arguments of the class instead of those of `__call__`."""
        if cls is Closure:
            return inspect.signature(_shorthand)
        made = inspect.signature(cls.__init__)  # type: ignore[misc]
        return made.replace(parameters=list(made.parameters.values())[1:])


@dataclass(frozen=True, eq=False)
class Closure(Immutable, metaclass=_Family):
    """A constraint that closes a loop of the open tree; abstract. `Closure(frames, kind, ...)` makes one of any kind.

        Closure(("tip of arm 1", "tip of arm 2"))                         3d: the two points coincide
        Closure(("a", "b"), "revolute", axis=(0, 0, 1), name="hinge")
        Closure(("a", "b"), "distance", length=0.7)

    Args:
        frames: names of what it joins: two frames of the tree; for a coupling the joints.
        kind: a `ClosureKind` or its word, in any letter case.
        axis: of a revolute or cylindrical closure, in the axes of either frame; kinds without an axis pass over it.
        name: what messages call it; made from what it joins unless given.
        values: what else the kind takes (`length`; `ratio` and `offset`).

    Raises:
        UnknownNameError: a kind or a value that does not exist.
        InvalidInputError: a value that cannot be used.

    Attributes:
        name: what messages call it.
        kind: its word.
        row_names: names of its rows, in the axes of frame 1.
        entries: what the sidecar states of it.
        joined: how many things it joins; None: any number.
        family: the registered kinds by their word.
        may_oppose: it can be met falsely, with axes against each other.
    """

    name: str = field(default="", kw_only=True)

    kind: ClassVar[ClosureKind]
    row_names: ClassVar[tuple[str, ...]]
    entries: ClassVar[tuple[Entry, ...]] = ()
    joined: ClassVar[int | None] = 2
    may_oppose: ClassVar[bool] = False
    family: ClassVar[dict[str, type[Closure]]] = {}

    if TYPE_CHECKING:

        def __init__(
            self,
            frames: Iterable[str],
            kind: str = "3d",
            axis: npt.ArrayLike | None = None,
            name: str = "",
            **values: Any,
        ) -> None: ...

    def __init_subclass__(cls, *, word: str = "") -> None:
        """Register a kind under its sidecar word; without one the class is a common base of several kinds."""
        super().__init_subclass__()
        if not word:
            return
        known = Closure.family.get(word)
        if known is not None and known.__qualname__ != cls.__qualname__:
            raise InvalidInputError(f"closure kind {word}", cls.__qualname__, f"is {known.__qualname__} already")
        cls.kind = ClosureKind(word) if known is None else known.kind
        Closure.family[word] = cls
        setattr(ClosureKind, cls.__name__.upper(), cls.kind)

    @staticmethod
    def of_kind(text: object) -> type[Closure]:
        """Return the class of a kind by its word, in any letter case.

        Raises:
            UnknownNameError: no such kind; lists the known ones.
        """
        found = Closure.family.get(str(text).strip().lower())
        if found is None:
            raise UnknownNameError("closure kind", text, sorted(Closure.family))
        return found

    @property
    def joins(self) -> tuple[str, ...]:
        """Names of the frames or joints that it joins."""
        raise NotImplementedError

    @property
    def ends(self) -> tuple[str, ...]:
        """Names of the frames that it joins; none where it joins joints."""
        return ()

    @property
    def counted(self) -> tuple[str, ...]:
        """Names of the joints that must count their turns."""
        return ()

    @property
    def tie(self) -> tuple[tuple[float, ...], float] | None:
        """Coefficients of the joints in `counted` and what their sum is, where it is one of coordinates alone."""
        return None

    @property
    def mark(self) -> Mark:
        """How its frames are drawn."""
        return Mark("ball")

    def check(self, model: pin.Model, frames: Mapping[str, pin.Frame]) -> None:
        """Raise where it does not fit a model with these frames.

        Raises:
            UnknownNameError: a frame or joint that the model does not have.
            InvalidInputError: frames or joints that it cannot join.
        """
        raise NotImplementedError

    def anchor(
        self, model: pin.Model, frames: Mapping[str, pin.Frame], support: npt.NDArray[np.bool_], start: int
    ) -> Anchored:
        """Find its place in a model that it fits.

        Args:
            model: the open tree.
            frames: of the model, by name.
            support: which velocity coordinates move each joint's body (njoints, nv).
            start: its first row among those of the chain.
        """
        raise NotImplementedError

    def values(self) -> dict[str, float | list[float]]:
        """Return what the sidecar states of it, by key; what is as usual is left out."""
        stated = {entry.key: np.asarray(getattr(self, entry.key)).tolist() for entry in self.entries}
        return {key: value for key, value in stated.items() if value is not None}

    @classmethod
    def of_entry(cls, joins: Iterable[str], values: Mapping[str, Any], name: str) -> Closure:
        """Make one from what it joins and what a sidecar states of it."""
        return cls(joins, **values, name=name)

    def _settle(self, **fields: object) -> None:
        """Put checked values into the fields of a closure that is being made, and name it."""
        if not isinstance(self.name, str):
            raise InvalidInputError(f"name of a {self.kind} closure", self.name, "must be text")
        for key, value in fields.items():
            object.__setattr__(self, key, value)
        object.__setattr__(self, "name", self.name or "~".join(self.joins))


def _shorthand(
    frames: Iterable[str] = (), kind: object = "3d", axis: npt.ArrayLike | None = None, name: str = "", **values: Any
) -> Closure:
    """See `Closure`."""
    member = Closure.of_kind(kind)
    known = [entry.key for entry in member.entries]
    for key in values:
        if key not in known:
            raise UnknownNameError(f"value of a {member.kind} closure", key, known)
    if axis is not None and "axis" in known:
        values["axis"] = axis
    return member.of_entry(frames, values, name)
