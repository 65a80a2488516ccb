"""6d: two frames coincide, R_1^T (p_2 - p_1) = 0 and log(R_1^T R_2) = 0."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from fivebar_pin._arrays import Array, cross, skew
from fivebar_pin.closures.closure import Mark
from fivebar_pin.closures.frame_closure import FrameClosure, FramePair, point_drift, point_rows, point_selector
from fivebar_pin.closures.rows import Row, along, turned

__all__ = ["Weld", "log3"]

_SMALL = 1e-3  # angle below which the series of the left Jacobian is exact to round-off [rad]


@dataclass(frozen=True, eq=False)
class Weld(FrameClosure, word="6d"):
    """Two frames coincide: the bodies are one. Six rows [m, rad]."""

    row_names: ClassVar[tuple[str, ...]] = ("x", "y", "z", "rx", "ry", "rz")
    row_units: ClassVar[tuple[str, ...]] = ("m", "m", "m", "rad", "rad", "rad")

    @property
    def mark(self) -> Mark:
        """A box."""
        return Mark("box")

    @property
    def rows(self) -> tuple[Row, ...]:
        """Along the three axes, turned about them."""
        return (*(along(axis) for axis in np.eye(3)), *(turned(axis) for axis in np.eye(3)))

    def residual(self, pair: FramePair) -> Array:
        """Return the three rows of the points and the rotation vector of R_1^T R_2."""
        return np.concatenate([point_rows(pair), log3(_turn(pair))], axis=-1)

    def selector(self, pair: FramePair) -> Array:
        """Return T (..., 6, 6)."""
        T = point_selector(pair, 6)
        T[..., 3:, 3:] = np.matmul(_left_jacobian_inverse(log3(_turn(pair))), np.swapaxes(pair.R1, -1, -2))
        return T

    def drift(self, pair: FramePair, V1: Array, V2: Array, A1: Array, A2: Array) -> Array:
        """Return the second rate at zero joint accelerations; the rotation rows are exact on the closed loop."""
        R1T = np.swapaxes(pair.R1, -1, -2)
        alpha = A2[..., 3:] - A1[..., 3:] - cross(V1[..., 3:], V2[..., 3:])
        turn = np.matmul(R1T, alpha[..., None])[..., 0]
        return np.concatenate([point_drift(pair, V1, V2, A1, A2), turn], axis=-1)


def _turn(pair: FramePair) -> Array:
    return np.asarray(np.matmul(np.swapaxes(pair.R1, -1, -2), pair.R2))


def log3(Q: Array) -> Array:
    """Return the rotation vector of Q, (..., 3, 3) -> (..., 3) [rad], accurate near zero and near half a turn."""
    from scipy.spatial.transform import Rotation

    flat = np.reshape(Q, (-1, 3, 3))
    return np.asarray(Rotation.from_matrix(flat).as_rotvec()).reshape(*Q.shape[:-2], 3)


def _left_jacobian_inverse(phi: Array) -> Array:
    """Return J_l^-1(phi): rate of the rotation vector = J_l^-1 @ (angular velocity in the fixed axes)."""
    angle2 = np.sum(phi * phi, axis=-1)[..., None, None]
    angle = np.sqrt(angle2)
    half = 0.5 * angle
    small = angle < _SMALL
    safe = np.where(small, 1.0, half)
    b = np.where(small, 1.0 / 12.0 + angle2 / 720.0, (1.0 - safe / np.tan(safe)) / np.where(small, 1.0, angle2))
    K = skew(phi)
    return np.asarray(np.eye(3) - 0.5 * K + b * np.matmul(K, K))
