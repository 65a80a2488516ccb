"""What a dual vector proves, rigorously: a bound on the objective, or that there is no solution.

For any z in the dual cone, any x and r = P x + q - G^T z, every x' with g + G x' in K has

    x'.P x' / 2 + q.x'  >=  -x.P x / 2 + (P x + q).x'  =  -x.P x / 2 + r.x' + z.(G x')  >=  -g.z - x.P x / 2 + r.x',

so with |x'_i| <= b_i the objective is at least -g.z - x.P x / 2 - sum_i |r_i| b_i. And if g.z = -1 and r = G^T z,

    0 <= z.(g + G x') = -1 + r.x',

so a solution has sum_i |r_i| |x'_i| >= 1: there is none with |x'_i| <= b_i when sum_i |r_i| b_i < 1. A solver's z is
first moved into the dual cone, where it has to be exactly; its r is what it is. Round-off is subtracted too.
"""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.balancing.solvers.cones import scaling
from fivebar_pin.balancing.solvers.program import Program

__all__ = ["lower_bound", "reach", "refined", "stationary"]

_RANK = 1e-10  # singular value of the weighted rows that counts as none, relative
_EPSILON = float(np.finfo(np.float64).eps)


def lower_bound(program: Program, P: Array, q: Array, x: Array, z: Array) -> float:
    """Return a number that no objective within the program's sizes is below."""
    z = program.projected(z)
    r = P * x + q - program.G.T @ z
    quadratic = 0.5 * float(x @ (P * x))
    lost = _products(np.abs(r) + _round_off(program, z), program.sizes)
    lost += z.size * _EPSILON * (float(np.abs(program.g) @ np.abs(z)) + quadratic)
    return -float(program.g @ z) - quadratic - lost


def stationary(program: Program, z: Array, target: Array) -> Array:
    """Return z moved onto G^T z = target (n,) by the smallest step; rows that z uses are moved most."""
    weight = np.ones_like(z)
    for block, part in zip(program.blocks, program.slices, strict=True):
        if block.cone != "zero":
            weight[part] = np.minimum(1.0, np.linalg.norm(z[part]))
    across = np.linalg.pinv((weight[:, None] * program.G).T, rcond=_RANK)
    return np.asarray(z + weight * (across @ (target - program.G.T @ z)))


def refined(program: Program, z: Array, target: Array) -> Array:
    """Return z moved onto G^T z = target (n,) by the smallest step in the cones' own measure, so that it stays inside.

    The step is W u with the least |u|, where W scales the unit of each cone to z: a cone is left when |u| is one.
    """
    z = program.projected(z)
    W = np.zeros((z.size, z.size))
    for block, part in zip(program.blocks, program.slices, strict=True):
        W[part, part] = scaling(block.cone, z[part])
    u = np.linalg.lstsq((W @ program.G).T, target - program.G.T @ z, rcond=_RANK)[0]
    return np.asarray(z + W @ u)


def reach(program: Program, z: Array, g: Array) -> float:
    """Return what sum_i |r_i| b_i comes to for a ray z of the dual cone with g.z = -1: a proof if less than one."""
    r = np.abs(program.G.T @ z)
    return _products(r + _round_off(program, z), program.sizes) + z.size * _EPSILON * float(np.abs(g) @ np.abs(z))


def _round_off(program: Program, z: Array) -> Array:
    return np.asarray(z.size * _EPSILON * (np.abs(program.G).T @ np.abs(z)))


def _products(r: Array, sizes: Array) -> float:
    """Return r.sizes, where a zero r makes nothing of an unbounded variable."""
    return float(r[r > 0.0] @ sizes[r > 0.0])
