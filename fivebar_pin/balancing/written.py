"""Conditions as a person reads them: reduced row echelon form, in SI units, simple fractions recognised, as words."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.parameters import Space

__all__ = ["echelon_form", "equation_text", "readable_form"]

_PIVOT = 1e-6  # part of a column outside those chosen before that lets it lead a row [-, rows of length one]
_NOISE = 1e-9  # factor of a written condition that is left out [of the largest of its row]
_SIMPLE = 1e-9  # difference to a simple fraction that is round-off [of the factor]
_LEAST_FACTOR = 1e-3  # size of factors below which the difference counts as absolute [-]
_DENOMINATOR = 1000  # the largest of a simple fraction


def echelon_form(basis: Array, space: Space) -> Array:
    """Return the scaled reduced row echelon form; inertias and first moments of the later bodies lead."""
    rank, P = basis.shape
    orders = np.tile(space.orders, len(space.bodies))
    preference = sorted(range(P), key=lambda k: (-orders[k], -(k // space.width), k))
    pivots: list[int] = []
    chosen = np.zeros((rank, 0))
    for k in preference:
        left = basis[:, k] - chosen @ (chosen.T @ basis[:, k])
        if len(pivots) < rank and np.linalg.norm(left) > _PIVOT:
            pivots.append(k)
            left -= chosen @ (chosen.T @ left)
            chosen = np.column_stack([chosen, left / np.linalg.norm(left)])
    return np.asarray(np.linalg.solve(basis[:, pivots], basis)[np.argsort(pivots)])


def readable_form(echelon: Array, space: Space) -> Array:
    """Return the form in SI units: leading factor one, noise gone, simple fractions recognised."""
    out = np.zeros_like(echelon)
    for row, tidy in zip(echelon, out, strict=True):
        real = np.abs(row) > _NOISE * np.abs(row).max()
        lead = int(np.argmin(np.abs(row - 1.0)))
        for k in np.flatnonzero(real):
            tidy[k] = _tidy(float(row[k] / space.scale[k] * space.scale[lead]))
    return out


def _tidy(x: float) -> float:
    """Return the simple fraction that x stands for, if there is one."""
    simple = float(Fraction(x).limit_denominator(_DENOMINATOR))
    return simple if abs(simple - x) < _SIMPLE * max(abs(x), _LEAST_FACTOR) else x


def equation_text(row: Array, names: Sequence[str], constant: float = 0.0) -> str:
    terms: list[str] = []
    for k in sorted((int(i) for i in np.flatnonzero(row)), key=lambda k: (row[k] != 1.0, k)):
        factor = f"{abs(row[k]):.10g} " if abs(row[k]) != 1.0 else ""
        sign = ("-" if row[k] < 0 else "") if not terms else (" - " if row[k] < 0 else " + ")
        terms.append(f"{sign}{factor}{names[k]}")
    if constant:
        terms.append(f" {'-' if constant < 0.0 else '+'} {abs(constant):.10g}")
    return "".join(terms) + " = 0"
