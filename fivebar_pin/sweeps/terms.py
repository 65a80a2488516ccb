"""What a sweep tells of every design: quantities along the motion, whole or in one number."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from fivebar_pin._arrays import Array, all_of
from fivebar_pin.chain import ClosedChain
from fivebar_pin.errors import InvalidInputError, UnknownNameError

__all__ = ["QUANTITIES", "REDUCTIONS", "Term", "terms_of", "widths"]

QUANTITIES = ("torque", "shaking_force", "shaking_moment", "frame_force", "frame_moment", "power", "q", "v", "a")
"""Quantities along the motion; the power is that of each motor."""
_VECTORS = ("shaking_force", "shaking_moment", "frame_force", "frame_moment")


def _square(x: Array) -> Array:
    """Return the mean over the samples of the squared length of x (n, samples, k)."""
    return np.asarray(np.einsum("nsk,nsk->n", x, x) / x.shape[1])


def _root(x: Array) -> Array:
    return np.sqrt(_square(x))


REDUCTIONS: dict[str, Callable[[Array], Array]] = {"rms": _root, "mean_square": _square}
"""Means by their word, functions of a quantity (n, samples, k) -> (n,). A peak is one more, see `Term`."""


@dataclass(frozen=True, slots=True)
class Term:
    """A quantity, and what is told of it.

    Attributes:
        name: how it was asked for.
        quantity: one of `QUANTITIES`.
        reduction: one of `REDUCTIONS`, "peak" or "work"; "" for the whole series.
    """

    name: str
    quantity: str
    reduction: str

    def shape(self, chain: ClosedChain, samples: int) -> tuple[int, ...]:
        """Return the shape of it for one design."""
        return () if self.reduction else (samples, widths(chain)[self.quantity])

    def of(self, series: Array, t: Array) -> Array:
        """Return it for n designs, from the quantity along the motion (n, samples, k) at times t (samples,)."""
        if not self.reduction:
            return series
        if self.reduction == "work":
            spent = np.maximum(series, 0.0).sum(axis=2)
            return np.asarray(np.trapezoid(spent, t, axis=1))
        if self.reduction in REDUCTIONS:
            return REDUCTIONS[self.reduction](series)
        if self.quantity in _VECTORS:
            return np.asarray(np.sqrt(np.einsum("nsk,nsk->ns", series, series)).max(axis=1))
        return np.asarray(np.abs(series).max(axis=(1, 2)))


def terms_of(of: str | Iterable[str]) -> tuple[Term, ...]:
    """Return the terms of these names.

    Raises:
        UnknownNameError: a name that is none; lists those there are.
        InvalidInputError: none is asked for.
    """
    reductions = ("", *(f"{word}_" for word in ("peak", *REDUCTIONS)))
    known = {f"{r}{q}": Term(f"{r}{q}", q, r[:-1]) for r in reductions for q in QUANTITIES}
    known["work"] = Term("work", "power", "work")
    names = dict.fromkeys(all_of("of", of, str))
    for name in names:
        if name not in known:
            raise UnknownNameError("quantity of a sweep", name, known)
    if not names:
        raise InvalidInputError("of", (), f"must name what is wanted, some of {', '.join(known)}")
    return tuple(known[name] for name in names)


def widths(chain: ClosedChain) -> dict[str, int]:
    """Return how many numbers every quantity has at one sample."""
    wide = {"torque": chain.na, "power": chain.na, "q": chain.nq, "v": chain.nv, "a": chain.nv}
    return {name: wide.get(name, 3) for name in QUANTITIES}
