"""Whether all motion of a mechanism is parallel to one plane.

It is when every axis of rotation is parallel to one normal n, no rotation advances along its axis (a screw), and every
slide is across n. Where nothing turns (a gantry), n is across all slides, which must span a plane. Rotations about n
keep all this true, so that one configuration decides; nothing depends on where the world's origin is.
"""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import TINY, Array

__all__ = ["PARALLEL", "plane_normal"]


PARALLEL = 1e-6
"""Angle up to which axes count as parallel [rad].

A file that writes a right angle as 1.570796 is off by 3e-7. What such a tilt lifts out of the plane is a millionth of
the motion; a tilt meant to be one (a skewed hinge, a tolerance study) is a thousand times as much.
"""
_SNAP = 1e-12  # component of a unit normal that is round-off [-]


def plane_normal(S: Array, length: float) -> Array | None:
    """Return the unit normal (3,) of the plane of motion in world axes, its largest component positive; None if none.

    Args:
        S: motion subspace of every velocity coordinate, at the world origin (n, 6, nv), see `Poses`.
        length: of the chain [m].
    """
    columns = np.moveaxis(S, 1, 2).reshape(-1, 6)
    linear, angular = columns[:, :3], columns[:, 3:]
    speed = np.linalg.norm(angular, axis=1)
    turns = speed > PARALLEL
    n = angular[turns][0] / speed[turns][0] if turns.any() else _across(linear)
    if n is None:
        return None
    tilt = np.linalg.norm(np.cross(angular, n), axis=1)
    advance = np.einsum("ki,ki->k", linear, angular) / np.maximum(speed, TINY)  # along its own axis, per radian
    leaving = np.where(turns, np.abs(advance) / length, np.abs(linear @ n) / np.maximum(_sizes(linear), TINY))
    if max(tilt.max(initial=0.0), leaving.max(initial=0.0)) > PARALLEL:
        return None
    n = n * np.sign(n[int(np.argmax(np.abs(n)))])
    snapped = np.where(np.abs(n) < _SNAP, 0.0, n)
    return np.asarray(snapped / np.linalg.norm(snapped))


def _across(slides: Array) -> Array | None:
    """Return the normal (3,) across directions (k, 3); None where they do not span a plane or more."""
    moving = slides[_sizes(slides) > 0.0]
    if not moving.shape[0]:
        return None
    _, s, axes = np.linalg.svd(moving / _sizes(moving)[:, None], full_matrices=False)
    return np.cross(axes[0], axes[1]) if s.size > 1 and s[1] > PARALLEL * s[0] else None


def _sizes(x: Array) -> Array:
    return np.asarray(np.linalg.norm(x, axis=1))
