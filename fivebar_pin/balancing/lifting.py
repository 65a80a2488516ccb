"""From the variables of a solved problem back to ten inertial parameters per body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fivebar_pin._arrays import Array, Immutable
from fivebar_pin.balancing.design import Change, change_of
from fivebar_pin.balancing.parameters import Space, from_pseudo_inertia, pseudo_inertia
from fivebar_pin.balancing.variables.material import Material
from fivebar_pin.chain import ClosedChain

if TYPE_CHECKING:
    from fivebar_pin.balancing.problem import BalanceProblem

__all__ = ["Lifted", "height_of", "lift", "linear", "lowest_eigenvalue"]


@dataclass(frozen=True, slots=True, eq=False)
class Lifted(Immutable):
    """Parameters of all bodies (nb, 10), what was added and removed, the smallest pseudo-inertia eigenvalue."""

    parameters: Array
    added: tuple[Change, ...]
    removed: tuple[Change, ...]
    lowest: float


def lift(problem: BalanceProblem, y: Array) -> Lifted:
    """Return the bodies that variables y (n,) stand for.

    Planar material is made flat, at the height of the present body's centre of mass.
    """
    joints = problem.chain.joints
    present = np.array(problem.chain.inertial_parameters)
    pi = present + problem.arms
    lowest = np.inf
    pieces: dict[int, list[Change]] = {1: [], -1: []}
    for m in problem.materials:
        ten = _ten(problem.chain, problem.space, problem.mass, m, y[m.start : m.start + m.size])
        lowest = min(lowest, lowest_eigenvalue(ten, planar=False))
        pieces[m.sign].append(change_of(joints[m.body], ten))
        if m.sign < 0:
            lowest = min(lowest, lowest_eigenvalue(present[m.body] - ten, planar=False))
        pi[m.body] = ten if problem.mode == "redesign" else pi[m.body] + m.sign * ten
    return Lifted(pi, tuple(pieces[1]), tuple(pieces[-1]), float(lowest))


def lowest_eigenvalue(x: Array, *, planar: bool) -> float:
    """Return the smallest eigenvalue of the pseudo-inertia of one body (4,) or (10,)."""
    if planar:
        h = float(np.hypot(x[1], x[2]))
        return float(np.linalg.eigvalsh(np.array([[x[3], h], [h, x[0]]]))[0])
    return float(np.linalg.eigvalsh(pseudo_inertia(x))[0])


def height_of(chain_parameters: Array, normal: Array) -> float:
    """Return the height of a body's mass centre (10,) along a normal in joint axes [m]; 0 without mass."""
    mass = float(chain_parameters[0])
    return float(normal @ chain_parameters[1:4]) / mass if mass > 0.0 else 0.0


def linear(chain: ClosedChain, space: Space, mass: float, materials: Sequence[Material]) -> Array:
    """Return E (10 nb, n): what variables of all materials change in the ten parameters of all bodies, SI units.

    What `lift` makes of planar variables is linear in them but for the share of second moments between the directions
    of the plane, which planar motion does not feel.
    """
    E = np.zeros((10 * len(chain.joints), sum(m.size for m in materials)))
    for m in materials:
        for k, unit in enumerate(np.eye(m.size)[:10]):  # moments; what cones need besides comes after them
            E[10 * m.body : 10 * m.body + 10, m.start + k] = m.sign * _ten(chain, space, mass, m, unit)
    return E


def _ten(chain: ClosedChain, space: Space, mass: float, m: Material, z: Array) -> Array:
    """Return the ten parameters of a piece, SI units."""
    turn, axes = np.eye(4), np.array(space.axes[m.body])
    turn[:3, :3] = space.length * axes.T
    height = height_of(chain.inertial_parameters[m.body], axes[2]) / space.length
    P = mass * m.pseudo_inertia(z, height)
    return np.asarray(from_pseudo_inertia(turn @ P @ turn.T))
