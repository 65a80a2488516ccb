"""Affine forms of the variables of one piece of material, and the cones made of them.

A form is an array (LIMIT + 1,): the factors of the variables, then a constant. Powers are geometric means: with forms
f_1 .. f_k >= 0, k a power of two, x <= (f_1 .. f_k)^(1/k) is a tower of cones y^2 <= f g [Ben-Tal, Nemirovski 2001].
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.solvers import Block, svec

__all__ = ["Cones", "fixed_form"]

_LIMIT = 48  # variables of one piece; a form is a row of this many factors, however few are used [-]


class Cones:
    """Variables and cones of one piece of material, gathered one by one.

    Every variable has an anchor, its value for a unit mass spread well inside all bounds: with it a margin knows the
    way into a homogeneous cone.
    """

    def __init__(self) -> None:
        self._anchor: list[float] = []
        self._parts: list[tuple[str, str, Array, Array | None, bool]] = []

    @property
    def count(self) -> int:
        """Number of variables so far."""
        return len(self._anchor)

    def variable(self, anchor: float) -> Array:
        """Return the form of a new variable."""
        form = np.zeros(_LIMIT + 1)
        form[len(self._anchor)] = 1.0
        self._anchor.append(anchor)
        return form

    def value(self, form: Array) -> float:
        """Return a form at the anchor."""
        return float(form[: self.count] @ np.array(self._anchor) + form[-1])

    def add(
        self, label: str, cone: str, forms: Sequence[Array], inward: Array | None = None, *, soft: bool = False
    ) -> None:
        """Ask the forms to lie in a cone; without `inward` the way in is their value at the anchor."""
        self._parts.append((label, cone, np.stack(forms), inward, soft))

    def semidefinite(self, label: str, matrix: Sequence[Sequence[Array]], inward: Array | None = None) -> None:
        """Ask a symmetric matrix of forms to be positive semidefinite."""
        self.add(label, "psd", list(svec(matrix)), inward)

    def square(self, label: str, x: Array | Sequence[Array], f: Array, g: Array) -> None:
        """Ask |x|^2 <= f g and f, g >= 0."""
        many = [x] if isinstance(x, np.ndarray) else list(x)
        forms = [f + g, f - g, *(2.0 * one for one in many)]
        constant = any(form[-1] for form in forms)
        tip = np.eye(len(forms))[0]
        self.add(label, "soc", forms, tip if constant else None)

    def mean(self, label: str, x: Array, forms: Sequence[Array]) -> None:
        """Ask x <= geometric mean of forms (as many as a power of two), for x >= 0."""
        level = list(forms)
        while len(level) > 2:
            level = [self._pair(label, f, g) for f, g in zip(level[::2], level[1::2], strict=True)]
        self.square(label, x, level[0], level[1])

    def _pair(self, label: str, f: Array, g: Array) -> Array:
        """Return a form that is at most sqrt(f g)."""
        if np.array_equal(f, g):
            return f
        y = self.variable(0.5 * np.sqrt(max(self.value(f) * self.value(g), 0.0)))
        self.square(label, y, f, g)
        return y

    def blocks(self) -> tuple[Block, ...]:
        """Return all cones on the variables of this piece."""
        n, anchor = self.count, np.array(self._anchor)
        out = []
        for label, cone, forms, inward, soft in self._parts:
            G = forms[:, :n]
            out.append(Block(label, cone, G, forms[:, -1], G @ anchor if inward is None else inward, soft))
        return tuple(out)


def fixed_form(value: float) -> Array:
    """Return a form that does not depend on any variable."""
    form = np.zeros(_LIMIT + 1)
    form[-1] = value
    return form
