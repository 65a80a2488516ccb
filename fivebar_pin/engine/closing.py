"""Closing the loops at one sample: Newton's method in the passive coordinates.

    J_p dx = -c(q),        q <- q + dx

Each step squares the residual. It ends at round-off: as soon as the residual is there, or one step after it has passed
below what squares to it.
"""

from __future__ import annotations

from math import inf

from fivebar_pin._arrays import Array
from fivebar_pin.engine.blocks import factorise, solve
from fivebar_pin.engine.compiled import compiled
from fivebar_pin.engine.rows import jacobian, look
from fivebar_pin.engine.tables import (
    CLOSED,
    GOING,
    LEAD,
    MISFIT,
    MOVED,
    NV,
    RESIDUAL,
    ROW_SIZE,
    ROWS,
    ROWS_END,
    SCALE,
    SETTLED,
    Integers,
    X,
)  # fmt: skip
from fivebar_pin.engine.tree import integrate, place
from fivebar_pin.engine.vectors import larger

__all__ = ["close"]

ROUND_OFF = 1e-15  # scaled residual that is round-off of lengths of the chain [-]
_POLISHED = 1e-9  # scaled residual, or step, below which one more step reaches round-off [-]
_MOST = 8  # steps
_ASTRAY = 1.0  # largest step of a coordinate that is a correction [rad, or chain lengths]


@compiled
def close(I: Integers, W: Array) -> None:
    """Close q by its passive coordinates and set the flag `CLOSED`; `MOVED` gathers what they move by.

    What the closures are there, and the factors of their passive columns, stand in W. Rows of rounded dimensions that
    contradict each other are met in the sense of least squares, up to the misfit of the chain: there it is the
    correction that tells the end.
    """
    last, steps = False, 0
    W[I[GOING]], W[I[SETTLED]] = 1.0, 0.0
    while W[I[GOING]] == 1.0:
        place(I, W)
        look(I, W)
        jacobian(I, W)
        regular, error = factorise(I, W), largest_residual(I, W)
        closed = regular and (last or error <= ROUND_OFF)
        W[I[CLOSED]] = 1.0 if closed else 0.0
        W[I[GOING]] = 1.0 if regular and not closed and error < inf and steps < _MOST else 0.0
        settled = error <= W[I[MISFIT]] and W[I[SETTLED]] == 1.0
        last, steps = error < _POLISHED or settled, steps + 1
        if W[I[GOING]] == 1.0:
            _step(I, W)


@compiled
def largest_residual(I: Integers, W: Array) -> float:
    """Return the largest residual, scaled; infinite where one is not a number."""
    most = 0.0
    for r in range(I[ROWS], I[ROWS_END], ROW_SIZE):
        most = larger(most, abs(W[I[r + RESIDUAL]]))
    return most


@compiled
def _step(I: Integers, W: Array) -> None:
    """Take one step of Newton; where it is too long for a correction, none, and the flag `GOING` is taken down.

    The flag `SETTLED` says whether the step is so short that one more reaches round-off.
    """
    for r in range(I[ROWS], I[ROWS_END], ROW_SIZE):
        W[I[r + LEAD]] = -W[I[r + RESIDUAL]]
    for k in range(I[NV]):
        W[I[X] + k] = 0.0
    solve(I, W)
    W[I[SETTLED]] = 1.0
    for k in range(I[NV]):
        step = W[I[X] + k]
        if not abs(step) <= _ASTRAY * W[I[SCALE] + k]:
            W[I[GOING]] = 0.0
        if not abs(step) < _POLISHED * W[I[SCALE] + k]:
            W[I[SETTLED]] = 0.0
        W[I[MOVED] + k] += step
    if W[I[GOING]] == 1.0:
        integrate(I, W, I[X])
