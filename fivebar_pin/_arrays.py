"""Shared array habits: check once at the boundary, copy in, freeze; write round-off as what it is."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import wraps
from numbers import Real
from types import MappingProxyType
from typing import Any, ParamSpec, TypeVar

import numpy as np
import numpy.typing as npt

from fivebar_pin.errors import InvalidInputError

Array = npt.NDArray[np.float64]
V = TypeVar("V", bound="Immutable")
T = TypeVar("T")
P = ParamSpec("P")
R = TypeVar("R")


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


def _again(kind: type[V], state: dict[str, Any], views: list[str]) -> V:
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


def finite(*, open: tuple[str, ...] = ()) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Make a function that computes refuse to hand out numbers that are none, and keep NumPy's warnings of them inside.

    Finite arguments can be too large for what is computed from them (the square of a speed of 1e200); infinity and
    nan in the result would then pass for an answer.

    Args:
        open: names of results that hold nan where something is undetermined, as their documentation says (a single
                number: infinity too).
    """

    def decorate(compute: Callable[P, R]) -> Callable[P, R]:
        @wraps(compute)
        def computed(*args: P.args, **kwargs: P.kwargs) -> R:
            try:
                with np.errstate(all="ignore"):
                    result = compute(*args, **kwargs)
            except (np.linalg.LinAlgError, FloatingPointError, OverflowError) as error:
                raise InvalidInputError(compute.__name__, str(error.args[-1]), _BEYOND, _SMALLER) from error
            _require_finite(compute.__name__, result, open)
            return result

        return computed

    return decorate


_BEYOND = "is beyond what can be computed in double precision"
_SMALLER = "Check the units and sizes of what was given."


def _require_finite(name: str, result: object, open: tuple[str, ...]) -> None:
    """Raise for infinity, and for nan outside the results named as open, in arrays and fields that hold them."""
    if isinstance(result, np.ndarray):
        if result.dtype.kind in "fc" and not np.isfinite(result).all():
            bad = np.argwhere(np.isinf(result) if name in open else ~np.isfinite(result))
            if bad.size:
                index = tuple(int(i) for i in bad[0])
                raise InvalidInputError(f"{name}{list(index)}", result[index].item(), _BEYOND, _SMALLER)
    elif is_dataclass(result):
        for f in fields(result):
            _require_finite(f.name, getattr(result, f.name), open)
    elif isinstance(result, (tuple, Mapping)):
        for key, item in result.items() if isinstance(result, Mapping) else enumerate(result):
            _require_finite(key if isinstance(key, str) else name, item, open)
    elif isinstance(result, float) and name not in open and not np.isfinite(result):
        raise InvalidInputError(name, result, _BEYOND, _SMALLER)


_DENSE = 60  # rows or columns up to which a matrix is decomposed as a whole


def block_svd(A: Array) -> tuple[Array, Array, Array]:
    """Return U (m, m), s (min(m, n),), Vt (n, n) as `np.linalg.svd` does, each independent block of a large A alone.

    Rows and columns that no entry connects do not act on each other: the closures of a long row of loops fall into
    many small blocks, and the cost grows with their number instead of the cube of it.
    """
    m, n = A.shape
    if max(m, n) <= _DENSE or not A.size:
        return np.linalg.svd(A, full_matrices=True)
    U, Vt = np.zeros((m, m)), np.zeros((n, n))
    found: list[tuple[float, Any, Any, Any, Any]] = []
    blocks = _blocks(A)
    for rows, columns in blocks:
        u, s, vt = np.linalg.svd(A[np.ix_(rows, columns)], full_matrices=True)
        found += [(float(x), rows, u[:, k], columns, vt[k]) for k, x in enumerate(s)]
        found += [(-1.0, rows, u[:, k], None, None) for k in range(s.size, rows.size)]
        found += [(-1.0, None, None, columns, vt[k]) for k in range(s.size, columns.size)]
    found.sort(key=lambda entry: -entry[0])
    values = np.array([entry[0] for entry in found if entry[0] >= 0.0])
    left, right = 0, 0
    for _, rows, u, columns, v in found:
        if u is not None:
            U[rows, left], left = u, left + 1
        if v is not None:
            Vt[right, columns], right = v, right + 1
    return U, np.concatenate([values, np.zeros(min(m, n) - values.size)]), Vt


def _blocks(A: Array) -> list[tuple[npt.NDArray[np.intp], npt.NDArray[np.intp]]]:
    """Return rows and columns of every independent block; a row or column of zeros is a block of its own."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    m, n = A.shape
    i, j = np.nonzero(A)
    graph = coo_array((np.ones(i.size), (i, m + j)), shape=(m + n, m + n))
    count, label = connected_components(graph, directed=False)
    order = np.argsort(label, kind="stable")
    parts = np.split(order, np.searchsorted(label[order], np.arange(1, count)))
    return [(part[part < m], part[part >= m] - m) for part in parts]


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


def table_text(header: str, body: Array) -> str:
    """Return a table (n, k) as csv text below a header line, every digit kept."""
    text = io.StringIO()
    np.savetxt(text, body, delimiter=",", header=header, comments="", fmt="%.17g")
    return text.getvalue()


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
