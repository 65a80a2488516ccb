"""Values that cannot be changed: frozen dataclasses and read-only arrays, after pickle and copy too."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import cache
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
V = TypeVar("V", bound="Immutable")

names: Callable[[Any], tuple[str, ...]] = cache(lambda kind: tuple(f.name for f in fields(kind)))
"""The names of the fields of a dataclass."""


class Immutable:
    """A frozen dataclass whose arrays are read-only, still after it was pickled or copied, when NumPy forgets it.

    Only the fields travel; what was computed from them and kept is computed again when it is asked for. A class that
    takes arrays from a user copies them in its own `__post_init__`.
    """

    __slots__ = ()

    def __post_init__(self) -> None:
        for name in names(type(self)):
            seal(getattr(self, name))

    def __reduce_ex__(self, protocol: object) -> tuple[Any, ...]:
        state = {name: getattr(self, name) for name in names(type(self))}
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


def frozen(values: npt.ArrayLike) -> Array:
    """Return a read-only float copy."""
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array
