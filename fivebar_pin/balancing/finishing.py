"""From the variables of a solved program to bodies that meet the conditions exactly."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.change import Change
from fivebar_pin.balancing.conic import ConicForm

__all__ = ["compact", "exact", "finished", "made"]

_LEAST_SHARE = 1e-9  # share in the step onto the conditions of a part that hardly has any material [moving masses]
_RANK = 1e-10  # singular value of the conditions, weighted by shares, that counts as none, relative
_STEPS = 3  # onto the conditions; each leaves the round-off of the one before
_ROUNDS = 20  # of swelling what is too dense and moving back onto conditions that feel it


def made(form: ConicForm, y: Array) -> tuple[Array, tuple[Change, ...], tuple[Change, ...], float]:
    """Return the bodies (nb, 10) of variables y (n,), what was added and removed, the smallest eigenvalue of a body."""
    pi = np.array(form.setting.chain.inertial_parameters) + form.setting.arms
    added: list[Change] = []
    removed: list[Change] = []
    lowest = np.inf
    for p in form.parts:
        made = p.part.make(form.setting, y[p.where], pi)
        pi, lowest = made.parameters, min(lowest, made.lowest)
        added += made.added
        removed += made.removed
    return pi, tuple(added), tuple(removed), float(lowest)


def compact(form: ConicForm, y: Array, felt: npt.NDArray[np.bool_]) -> Array:
    """Return the variables with the least inertia that a piece can have, where nothing depends on it."""
    y = np.array(y)
    for p in form.parts:
        y[p.where] = p.part.compact(y[p.where], felt[p.where])
    return y


def finished(form: ConicForm, y: Array, drop: float, felt: npt.NDArray[np.bool_]) -> tuple[Array, float]:
    """Return variables that meet the conditions, compact where nobody feels it and nowhere denser than their material.

    A solver keeps its cones to an absolute error; of a light or a flat body that is all of its least inertia.

    Args:
        form: the program.
        y: variables (n,).
        drop: share of the moving mass below which material is left out altogether.
        felt: which variables anything in the problem depends on (n,).

    Returns:
        The variables and the largest residual of the conditions left, scaled.
    """
    A, b = _conditions(form)
    for _ in range(_ROUNDS):
        y = compact(form, exact(form, y, drop)[0], felt)  # inertias about centres that have moved a hair
        y, before = _swollen(form, y), y
        if np.array_equal(y, before) or _residual(A, b, y) <= _residual(A, b, before):
            break
    return y, _residual(A, b, y)


def exact(form: ConicForm, y: Array, drop: float) -> tuple[Array, float]:
    """Move y onto the conditions by the smallest step, measured in shares of each body's own material.

    Args:
        form: the program.
        y: variables (n,).
        drop: share of the moving mass below which material is left out altogether.

    Returns:
        The variables and the largest residual left, scaled.
    """
    A, b = _conditions(form)
    mass = np.array([p.part.share(y[p.where]) for p in form.parts])
    share = np.where((mass < drop) | np.array(form.gone), 0.0, np.maximum(mass, _LEAST_SHARE))
    share = np.repeat(share, [p.part.size for p in form.parts])
    y = np.where(share > 0.0, y, 0.0)
    for _ in range(_STEPS if A.size else 0):
        y = y - share * np.linalg.lstsq(A * share, A @ y + b, rcond=_RANK)[0]
    return y, _residual(A, b, y)


def _conditions(form: ConicForm) -> tuple[Array, Array]:
    """Return A (k, n), b (k,) of all that is to hold exactly, A y + b = 0."""
    conditions = form.setting.conditions
    B = np.zeros((0, form.X0.size)) if conditions is None else conditions.basis
    held = np.zeros(len(B)) if conditions is None else conditions.offset / form.setting.mass
    A = np.concatenate([B @ form.E, form.fixed[:, :-1]])
    return A, np.concatenate([B @ form.X0 + held, -form.fixed[:, -1]])


def _residual(A: Array, b: Array, y: Array) -> float:
    """Return the largest of A y + b, of variables of at least unit size."""
    return float(np.abs(A @ y + b).max(initial=0.0)) / max(1.0, float(np.abs(y).max(initial=0.0)))


def _swollen(form: ConicForm, y: Array) -> Array:
    """Return the variables with the least second moments that the density of each material leaves."""
    y = np.array(y)
    for p in form.parts:
        y[p.where] = p.part.swollen(y[p.where])
    return y
