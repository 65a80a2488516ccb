"""From the variables of a solved problem back to ten inertial parameters per body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing._material import Material
from fivebar_pin.balancing._parameters import from_pseudo_inertia, pseudo_inertia
from fivebar_pin.balancing.design import Change, change_of

if TYPE_CHECKING:
    from fivebar_pin.balancing.problem import BalanceProblem


@dataclass(frozen=True, slots=True, eq=False)
class Lifted:
    """Parameters of all bodies (nb, 10), what was added and removed, the smallest pseudo-inertia eigenvalue."""

    parameters: Array
    added: tuple[Change, ...]
    removed: tuple[Change, ...]
    lowest: float


def lift(problem: BalanceProblem, y: Array) -> Lifted:
    """Return the bodies that variables y (n,) stand for.

    Planar material is made flat, at the height of the present body's centre of mass.
    """
    chain, space = problem.chain, problem.space
    present = np.array(chain.inertial_parameters)
    pi = np.array(present)
    pieces: dict[int, dict[int, Array]] = {1: {}, -1: {}}
    lowest = np.inf
    for m in problem.materials:
        own = y[m.start : m.start + m.size] * problem.mass
        unit = np.append(space.length**space.orders, np.full(m.size - m.width, space.length**2))
        z = own * unit
        pieces[m.sign][m.body] = _ten(problem, m, z)
        lowest = min(lowest, lowest_eigenvalue(z[: m.width], planar=m.planar))
    for b, added in pieces[1].items():
        pi[b] = added if problem.mode == "redesign" else present[b] + added
    for b, removed in pieces[-1].items():
        pi[b] = pi[b] - removed
        lowest = min(lowest, lowest_eigenvalue(space.of(pi)[b], planar=space.planar))
    return Lifted(
        pi,
        tuple(change_of(chain.joints[b], x) for b, x in pieces[1].items()),
        tuple(change_of(chain.joints[b], x) for b, x in pieces[-1].items()),
        float(lowest),
    )


def lowest_eigenvalue(x: Array, *, planar: bool) -> float:
    """Return the smallest eigenvalue of the pseudo-inertia of one body (width,)."""
    if planar:
        h = float(np.hypot(x[1], x[2]))
        return float(np.linalg.eigvalsh(np.array([[x[3], h], [h, x[0]]]))[0])
    return float(np.linalg.eigvalsh(pseudo_inertia(x))[0])


def _ten(problem: BalanceProblem, m: Material, z: Array) -> Array:
    if not m.planar:
        return z
    axes = problem.space.axes[m.body]
    present = problem.chain.inertial_parameters[m.body]
    height = float(axes[2] @ present[1:4]) / float(present[0]) if present[0] > 0.0 else 0.0
    P = np.zeros((4, 4))
    P[:2, :2] = m.second_moments(z)
    P[:2, 2] = P[2, :2] = height * z[1:3]
    P[2, 2] = height**2 * z[0]
    P[:2, 3] = P[3, :2] = z[1:3]
    P[2, 3] = P[3, 2] = height * z[0]
    P[3, 3] = z[0]
    turn = np.eye(4)
    turn[:3, :3] = axes.T
    return np.asarray(from_pseudo_inertia(turn @ P @ turn.T))
