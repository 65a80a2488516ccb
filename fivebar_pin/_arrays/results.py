"""What is handed out: numbers, or an error where there are none."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import is_dataclass
from functools import wraps
from typing import ParamSpec, TypeVar

import numpy as np

from fivebar_pin._arrays.checks import all_finite
from fivebar_pin._arrays.immutable import names
from fivebar_pin.errors import InvalidInputError

P = ParamSpec("P")
R = TypeVar("R")


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
            require_finite(compute.__name__, result, open)
            return result

        return computed

    return decorate


_BEYOND = "is beyond what can be computed in double precision"
_SMALLER = "Check the units and sizes of what was given."


def require_finite(name: str, result: object, open: tuple[str, ...] = ()) -> None:
    """Raise for infinity, and for nan outside the results named as open, in arrays and fields that hold them."""
    if isinstance(result, np.ndarray):
        if result.dtype.kind in "fc" and not all_finite(result):
            bad = np.argwhere(np.isinf(result) if name in open else ~np.isfinite(result))
            if bad.size:
                index = tuple(int(i) for i in bad[0])
                raise InvalidInputError(f"{name}{list(index)}", result[index].item(), _BEYOND, _SMALLER)
    elif is_dataclass(result):
        for field in names(type(result)):
            require_finite(field, getattr(result, field), open)
    elif isinstance(result, (tuple, Mapping)):
        for key, item in result.items() if isinstance(result, Mapping) else enumerate(result):
            require_finite(key if isinstance(key, str) else name, item, open)
    elif isinstance(result, float) and name not in open and not np.isfinite(result):
        raise InvalidInputError(name, result, _BEYOND, _SMALLER)
