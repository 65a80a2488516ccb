"""Bodies that the conditions leave without any material.

Conditions such as m(slide) = 0 hold a body at the apex of its cone, where a program has no interior: solvers then
creep along and call it impossible. Masses are not negative, so whenever some lambda, mu >= 0 of the equalities
A y + a = 0 and of the inequalities N y + b >= 0 have

    A^T lambda + N^T mu = -w,    w >= 0 on the masses and zero elsewhere,    a.lambda + b.mu = 0,

every mass with w > 0 is zero, and so is the whole body. Such bodies are set to zero here, exactly, and leave the rest
of the program. (This is facial reduction, for the faces that conditions have in practice.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.solvers import Block
from fivebar_pin.balancing.solvers.cones import outside
from fivebar_pin.balancing.variables.part import Placed

__all__ = ["empty", "without"]

_ZERO = 1e-9  # coefficient of a condition that counts as none [scaled, rows of unit size]
_HELD = 0.5  # w at a vertex is 0 or 1; this tells which [-]
_ROUND_OFF = (
    1e-13  # what is left of a condition that says nothing [of its largest coefficient, and of rows of length one]
)


def empty(blocks: Sequence[Block], parts: Sequence[Placed], n: int) -> tuple[bool, ...]:
    """Return for each part whether the constraints leave none of it."""
    masses = [p.apex for p in parts if p.apex is not None]
    rest = np.setdiff1d(np.arange(n), masses)
    equal, least = _stacked(blocks, "zero", n), _stacked(blocks, "nonneg", n)
    least = least[np.abs(least[:, rest]).max(axis=1, initial=0.0) == 0.0]
    basis = _kernel(np.column_stack([equal[:, rest], equal[:, -1]]).T)  # lambda with none but masses, and no constant
    rows = np.concatenate([basis.T @ equal[:, masses], least[:, masses]])
    if not np.abs(rows).max(initial=0.0) > _ZERO:
        return (False,) * len(parts)
    gone = iter(_vanishing(rows, least[:, -1], basis.shape[1]))
    return tuple(p.apex is not None and next(gone) for p in parts)


def without(blocks: Sequence[Block], parts: Sequence[Placed], gone: Sequence[bool], n: int) -> list[Block]:
    """Return the constraints with the parts that are `gone` set to zero and taken out of all other rows."""
    if not any(gone):
        return list(blocks)
    columns = np.concatenate([np.arange(n)[p.where] for p, g in zip(parts, gone, strict=True) if g])
    out = [Block("bodies that the conditions leave empty", "zero", np.eye(n)[columns], np.zeros(columns.size))]
    for block in blocks:
        G = block.G.copy()
        G[:, columns] = 0.0
        if block.cone in ("zero", "nonneg"):
            out += _kept_rows(block, G)
        elif np.abs(G).max(initial=0.0) > 0.0 or outside(block.cone, block.g) > 0.0:
            out.append(replace(block, G=G))
    return out


def _stacked(blocks: Sequence[Block], cone: str, n: int) -> Array:
    """Return the rows [G, g] (k, n + 1) of one kind of cone, of unit size, but for those that say nothing."""
    found = [np.column_stack([b.G, b.g]) for b in blocks if b.cone == cone]
    rows = np.concatenate(found) if found else np.zeros((0, n + 1))
    size = np.abs(rows).max(axis=1, initial=0.0)
    said = size > _ROUND_OFF
    return np.asarray(rows[said] / size[said, None])


def _kernel(A: Array) -> Array:
    """Return an orthonormal basis (n, k) of the kernel of A."""
    if not A.shape[1]:
        return np.zeros((0, 0))
    _, s, Vt = np.linalg.svd(A)
    return np.asarray(Vt[int((s > _ZERO).sum()) :].T)


def _vanishing(rows: Array, constants: Array, free: int) -> tuple[bool, ...]:
    """Return which masses some combination of the rows, the first `free` of any sign, holds at zero."""
    from scipy.optimize import linprog

    k, count = rows.shape
    # Variables: multipliers (k), w (count); maximise the sum of w <= 1 under rows.T @ multipliers + w <= 0.
    A = np.hstack([rows.T, np.eye(count)])
    total = np.concatenate([np.zeros(free), constants, np.zeros(count)])[None]
    bounds = [(None, None)] * free + [(0.0, None)] * (k - free) + [(0.0, 1.0)] * count
    cost = np.concatenate([np.zeros(k), -np.ones(count)])
    found = linprog(cost, A_ub=A, b_ub=np.zeros(count), A_eq=total, b_eq=[0.0], bounds=bounds)
    held = np.zeros(count) if found.x is None else np.asarray(found.x, dtype=np.float64)[k:]
    return tuple(bool(w > _HELD) for w in held)


def _kept_rows(block: Block, G: Array) -> list[Block]:
    """Return a block of single rows with other coefficients, without the rows that say nothing any more."""
    nothing = _ROUND_OFF * np.maximum(1.0, np.abs(block.G).max(axis=1, initial=0.0))
    holds = np.abs(block.g) <= nothing if block.cone == "zero" else block.g >= -nothing
    said = np.logical_or(np.abs(G).max(axis=1, initial=0.0) > nothing, np.logical_not(holds))
    if not said.any():
        return []
    label = block.label
    if not isinstance(label, str):
        label = tuple(name for name, kept in zip(label, said, strict=True) if kept)
    inward = None if block.inward is None else block.inward[said]
    return [replace(block, label=label, G=G[said], g=block.g[said], inward=inward)]
