"""What a user gives, looked at once at the boundary: numbers, shapes, bounds."""

from __future__ import annotations

import os
from math import isfinite
from numbers import Real
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays.immutable import Array, frozen
from fivebar_pin.errors import InvalidInputError

T = TypeVar("T")


def reals(name: str, values: npt.ArrayLike) -> Array:
    """Return what a user gave as an array of real numbers, the same memory where it is one already.

    Nothing is made a number that is none: complex values would lose a part, masked ones their mask, instants their
    unit; truth values and digits in a string are mistakes more often than numbers.

    Raises:
        InvalidInputError: anything but integers and real numbers, or ragged.
    """
    try:
        if _masked(values):
            raise InvalidInputError(
                name, "a masked array", "must be an array of numbers only", "Fill in what is missing."
            )
        given = np.asarray(values)
        if given.dtype.kind == "O":
            return np.array([_real(x) for x in given.flat], dtype=np.float64).reshape(given.shape)
    except InvalidInputError:
        raise
    except Exception as error:  # a stranger's object may raise anything where NumPy asks it for its numbers
        raise InvalidInputError(name, values, f"must be an array of numbers only ({error})") from error
    if given.size and given.dtype.kind not in "fiu":
        kind = _REFUSED.get(given.dtype.kind, f"of type {given.dtype}")
        raise InvalidInputError(name, values, f"must be an array of numbers only; these are {kind}")
    if given.dtype == np.float64:
        return given
    with np.errstate(over="ignore"):  # a long double beyond float becomes infinite, which is refused as such
        return given.astype(np.float64, copy=False) if given.size else np.zeros(given.shape)


_REFUSED = {
    "b": "truth values",
    "c": "complex, and would lose their imaginary parts",
    "M": "instants of a calendar",
    "m": "spans of a calendar",
    "S": "bytes",
    "T": "text",
    "U": "text",
}


def _masked(values: object) -> bool:
    """Tell whether there is a mask; NumPy passes over one inside a list."""
    if isinstance(values, (list, tuple)):
        return any(_masked(x) for x in values if isinstance(x, (list, tuple, np.ma.MaskedArray)))
    return isinstance(values, np.ma.MaskedArray)


def _real(value: object) -> float:
    """Return a number of another make (a fraction, a long integer) as a float."""
    if not isinstance(value, Real) or isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{type(value).__name__} is not a real number")
    return float(value)


def numeric(name: str, values: npt.ArrayLike) -> Array:
    """Return a read-only float copy of any shape.

    Raises:
        InvalidInputError: see `reals`.
    """
    return frozen(reals(name, values))


def checked(name: str, values: npt.ArrayLike, shape: tuple[int | None, ...]) -> Array:
    """Return a read-only float copy of the given shape (None: any length), finite throughout.

    Raises:
        InvalidInputError: not numeric, wrong shape, or not finite.
    """
    array = numeric(name, values)
    if array.ndim != len(shape) or any(s is not None and s != g for s, g in zip(shape, array.shape, strict=True)):
        wanted = "(" + ", ".join("n" if s is None else str(s) for s in shape) + ("," if len(shape) == 1 else "") + ")"
        raise InvalidInputError(f"shape of {name}", array.shape, f"must be {wanted}")
    if not all_finite(array):
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InvalidInputError(f"{name}{list(index)}", float(array[index]), "must be finite")
    return array


def all_finite(x: npt.NDArray[Any]) -> bool:
    """Tell whether all numbers are finite."""
    return int(np.count_nonzero(np.isfinite(x))) == x.size  # a quarter of the time of `all` where there are few


def number(name: str, value: object, *, positive: bool = False, unit: str = "") -> float:
    """Return one finite number.

    Raises:
        InvalidInputError: not a number, not finite, or not positive where it must be.
    """
    if type(value) is float and isfinite(value) and (value > 0.0 or not positive):
        return value
    try:
        x = reals(name, value)  # type: ignore[arg-type]
    except InvalidInputError as error:
        raise InvalidInputError(name, value, "must be one number") from error
    if x.ndim:
        raise InvalidInputError(name, value, "must be one number")
    tail = f" [{unit}]" if unit else ""
    if positive and not (np.isfinite(x) and x > 0.0):
        raise InvalidInputError(name, float(x), f"must be positive and finite{tail}")
    if not np.isfinite(x):
        raise InvalidInputError(name, float(x), f"must be finite{tail}")
    return float(x)


def all_of(name: str, given: object, kind: type[T]) -> tuple[T, ...]:
    """Return things of one kind as a tuple; one name alone counts as a tuple of one.

    Raises:
        InvalidInputError: not iterable, or something of another kind in it.
    """
    try:
        things: tuple[Any, ...] = (given,) if isinstance(given, str) else tuple(given)  # type: ignore[arg-type]
    except TypeError as error:
        raise InvalidInputError(name, given, f"must hold objects of type {kind.__name__}") from error
    for thing in things:
        if not isinstance(thing, kind):
            raise InvalidInputError(name, thing, f"must hold objects of type {kind.__name__}")
    return things


def integer(name: str, value: object, *, least: int = 0, most: int | None = None) -> int:
    """Return a whole number within bounds.

    Raises:
        InvalidInputError: not an integer, less than `least`, or more than `most`.
    """
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)) or value < least:
        raise InvalidInputError(
            name, value, f"must be an integer of at least {least}" + ("" if least else ", not negative")
        )
    if most is not None and value > most:
        raise InvalidInputError(name, value, f"must be an integer from {least} to {most}")
    return int(value)


def require_memory(name: str, value: object, needed: float) -> None:
    """Refuse what needs more memory [bytes] than the machine has, which would stop everything else on it first."""
    try:
        there = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):  # a system that does not tell
        return
    if needed > there:
        rule = f"needs {needed / 1e9:.3g} GB of memory where this machine has {there / 1e9:.3g} GB"
        raise InvalidInputError(name, value, rule, "Ask for less.")
