"""Bodies as rows of numbers, many designs at once.

A row is (m, c_x, c_y, c_z, C_xx, C_xy, C_yy, C_xz, C_yz, C_zz): mass, mass centre and moments about it. Pinocchio's
inertial parameters are (m, m c, I) in the same order with the moments I about the origin.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from fivebar_pin._arrays import Array

__all__ = ["about_centre", "about_origin", "inertia_of", "joined", "packed", "row_of", "symmetric", "turned"]

_UPPER = ((0, 0, 1, 0, 1, 2), (0, 1, 1, 2, 2, 2))  # xx, xy, yy, xz, yz, zz
_PLACES = np.array([[0, 1, 3], [1, 2, 4], [3, 4, 5]])


def symmetric(moments: Array) -> Array:
    """Return moments (..., 6) as matrices (..., 3, 3)."""
    return np.asarray(moments[..., _PLACES])


def packed(mass: Array, centre: Array, tensor: Array) -> Array:
    """Return rows (n, 10) of masses (n,), centres (n, 3) and moments about them (n, 3, 3)."""
    return np.concatenate([mass[:, None], centre, tensor[:, _UPPER[0], _UPPER[1]]], axis=1)


def turned(rows: Array, R: Array) -> Array:
    """Return rows (n, 10) in other axes, x = R x': R (3, 3) or (n, 3, 3)."""
    back = np.swapaxes(R, -1, -2)
    tensor = np.matmul(np.matmul(back, symmetric(rows[:, 4:])), R)
    return packed(rows[:, 0], np.matmul(back, rows[:, 1:4, None])[..., 0], tensor)


def joined(one: Array, other: Array) -> Array:
    """Return rows of two bodies (n, 10) each that are one."""
    mass = one[:, :1] + other[:, :1]
    share = np.divide(other[:, :1], mass, out=np.zeros_like(mass), where=mass != 0.0)
    apart = other[:, 1:4] - one[:, 1:4]
    moments = one[:, 4:] + other[:, 4:] + one[:, :1] * share * _of_a_point(apart)
    return np.concatenate([mass, one[:, 1:4] + share * apart, moments], axis=1)


def about_origin(rows: Array) -> Array:
    """Return inertial parameters (n, 10) of rows."""
    mass, centre = rows[:, :1], rows[:, 1:4]
    return np.concatenate([mass, mass * centre, rows[:, 4:] + mass * _of_a_point(centre)], axis=1)


def about_centre(pi: Array) -> Array:
    """Return rows of inertial parameters (n, 10); the centre of what has no mass is the origin."""
    mass = pi[:, :1]
    centre = np.divide(pi[:, 1:4], mass, out=np.zeros_like(pi[:, 1:4]), where=mass != 0.0)
    return np.concatenate([mass, centre, pi[:, 4:] - mass * _of_a_point(centre)], axis=1)


def row_of(body: pin.Inertia) -> Array:
    """Return the row (10,) of a body."""
    return np.array([body.mass, *body.lever, *body.inertia[_UPPER]])


def inertia_of(row: Array) -> pin.Inertia:
    """Return the body of a row (10,); round-off may leave a point a moment that is less than nothing."""
    body = pin.Inertia.Zero()
    if row[0] != 0.0 or row[4:].any():
        body.mass, body.lever, body.inertia = float(row[0]), np.array(row[1:4]), symmetric(row[4:])
    return body


def _of_a_point(c: Array) -> Array:
    """Return the moments (n, 6) of points of unit mass at c (n, 3): |c|^2 - c c^T."""
    x, y, z = c.T
    return np.stack([y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y], axis=1)
