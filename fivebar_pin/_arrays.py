"""Shared array habits: check once at the boundary, copy in, freeze; write round-off as what it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from fivebar_pin.errors import InvalidInputError

Array = npt.NDArray[np.float64]
T = TypeVar("T", bound="Immutable")


class Immutable:
    """A frozen dataclass whose arrays are read-only, still after it was pickled or copied, when NumPy forgets it.

    Only the fields travel; what was computed from them and kept is computed again when it is asked for. A class that
    takes arrays from a user copies them in its own `__post_init__`.
    """

    __slots__ = ()

    def __post_init__(self) -> None:
        for f in fields(self):  # type: ignore[arg-type]
            seal(getattr(self, f.name))

    def __reduce_ex__(self, protocol: object) -> tuple[Any, ...]:
        state = {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]
        views = [name for name, content in state.items() if isinstance(content, MappingProxyType)]
        return _again, (type(self), {**state, **{name: dict(state[name]) for name in views}}, views)


def _again(kind: type[T], state: dict[str, Any], views: list[str]) -> T:
    """Make a value again from its fields; those named as views become read-only views of their dictionaries."""
    value = kind.__new__(kind)
    for name, content in state.items():
        seal(content)
        object.__setattr__(value, name, MappingProxyType(content) if name in views else content)
    return value


def seal(content: object) -> None:
    """Make the arrays in nested tuples, lists and mappings read-only, in place."""
    if isinstance(content, np.ndarray):
        content.setflags(write=False)
    elif isinstance(content, (tuple, list)):
        for item in content:
            seal(item)
    elif isinstance(content, Mapping):
        for item in content.values():
            seal(item)

ROUND_OFF = 2.0**-40
"""Share of what adds up to a number that round-off may leave of it: 4096 units in the last place, as loops are closed
to some hundred of them and a chain of solved equations adds to that [-]."""


def frozen(values: npt.ArrayLike) -> Array:
    """Return a read-only float copy."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def numeric(name: str, values: npt.ArrayLike) -> Array:
    """Return a read-only float copy of any shape.

    Raises:
        InvalidInputError: not numeric, or ragged.
    """
    try:
        return frozen(values)
    except (TypeError, ValueError) as error:
        raise InvalidInputError(name, values, f"must be an array of numbers ({error})") from error


def checked(name: str, values: npt.ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """Return a read-only float copy of the given shape (None: any length), finite throughout.

    Raises:
        InvalidInputError: not numeric, wrong shape, or not finite.
    """
    array = numeric(name, values)
    wanted = "(" + ", ".join("n" if s is None else str(s) for s in shape) + ("," if len(shape) == 1 else "") + ")"
    if array.ndim != len(shape) or any(s is not None and s != g for s, g in zip(shape, array.shape, strict=True)):
        raise InvalidInputError(f"shape of {name}", array.shape, f"must be {wanted}")
    bad = np.argwhere(~np.isfinite(array))
    if bad.size:
        index = tuple(int(i) for i in bad[0])
        raise InvalidInputError(f"{name}{list(index)}", float(array[index]), "must be finite")
    return array


def number(name: str, value: object, *, positive: bool = False, unit: str = "") -> float:
    """Return one finite number.

    Raises:
        InvalidInputError: not a number, not finite, or not positive where it must be.
    """
    try:
        x = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInputError(name, value, f"must be one number ({error})") from error
    tail = f" [{unit}]" if unit else ""
    if positive and not (np.isfinite(x) and x > 0.0):
        raise InvalidInputError(name, x, f"must be positive and finite{tail}")
    if not np.isfinite(x):
        raise InvalidInputError(name, x, f"must be finite{tail}")
    return x


def skew(x: Array) -> Array:
    """Return [x]× with [x]× y = x × y.  x (..., 3) -> (..., 3, 3)."""
    S = np.zeros((*x.shape, 3))
    S[..., 0, 1], S[..., 0, 2], S[..., 1, 2] = -x[..., 2], x[..., 1], -x[..., 0]
    S[..., 1, 0], S[..., 2, 0], S[..., 2, 1] = x[..., 2], -x[..., 1], x[..., 0]
    return S


def cross(x: Array, y: Array) -> Array:
    """Return x × y along the last axis (far cheaper than np.cross for small batches)."""
    return np.stack(
        [
            x[..., 1] * y[..., 2] - x[..., 2] * y[..., 1],
            x[..., 2] * y[..., 0] - x[..., 0] * y[..., 2],
            x[..., 0] * y[..., 1] - x[..., 1] * y[..., 0],
        ],
        axis=-1,
    )


def settled(value: float, scale: float) -> float:
    """Return a value, zero where it is only the round-off of what adds up to it.

    Args:
        value: as computed.
        scale: sum of the sizes of what adds up to it, in its unit; 0 when nothing cancels.
    """
    return 0.0 if abs(value) <= ROUND_OFF * scale else float(value)


def figures(value: float, scale: float = 0.0, *, digits: int = 4) -> str:
    """Write a number for people to read, with a few significant digits; round-off is written as 0.

    Args:
        value, scale: as for `settled`.
        digits: significant digits.
    """
    return f"{settled(value, scale):.{digits}g}"
