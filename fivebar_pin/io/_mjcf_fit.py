"""Primitive shapes that MuJoCo lays around or through a mesh: <geom type="box" mesh="..."/>.

In the mesh's principal axes, z along the least moment of inertia, the shape has the half lengths of the box of equal
inertia, b_i = sqrt(6 (I_j + I_k - I_i) / m) / 2, or with compiler fitaabb those of the box around the points.
"""

from __future__ import annotations

import numpy as np

from fivebar_pin._arrays import Array
from fivebar_pin.io._mjcf_assets import Mesh
from fivebar_pin.io._mjcf_meshes import mesh_inertia, mesh_points
from fivebar_pin.io._mjcf_reader import homogeneous

__all__ = ["fitted"]


def fitted(mesh: Mesh, kind: str, scale: float, *, around: bool) -> tuple[list[float], Array]:
    """Return the sizes of a shape fitted to a mesh (half lengths, as MJCF has them) and its pose in the mesh's axes.

    Args:
        mesh: the mesh.
        kind: "box", "capsule", "cylinder", "ellipsoid" or "sphere".
        scale: factor of the sizes (MJCF's fitscale).
        around: fit the box around the points, not the box of equal inertia.

    Raises:
        ValueError: the mesh cannot be read, or has no volume; says why.
    """
    inertia = mesh_inertia(mesh)
    moments, axes = np.linalg.eigh(np.array(inertia.inertia))
    R = axes[:, ::-1] * [1.0, 1.0, np.sign(np.linalg.det(axes[:, ::-1]))]
    centre = np.array(inertia.lever)
    if around:
        points = (mesh_points(mesh) - centre) @ R
        low, high = points.min(axis=0), points.max(axis=0)
        half, centre = 0.5 * (high - low), centre + R @ (0.5 * (low + high))
    else:
        half = 0.5 * np.sqrt(np.maximum(6.0 * (moments.sum() - 2.0 * moments[::-1]) / inertia.mass, 0.0))
    return [scale * float(x) for x in _sizes(kind, half, around=around)], homogeneous(centre, R)


def _sizes(kind: str, half: Array, *, around: bool) -> list[float]:
    a, b, c = half
    if kind in ("box", "ellipsoid"):
        return [a, b, c]
    if kind == "sphere":
        return [max(a, b, c) if around else (a + b + c) / 3.0]
    radius = max(a, b) if around else 0.5 * (a + b)
    if kind == "cylinder":
        return [radius, c]
    return [radius, max(0.0, c - radius if around else c - 0.5 * radius)]
